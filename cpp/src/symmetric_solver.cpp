#include "supple/symmetric_solver.hpp"

#include <algorithm>
#include <cmath>

#include "node_rotations.hpp"
#include "stopwatch.hpp"
#include "symmetric_product.hpp"

namespace supple {
namespace {

constexpr int kFewest = 30;    // iterations that are always granted
constexpr int kMost = 300;     // to a preconditioner that is not exact
constexpr double kFaded = 0.5; // of the rate at first, where a preconditioner is begun from nothing

double digits(const CgReport& report) {
  return report.residual > 0.0 ? -std::log10(report.residual) : 16.0;
}

} // namespace

SymmetricSolver::SymmetricSolver(const CscPattern& pattern, const NodeRotations& rotations,
                                 MakePreconditioner make)
    : pattern_(pattern), rotations_(rotations),
      product_(std::make_unique<SymmetricProduct>(pattern)), make_(std::move(make)) {}

SymmetricSolver::~SymmetricSolver() = default;

void SymmetricSolver::forget() {
  usable_ = false;
}

void SymmetricSolver::take(const Vector& values, const ConstVector& u) {
  values_ = &values;
  turn_ = rotations_.at(u);
  fresh_ = false;
  if (usable_) set_turn();
  definite_ = Definite::Unknown;
}

FactorStatus SymmetricSolver::prepare(const Vector& values, const ConstVector& u) {
  take(values, u);
  if (!usable_ || worn_) return renew();
  kept_->take(pattern_, values);
  return {};
}

FactorStatus SymmetricSolver::prove(const Vector& values, const ConstVector& u) {
  take(values, u);
  const FactorStatus status = renew();
  if (!status.ok()) return status;
  find_definite();
  if (definite_ == Definite::No) return {FactorStatus::Cause::NotPositiveDefinite, -1};
  return status;
}

void SymmetricSolver::find_definite() {
  if (!usable_ || definite_ != Definite::Unknown) return;
  const bool cheap = cheap_to_probe(static_cast<double>(pattern_.size));
  if (!cheap && !fresh_) renew();
  if (!usable_ || definite_ != Definite::Unknown) return;
  Vector x = Vector::Zero(pattern_.size);
  iterate(Vector::Ones(x.size()), 1.0, true, x);
}

FactorStatus SymmetricSolver::renew() {
  const Stopwatch watch(work.factor);
  if (!kept_) kept_ = make_();
  anew_ = rate_ < kFaded * best_rate_ || !usable_;
  if (anew_) kept_->start_over();
  const FactorStatus status = kept_->update(pattern_, *values_);
  ++work.factorisations;
  usable_ = fresh_ = status.ok();
  worn_ = false;
  turned_ = turn_;
  spread_ = 1.0;
  if (status.ok() && kept_->proves()) definite_ = Definite::Yes;
  if (status.cause == FactorStatus::Cause::NotPositiveDefinite) definite_ = Definite::No;
  return status;
}

CgReport SymmetricSolver::iterate(const Vector& rhs, double tolerance, bool probe, Vector& x) {
  const Stopwatch watch(work.solve);
  Vector turned(rhs.size());
  const auto matrix = [&](const Vector& in, Vector& out) {
    if (!kept_->multiply(in, out)) product_->apply(*values_, in, out);
  };
  const auto preconditioner = [&](const Vector& in, Vector& out) {
    if (fresh_) return kept_->apply(in, out);
    rotations_.turn_back(since_, in, turned);
    kept_->apply(turned, out);
    rotations_.turn(since_, out);
  };
  const int saved = kept_->break_even();
  const bool unsure = probe && definite_ == Definite::Unknown;
  const int limit = kept_->exact() ? std::max(kFewest, 2 * saved) : kMost;
  const CgReport report =
      conjugate_gradients(matrix, preconditioner, rhs, x, {tolerance, limit, unsure});
  work.iterations += report.iterations;
  if (report.spread != 0.0) spread_ = report.spread;
  if (fresh_) rate(report);
  worn_ = excess(report) > saved && (!fresh_ || (kept_->exact() && kept_->sharpen()));
  if (report.definite != Definite::Unknown && definite_ == Definite::Unknown)
    definite_ = report.definite;
  return report;
}

/// Iterations more than a fresh preconditioner would have needed.
int SymmetricSolver::excess(const CgReport& report) const {
  if (kept_->exact() || !(rate_ > 0.0)) return report.iterations;
  return report.iterations - static_cast<int>(std::ceil(digits(report) / rate_));
}

void SymmetricSolver::rate(const CgReport& report) {
  if (report.iterations < 2 || !report.converged) return;
  rate_ = digits(report) / report.iterations;
  if (anew_) best_rate_ = rate_;
}

/// Q of each node, from where the factor was made to where the matrix is.
void SymmetricSolver::set_turn() {
  since_.resize(turn_.size());
  for (std::size_t k = 0; k < turn_.size(); ++k)
    since_[k] = turn_[k] * turned_[k].transpose();
}

bool SymmetricSolver::cheap_to_probe(double size) const {
  if (!kept_->exact()) return true; // a new one would not tell
  return probe_iterations(spread_, size) <= kept_->break_even();
}

FactorStatus SymmetricSolver::solve(const Vector& rhs, double tolerance, bool probe, Vector& x) {
  x.setZero(rhs.size());
  if (!usable_) return {FactorStatus::Cause::Singular, -1};
  const bool unsure = probe && definite_ == Definite::Unknown && !fresh_;
  if (unsure && !cheap_to_probe(static_cast<double>(rhs.size()))) {
    const FactorStatus status = renew(); // which tells, too, and serves the next solves
    if (!status.ok()) return status;
  }
  while (!iterate(rhs, tolerance, probe, x).converged && (!fresh_ || worn_)) {
    const FactorStatus status = renew();
    if (!status.ok()) return status;
    x.setZero();
  }
  return x.allFinite() ? FactorStatus{} : FactorStatus{FactorStatus::Cause::Singular, -1};
}

} // namespace supple
