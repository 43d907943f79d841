#include "supple/symmetric_solver.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "node_rotations.hpp"
#include "stopwatch.hpp"
#include "symmetric_product.hpp"

namespace supple {
namespace {

constexpr std::size_t kMostKept = 2;
constexpr int kFewest = 30;    // iterations that are always granted
constexpr int kMost = 300;     // to a preconditioner that is not exact
constexpr double kFaded = 0.5; // of the rate at first, where a preconditioner is begun from nothing
constexpr double kApart = 0.1; // of |u|, from where it was made: worth another one
constexpr double kSmall = 64e6; // bytes, of which two are kept

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
  for (Kept& kept : kept_)
    kept.usable = false;
}

void SymmetricSolver::take(const Vector& values, const ConstVector& u) {
  values_ = &values;
  at_ = u;
  turn_ = rotations_.at(u);
  fresh_ = false;
  definite_ = Definite::Unknown;
  choose();
}

/// Of those that can be used the one that was made nearest to u.
void SymmetricSolver::choose() {
  double nearest = std::numeric_limits<double>::infinity();
  for (std::size_t k = 0; k < kept_.size(); ++k) {
    const double distance = kept_[k].usable ? (kept_[k].at - at_).squaredNorm() : nearest;
    if (distance < nearest) {
      nearest = distance;
      now_ = k;
    }
  }
  if (now().usable) set_turn();
}

/// Beside the one at hand, where it was made elsewhere and is small; else in its place.
void SymmetricSolver::make_room() {
  if (!now().usable || !now().made->exact() || now().made->bytes() > kSmall) return;
  if ((now().at - at_).norm() <= kApart * at_.norm()) return;
  for (std::size_t k = 0; k < kept_.size(); ++k) {
    if (!kept_[k].usable) {
      now_ = k;
      return;
    }
  }
  if (kept_.size() == kMostKept) return;
  now_ = kept_.size();
  kept_.emplace_back();
}

FactorStatus SymmetricSolver::prepare(const Vector& values, const ConstVector& u) {
  take(values, u);
  if (!now().usable || now().worn) return renew();
  now().made->take(pattern_, values);
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
  if (!now().usable || definite_ != Definite::Unknown) return;
  const bool cheap = cheap_to_probe(static_cast<double>(pattern_.size));
  if (!cheap && !fresh_) renew();
  if (!now().usable || definite_ != Definite::Unknown) return;
  Vector x = Vector::Zero(pattern_.size);
  iterate(Vector::Ones(x.size()), 1.0, true, x);
}

FactorStatus SymmetricSolver::renew() {
  const Stopwatch watch(work.factor);
  make_room();
  Kept& k = now();
  if (!k.made) k.made = make_();
  k.anew = k.rate < kFaded * k.best_rate || !k.usable;
  if (k.anew) k.made->start_over();
  const FactorStatus status = k.made->update(pattern_, *values_);
  ++work.factorisations;
  k.usable = fresh_ = status.ok();
  k.worn = false;
  k.turned = turn_;
  k.at = at_;
  k.spread = 1.0;
  k.echo.resize(0);
  if (status.ok() && k.made->proves()) definite_ = Definite::Yes;
  if (status.cause == FactorStatus::Cause::NotPositiveDefinite) definite_ = Definite::No;
  return status;
}

CgReport SymmetricSolver::iterate(const Vector& rhs, double tolerance, bool probe, Vector& x) {
  const Stopwatch watch(work.solve);
  Vector turned(rhs.size());
  Kept& k = now();
  const auto matrix = [&](const Vector& in, Vector& out) {
    if (!k.made->multiply(in, out)) product_->apply(*values_, in, out);
  };
  const auto preconditioner = [&](const Vector& in, Vector& out) {
    if (fresh_) return k.made->apply(in, out);
    rotations_.turn_back(since_, in, turned);
    k.made->apply(turned, out);
    rotations_.turn(since_, out);
  };
  const int saved = k.made->break_even();
  const bool unsure = probe && definite_ == Definite::Unknown;
  const Vector echo = unsure ? this->echo() : Vector();
  const int limit = k.made->exact() ? std::max(kFewest, 2 * saved) : kMost;
  const CgReport report =
      conjugate_gradients(matrix, preconditioner, rhs, x, {tolerance, limit, unsure, &echo});
  work.iterations += report.iterations;
  if (report.spread != 0.0) k.spread = report.spread;
  if (fresh_) rate(report);
  k.worn = excess(report) > saved && (!fresh_ || (k.made->exact() && k.made->sharpen()));
  if (report.definite != Definite::Unknown && definite_ == Definite::Unknown)
    definite_ = report.definite;
  return report;
}

/// What M⁻¹ makes of a probe's noise that turns with the nodes, which is as good as any other.
Vector SymmetricSolver::echo() {
  Kept& k = now();
  if (k.echo.size() == 0 || !k.made->exact()) {
    k.echo.resize(pattern_.size);
    k.made->apply(probe_noise(pattern_.size), k.echo);
    ++work.iterations;
  }
  Vector result = k.echo;
  if (!fresh_) rotations_.turn(since_, result);
  return result;
}

/// Iterations more than a fresh preconditioner would have needed.
int SymmetricSolver::excess(const CgReport& report) const {
  if (now().made->exact() || !(now().rate > 0.0)) return report.iterations;
  return report.iterations - static_cast<int>(std::ceil(digits(report) / now().rate));
}

void SymmetricSolver::rate(const CgReport& report) {
  if (report.iterations < 2 || !report.converged) return;
  now().rate = digits(report) / report.iterations;
  if (now().anew) now().best_rate = now().rate;
}

/// Q of each node, from where the factor was made to where the matrix is.
void SymmetricSolver::set_turn() {
  since_.resize(turn_.size());
  for (std::size_t k = 0; k < turn_.size(); ++k)
    since_[k] = turn_[k] * now().turned[k].transpose();
}

bool SymmetricSolver::cheap_to_probe(double size) const {
  if (!now().made->exact()) return true; // a new one would not tell
  return probe_iterations(now().spread, size) <= now().made->break_even();
}

FactorStatus SymmetricSolver::solve(const Vector& rhs, double tolerance, bool probe, Vector& x) {
  x.setZero(rhs.size());
  if (!now().usable) return {FactorStatus::Cause::Singular, -1};
  const bool unsure = probe && definite_ == Definite::Unknown && !fresh_;
  if (unsure && !cheap_to_probe(static_cast<double>(rhs.size()))) {
    const FactorStatus status = renew(); // which tells, too, and serves the next solves
    if (!status.ok()) return status;
  }
  while (!iterate(rhs, tolerance, probe, x).converged && (!fresh_ || now().worn)) {
    const FactorStatus status = renew();
    if (!status.ok()) return status;
    x.setZero();
  }
  return x.allFinite() ? FactorStatus{} : FactorStatus{FactorStatus::Cause::Singular, -1};
}

} // namespace supple
