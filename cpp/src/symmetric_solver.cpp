#include "supple/symmetric_solver.hpp"

#include <algorithm>

#include "node_rotations.hpp"
#include "stopwatch.hpp"
#include "symmetric_product.hpp"

namespace supple {
namespace {

constexpr int kFewest = 30; // iterations that are always granted

} // namespace

SymmetricSolver::SymmetricSolver(const CscPattern& pattern, const NodeRotations& rotations,
                                 MakePreconditioner make)
    : pattern_(pattern), rotations_(rotations),
      product_(std::make_unique<SymmetricProduct>(pattern)), make_(std::move(make)) {}

SymmetricSolver::~SymmetricSolver() = default;

void SymmetricSolver::forget() {
  usable_ = false;
}

FactorStatus SymmetricSolver::prepare(const Vector& values, const ConstVector& u) {
  values_ = &values;
  turn_ = rotations_.at(u);
  fresh_ = false;
  if (usable_) set_turn();
  definite_ = Definite::Unknown;
  return usable_ && !worn_ ? FactorStatus{} : renew();
}

FactorStatus SymmetricSolver::renew() {
  const Stopwatch watch(work.factor);
  if (!kept_) kept_ = make_();
  const FactorStatus status = kept_->update(pattern_, *values_);
  ++work.factorisations;
  usable_ = fresh_ = status.ok();
  worn_ = false;
  turned_ = turn_;
  spread_ = 1.0;
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
    rotations_.turn_back(since_, in, turned);
    kept_->apply(turned, out);
    rotations_.turn(since_, out);
  };
  const int saved = kept_->break_even();
  const bool unsure = probe && definite_ == Definite::Unknown;
  const CgReport report = conjugate_gradients(matrix, preconditioner, rhs, x,
                                              {tolerance, std::max(kFewest, 2 * saved), unsure});
  work.iterations += report.iterations;
  if (report.spread != 0.0) spread_ = report.spread;
  worn_ = !fresh_ && report.iterations > saved;
  if (report.definite != Definite::Unknown && definite_ == Definite::Unknown)
    definite_ = report.definite;
  return report;
}

/// Q of each node, from where the factor was made to where the matrix is.
void SymmetricSolver::set_turn() {
  since_.resize(turn_.size());
  for (std::size_t k = 0; k < turn_.size(); ++k)
    since_[k] = turn_[k] * turned_[k].transpose();
}

bool SymmetricSolver::cheap_to_probe(double size) const {
  return probe_iterations(spread_, size) <= kept_->break_even();
}

FactorStatus SymmetricSolver::solve(const Vector& rhs, double tolerance, bool probe, Vector& x) {
  x.setZero(rhs.size());
  if (!usable_) return {FactorStatus::Cause::Singular, -1};
  if (probe && definite_ == Definite::Unknown && !cheap_to_probe(static_cast<double>(rhs.size()))) {
    const FactorStatus status = renew(); // which tells, too, and serves the next solves
    if (!status.ok()) return status;
  }
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
