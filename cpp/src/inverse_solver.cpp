#include "supple/inverse_solver.hpp"

#include <algorithm>

#include "relabelling.hpp"
#include "stopwatch.hpp"
#include "supple/krylov.hpp"

namespace supple {
namespace {

// Iterations that cost as much as a factorisation, from counts and not from the clock, so that the
// same problem is solved in the same way each time.
constexpr double kFactorRate = 0.05; // times flops over entries of L: measured at 10,000 dofs
constexpr double kLightRate = 0.03;  // the same in single precision
constexpr int kLeastSaved = 10, kMostSaved = 40; // small ones cost calls, large ones run faster
constexpr int kFewest = 30;                      // iterations that are always granted

/// Unknowns from which a factor in single precision is worth its noise: that takes the residual of
/// a uniform state out of the few directions that GMRES would have to look at.
constexpr Index kWorthSingle = 5'000;

Mask free_of(const BlockPattern& pattern, const Reduction& reduction) {
  Mask free = Mask::Constant(pattern.dofs(), false);
  for (const Index dof : reduction.dof)
    free[dof] = true;
  return free;
}

} // namespace

InverseSolver::InverseSolver(const BlockPattern& pattern, const Reduction& reduction,
                             const Vector& points)
    : pattern_(pattern), reduction_(reduction), free_(free_of(pattern, reduction)),
      relabelling_(std::make_unique<Relabelling>(pattern, free_, points)),
      mirror_(mirror(pattern, reduction)),
      light_(std::make_shared<Factor>(
          Kind::Cholesky, reduction.free() < kWorthSingle ? Precision::Double : Precision::Single)),
      light_serves_(pattern.scalars() == 0) {}

InverseSolver::~InverseSolver() = default;

void InverseSolver::forget() {
  kept_ = nullptr;
  light_serves_ = pattern_.scalars() == 0;
}

FactorStatus InverseSolver::prepare(const Vector& tangent, const ConstVector& u) {
  tangent_ = &tangent;
  relabelling_->update(u);
  fresh_ = false;
  if (kept_ != nullptr && !worn_) return {};
  const FactorStatus status = factorise();
  const bool finite = status.cause != FactorStatus::Cause::NotFinite;
  return status.ok() || !finite ? status : factorise_lu();
}

/// Of the symmetric part: Cholesky, of large ones in single precision, unless it is not positive
/// definite or that did not serve; LDLᵀ else.
FactorStatus InverseSolver::factorise() {
  const Stopwatch watch(work.factor);
  relabelling_->scale_columns(*tangent_, scaled_);
  reduced_.resize(reduction_.pattern.nonzeros());
  for (std::size_t k = 0; k < mirror_.size(); ++k) {
    reduced_[static_cast<Eigen::Index>(k)] =
        0.5 * (scaled_[reduction_.source[k]] + scaled_[mirror_[k]]);
  }
  if (light_serves_) {
    light_serves_ = keep_symmetric(*light_).ok();
    if (light_serves_) return {};
  }
  return keep_symmetric(exact_);
}

FactorStatus InverseSolver::keep_symmetric(Factor& factor) {
  if (factor.size() == 0) factor.analyse(reduction_.pattern);
  ++work.symmetric;
  return keep(factor);
}

FactorStatus InverseSolver::factorise_lu() {
  const Stopwatch watch(work.factor);
  if (!full_) {
    full_ = std::make_unique<Reduction>(reduce(pattern_, free_, Storage::Full));
    lu_.analyse(full_->pattern);
  }
  relabelling_->scale_columns(*tangent_, scaled_);
  reduced_.resize(full_->pattern.nonzeros());
  full_->gather(scaled_, reduced_);
  ++work.lu;
  return keep(lu_);
}

/// Factorise the reduced values, and precondition by them from now on.
FactorStatus InverseSolver::keep(Factor& factor) {
  const FactorStatus status = factor.factorise(reduced_);
  kept_ = status.ok() ? &factor : nullptr;
  fresh_ = status.ok();
  worn_ = false;
  return status;
}

int InverseSolver::break_even() const {
  const double rate = kept_ == light_.get() ? kLightRate : kFactorRate;
  const double count = rate * kept_->flops() / std::max(kept_->nonzeros(), 1.0);
  return std::clamp(static_cast<int>(count), kLeastSaved, kMostSaved);
}

/// D y on all dofs.
Vector InverseSolver::moved(const Vector& y) const {
  Vector full = Vector::Zero(pattern_.dofs()), result(full);
  reduction_.add_to(y, 1.0, full);
  relabelling_->apply(full, result);
  return result;
}

/// GMRES on A y = rhs from y.
bool InverseSolver::iterate(const Vector& rhs, double tolerance, Vector& y) {
  const Stopwatch watch(work.solve);
  Vector force(pattern_.dofs());
  const auto matrix = [&](const Vector& in, Vector& out) {
    multiply(pattern_, *tangent_, moved(in), force);
    out = reduction_.restrict(force);
  };
  const auto preconditioner = [&](const Vector& in, Vector& out) { kept_->apply_inverse(in, out); };
  const int saved = break_even();
  const GmresReport report =
      gmres(matrix, preconditioner, rhs, y, {tolerance, std::max(kFewest, 2 * saved)});
  work.iterations += report.iterations;
  worn_ = !fresh_ && report.iterations > saved;
  return report.converged;
}

std::shared_ptr<Factor> InverseSolver::definite_factor() const {
  return kept_ != nullptr && kept_ == light_.get() ? light_ : nullptr;
}

bool InverseSolver::solve(const Vector& rhs, double tolerance, Vector& x) {
  Vector y = Vector::Zero(rhs.size());
  bool good = kept_ != nullptr && iterate(rhs, tolerance, y);
  if (!good && !fresh_) good = factorise().ok() && iterate(rhs, tolerance, y);
  if (!good && fresh_ && kept_ == light_.get()) {
    light_serves_ = false;
    good = factorise().ok() && iterate(rhs, tolerance, y);
  }
  if (!good && !(fresh_ && kept_ == &lu_)) {
    if (!factorise_lu().ok()) return false;
    iterate(rhs, tolerance, y);
  }
  x = reduction_.restrict(moved(y));
  return x.allFinite();
}

} // namespace supple
