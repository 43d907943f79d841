#include "corrector.hpp"

#include <algorithm>
#include <cmath>

namespace supple {

namespace {

constexpr double kStep = 1e-4;    // accuracy of a correction, where it is iterated
constexpr double kTangent = 1e-6; // and of the path's tangent
constexpr double kChord = 0.1;    // fall of the residual with which a factor is kept
constexpr double kRough = 1e-2;   // of the forces, taken where a kink of the law stops the fall
constexpr double kShortest = 0.1; // of a correction
constexpr int kSlow = 3;          // corrections that hardly help
constexpr int kMost = 15;         // corrections of a point

} // namespace

bool Corrector::begin(ArcPoint& point) {
  if (!factorise(point)) return false;
  unit_ = std::max(w_.squaredNorm(), 1e-300);
  point.du = Vector::Zero(w_.size());
  point.ds = 1.0;
  turn(point);
  return true;
}

bool Corrector::refresh(ArcPoint& point) {
  if (!factorise(point)) return false;
  turn(point);
  return true;
}

bool Corrector::correct(ArcPoint& point, double share) {
  p_.result.worst = {};
  if (!p_.admissible(point.u, point.s)) return false;
  share_ = share;
  Force now = force(point);
  record(point, now, 0.0, 1.0);
  double before = 0.0;
  int slow = 0;
  for (steps_ = 1; steps_ <= kMost; ++steps_) {
    const bool fresh = steps_ == 1 || now.norm > kChord * before;
    if (fresh && !factorise(point)) return false;
    before = now.norm;
    if (!step(point, now)) break;
    if (now.norm <= share * now.scale + p_.settings.atol) {
      turn(point);
      return true;
    }
    slow += fresh && now.norm > 0.5 * before ? 1 : 0;
    if (slow > kSlow) break;
  }
  if (!(now.norm <= kRough * now.scale)) return false;
  turn(point);
  return true;
}

/// One correction, shortened until it helps; the first may trade a stretch for a turn.
bool Corrector::step(ArcPoint& point, Force& now) {
  Vector d = p_.system.solve(-now.r, kStep);
  const double ds = -dot(point.du, d) / (point.ds + dot(point.du, w_));
  d += ds * w_;
  if (!d.allFinite()) return false;
  for (double a = 1.0; a >= kShortest; a *= 0.5) {
    ArcPoint next{point.u + a * d, point.s + a * ds, {}, point.ds};
    if (!p_.admissible(next.u, next.s)) continue;
    Force then = force(next);
    if (!(then.norm < now.norm || (steps_ == 1 && std::isfinite(then.norm)))) continue;
    next.du = std::move(point.du);
    point = std::move(next);
    now = std::move(then);
    record(point, now, a * d.cwiseAbs().maxCoeff(), a);
    return true;
  }
  return false;
}

Corrector::Force Corrector::force(const ArcPoint& point) const {
  Vector r = p_.residual(point.u, point.s);
  const double norm = p_.free_norm(r), scale = p_.scale(point.u, r, point.s);
  return {std::move(r), norm, scale};
}

void Corrector::record(const ArcPoint& point, const Force& now, double step, double length) {
  p_.result.last_residual = now.r;
  const double tolerance = share_ * now.scale + p_.settings.atol;
  p_.record({point.s, step > 0.0 ? steps_ : 0, now.norm, tolerance, step, length, 0.0});
}

/// Factorise K, and w = du/ds along the path.
bool Corrector::factorise(const ArcPoint& point) {
  ++factors_;
  p_.assemble_tangent(point.u, point.s);
  const FactorStatus status = p_.system.factorise();
  const bool indefinite = status.cause == FactorStatus::Cause::NotPositiveDefinite;
  if (!status.ok() && !(indefinite && p_.system.factorise_indefinite().ok())) return false;
  Vector pull = p_.pull(point.u);
  if (p_.travel().cwiseAbs().maxCoeff() > 0.0) pull -= p_.system.apply(p_.travel());
  w_ = p_.system.solve(pull, kTangent) + p_.travel();
  return w_.allFinite();
}

/// The unit tangent from w, pointing on from the tangent that the point brought along.
void Corrector::turn(ArcPoint& point) const {
  const double along = dot(point.du, w_) + point.ds;
  const double scale = std::copysign(1.0 / std::sqrt(dot(w_, w_) + 1.0), along);
  point.du = scale * w_;
  point.ds = scale;
}

} // namespace supple
