#include "supple/inverse_solver.hpp"

#include <algorithm>

#include "relabelling.hpp"
#include "stopwatch.hpp"
#include "supple/krylov.hpp"

namespace supple {
namespace {

constexpr double kFactorRate = 0.05; // flops of a factorisation over entries of L, in iterations
constexpr double kMostSaved = 40.0;  // iterations: large factors run at a higher rate
constexpr int kFewest = 30;          // iterations that are always granted

} // namespace

InverseSolver::InverseSolver(const BlockPattern& pattern, const Reduction& reduction,
                             const Vector& points, Kind kind)
    : pattern_(pattern), reduction_(reduction), mirror_(mirror(pattern, reduction)),
      symmetric_(kind) {
  Mask free = Mask::Constant(pattern.dofs(), false);
  for (const Index dof : reduction.dof)
    free[dof] = true;
  relabelling_ = std::make_unique<Relabelling>(pattern, free, points);
}

InverseSolver::~InverseSolver() = default;

FactorStatus InverseSolver::prepare(const Vector& tangent, const ConstVector& u) {
  tangent_ = &tangent;
  relabelling_->update(u);
  fresh_ = false;
  return kept_ == nullptr || worn_ ? factorise() : FactorStatus{};
}

FactorStatus InverseSolver::factorise() {
  {
    const Stopwatch watch(work.factor);
    if (!analysed_) symmetric_.analyse(reduction_.pattern);
    analysed_ = true;
    relabelling_->scale_columns(*tangent_, scaled_);
    reduced_.resize(reduction_.pattern.nonzeros());
    for (std::size_t k = 0; k < mirror_.size(); ++k) {
      reduced_[static_cast<Eigen::Index>(k)] =
          0.5 * (scaled_[reduction_.source[k]] + scaled_[mirror_[k]]);
    }
    ++work.symmetric;
    const FactorStatus status = symmetric_.factorise(reduced_);
    kept_ = status.ok() ? &symmetric_ : nullptr;
    fresh_ = status.ok();
    worn_ = false;
    if (status.ok() || status.cause == FactorStatus::Cause::NotFinite) return status;
  }
  return factorise_lu();
}

FactorStatus InverseSolver::factorise_lu() {
  const Stopwatch watch(work.factor);
  if (!full_) {
    Mask free = Mask::Constant(pattern_.dofs(), false);
    for (const Index dof : reduction_.dof)
      free[dof] = true;
    full_ = std::make_unique<Reduction>(reduce(pattern_, free, Storage::Full));
    lu_.analyse(full_->pattern);
  }
  relabelling_->scale_columns(*tangent_, scaled_);
  reduced_.resize(full_->pattern.nonzeros());
  full_->gather(scaled_, reduced_);
  ++work.lu;
  const FactorStatus status = lu_.factorise(reduced_);
  kept_ = status.ok() ? &lu_ : nullptr;
  fresh_ = status.ok();
  worn_ = false;
  return status;
}

int InverseSolver::break_even() const {
  return static_cast<int>(std::min(kMostSaved, kFactorRate * kept_->flops() / kept_->nonzeros()));
}

bool InverseSolver::iterate(const Vector& rhs, double tolerance, Vector& x) {
  const Stopwatch watch(work.solve);
  Vector full = Vector::Zero(pattern_.dofs()), moved(full), force(full);
  const auto spread = [&](const Vector& reduced) { // D x on all dofs
    for (Index k = 0; k < reduction_.free(); ++k)
      full[reduction_.dof[static_cast<std::size_t>(k)]] = reduced[k];
    relabelling_->apply(full, moved);
  };
  const auto matrix = [&](const Vector& reduced, Vector& y) {
    spread(reduced);
    multiply(pattern_, *tangent_, moved, force);
    y = reduction_.restrict(force);
  };
  const auto precondition = [&](const Vector& r, Vector& z) { kept_->apply_inverse(r, z); };
  GmresSettings settings;
  settings.tolerance = tolerance;
  settings.max_iterations = std::max(kFewest, 2 * break_even());
  const GmresReport report = gmres(matrix, precondition, rhs, x, settings);
  work.iterations += report.iterations;
  worn_ = !fresh_ && report.iterations > break_even();
  return report.converged;
}

bool InverseSolver::solve(const Vector& rhs, double tolerance, Vector& x) {
  Vector y = Vector::Zero(rhs.size());
  bool good = iterate(rhs, tolerance, y);
  if (!good && !fresh_) good = factorise().ok() && iterate(rhs, tolerance, y);
  if (!good && !(kept_ == &lu_ && fresh_)) {
    if (!factorise_lu().ok()) return false;
    iterate(rhs, tolerance, y);
  }
  Vector full = Vector::Zero(pattern_.dofs()), moved(full);
  for (Index k = 0; k < reduction_.free(); ++k)
    full[reduction_.dof[static_cast<std::size_t>(k)]] = y[k];
  relabelling_->apply(full, moved);
  x = reduction_.restrict(moved);
  return x.allFinite();
}

} // namespace supple
