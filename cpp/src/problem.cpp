#include "problem.hpp"

#include <algorithm>
#include <cmath>

#include "supple/error.hpp"

namespace supple {

Problem::Problem(System& system_, const Vector& start, const Vector& prescribed,
                 const NewtonSettings& settings_, const Progress& progress)
    : system(system_), settings(settings_), has_energy(system_.has_energy()),
      minimises(has_energy && system_.kind() == Kind::Cholesky), progress_(progress),
      start_(start) {
  require_size("start", start.size(), system.dofs(), "one entry for each dof");
  require_size("prescribed", prescribed.size(), system.dofs(), "one entry for each dof");
  is_free_ = Mask::Constant(system.dofs(), false);
  for (const Index dof : system.reduction().dof)
    is_free_[dof] = true;
  travel_ = is_free_.select(Vector::Zero(start.size()).array(), (prescribed - start).array());
  offset_ = Vector::Zero(system.dofs());
  if (settings.warm) offset_ = system.residual(start, 1.0);
  result.u = start;
}

Vector Problem::residual(const Vector& u, double s) const {
  at_ = u;
  Vector r = system.residual_beside(u, loads(s), external_);
  if (settings.warm) r -= held_back(s) * offset_;
  return r;
}

double Problem::energy(const Vector& u, double s) const {
  double total = system.energy(u, loads(s));
  if (settings.warm) total -= held_back(s) * offset_.dot(u);
  return total;
}

Vector Problem::pull(const Vector& u) const {
  return settings.warm ? Vector(-offset_) : system.external(u);
}

Vector Problem::missing(const Vector& u, double s) const {
  return is_free_.select(Vector::Zero(u.size()).array(), (start_ + s * travel_ - u).array());
}

double Problem::free_norm(const Vector& r) const {
  return std::sqrt(is_free_.select(r.array().square(), 0.0).sum());
}

double Problem::scale(const Vector& u, const Vector& r, double s) const {
  const double fixed = std::sqrt(is_free_.select(0.0, r.array().square()).sum());
  const double force =
      at_.size() == u.size() && at_ == u ? external_.norm() : system.external(u).norm();
  return std::max(std::abs(loads(s)) * force, fixed);
}

double Problem::tolerance(const Vector& u, const Vector& r, double s) const {
  return settings.rtol * scale(u, r, s) + settings.atol;
}

bool Problem::admissible(const Vector& u, double s) {
  if (settings.refuse_inversion) {
    const VolumeRatio ratio = system.volume_ratio(u);
    if (ratio.value < result.worst.value || ratio.value <= 0.0) result.worst = ratio;
    if (!(ratio.value > 0.0)) return false;
  }
  return !has_energy || std::isfinite(energy(u, s));
}

void Problem::record(const Iteration& iteration) {
  result.history.push_back(iteration);
  if (progress_) progress_(result.history.back());
}

} // namespace supple
