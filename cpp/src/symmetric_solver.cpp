#include "supple/symmetric_solver.hpp"

#include <algorithm>

#include "node_rotations.hpp"
#include "stopwatch.hpp"
#include "symmetric_product.hpp"

namespace supple {
namespace {

constexpr int kFewest = 30; // iterations that are always granted

} // namespace

SymmetricSolver::SymmetricSolver(const BlockPattern& pattern, const Reduction& reduction,
                                 const Vector& points, MakePreconditioner make)
    : reduction_(reduction),
      rotations_(std::make_unique<NodeRotations>(pattern, reduction, points)),
      product_(std::make_unique<SymmetricProduct>(reduction.pattern)), make_(std::move(make)) {}

SymmetricSolver::~SymmetricSolver() = default;

void SymmetricSolver::forget() {
  usable_ = false;
}

FactorStatus SymmetricSolver::prepare(const Vector& values, const ConstVector& u) {
  values_ = &values;
  turn_ = rotations_->at(u);
  fresh_ = false;
  definite_ = Definite::Unknown;
  return usable_ && !worn_ ? FactorStatus{} : renew();
}

FactorStatus SymmetricSolver::renew() {
  const Stopwatch watch(work.factor);
  if (!kept_) kept_ = make_();
  const FactorStatus status = kept_->update(reduction_.pattern, *values_);
  ++work.factorisations;
  usable_ = fresh_ = status.ok();
  worn_ = false;
  turned_ = turn_;
  if (status.ok()) definite_ = Definite::Yes;
  if (status.cause == FactorStatus::Cause::NotPositiveDefinite) definite_ = Definite::No;
  return status;
}

CgReport SymmetricSolver::iterate(const Vector& rhs, double tolerance, bool probe, Vector& x) {
  const Stopwatch watch(work.solve);
  Vector turned(rhs.size());
  const auto matrix = [&](const Vector& in, Vector& out) { product_->apply(*values_, in, out); };
  const auto preconditioner = [&](const Vector& in, Vector& out) {
    if (fresh_) return kept_->apply(in, out);
    rotations_->turn(turn_, turned_, in, turned);
    kept_->apply(turned, out);
    rotations_->turn(turned_, turn_, out, out);
  };
  const int saved = kept_->break_even();
  const bool unsure = probe && definite_ == Definite::Unknown;
  const CgReport report = conjugate_gradients(matrix, preconditioner, rhs, x,
                                              {tolerance, std::max(kFewest, 2 * saved), unsure});
  work.iterations += report.iterations;
  worn_ = !fresh_ && report.iterations > saved;
  if (report.definite != Definite::Unknown && definite_ == Definite::Unknown)
    definite_ = report.definite;
  return report;
}

FactorStatus SymmetricSolver::solve(const Vector& rhs, double tolerance, bool probe, Vector& x) {
  x.setZero(rhs.size());
  if (!usable_) return {FactorStatus::Cause::Singular, -1};
  bool good = iterate(rhs, tolerance, probe, x).converged;
  if (!good && !fresh_) {
    const FactorStatus status = renew();
    if (!status.ok()) return status;
    x.setZero();
    iterate(rhs, tolerance, probe, x);
  }
  return x.allFinite() ? FactorStatus{} : FactorStatus{FactorStatus::Cause::Singular, -1};
}

} // namespace supple
