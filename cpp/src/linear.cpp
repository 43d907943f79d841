#include "supple/linear.hpp"

#include <omp.h>

#include <cmath>
#include <limits>
#include <string>

#include "linear_backend.hpp"
#include "supple/blas.hpp"
#include "supple/error.hpp"

namespace supple {

struct Factor::State {
  Kind kind;
  std::unique_ptr<Backend> backend;
  CscPattern pattern;
  Vector values;                           ///< of the last factorise
  Vector rhs, residual, correction, trial; ///< work space of a solve
  double norm = 0.0;                       ///< ‖A‖∞
  bool analysed = false, factorised = false;

  bool empty() const { return pattern.size == 0; }
};

namespace {

/// A second BLAS thread pays from here on, and costs below: 0.9 Gflop lose by it, 159 Gflop
/// gain 1.5×.
int blas_threads(double flops) {
  return flops < 2e10 ? 1 : omp_get_max_threads();
}

/// Call use(row, column, value) for each stored entry.
template <class Use>
void for_entries(const CscPattern& pattern, const Vector& values, Use use) {
  for (std::int64_t c = 0; c < pattern.size; ++c) {
    const auto column = static_cast<std::size_t>(c);
    for (std::int64_t k = pattern.start[column]; k < pattern.start[column + 1]; ++k)
      use(pattern.row[static_cast<std::size_t>(k)], c, values[k]);
  }
}

/// ‖A‖∞, with `sums` (size) as work space.
double infinity_norm(const CscPattern& pattern, const Vector& values, Vector& sums) {
  sums.setZero();
  for_entries(pattern, values, [&](auto row, auto column, double value) {
    sums[row] += std::abs(value);
    if (pattern.lower && row != column) sums[column] += std::abs(value);
  });
  return sums.size() == 0 ? 0.0 : sums.maxCoeff();
}

/// r = b − A x.
void subtract_product(const CscPattern& pattern, const Vector& values, const Vector& x,
                      const Vector& b, Vector& r) {
  r = b;
  for_entries(pattern, values, [&](auto row, auto column, double value) {
    r[row] -= value * x[column];
    if (pattern.lower && row != column) r[column] -= value * x[row];
  });
}

double ratio(double numerator, double denominator) {
  return numerator == 0.0 ? 0.0 : numerator / denominator;
}

SolveReport measure(const Vector& r, const Vector& x, const Vector& b, double norm, int steps) {
  const double scale = norm * x.lpNorm<Eigen::Infinity>() + b.lpNorm<Eigen::Infinity>();
  return {ratio(r.norm(), b.norm()), ratio(r.lpNorm<Eigen::Infinity>(), scale), steps};
}

bool good_enough(const SolveReport& report, const Refinement& refinement) {
  const double rounding = std::numeric_limits<double>::epsilon();
  return report.backward <= rounding || report.residual <= refinement.tolerance;
}

} // namespace

Factor::Factor(Kind kind) : state_(std::make_unique<State>()) {
  state_->kind = kind;
  state_->backend = kind == Kind::Unsymmetric ? make_umfpack() : make_cholmod(kind);
}
Factor::Factor(Factor&&) noexcept = default;
Factor& Factor::operator=(Factor&&) noexcept = default;
Factor::~Factor() = default;

void Factor::analyse(const CscPattern& pattern) {
  if (pattern.lower != (supple::storage(state_->kind) == Storage::Lower))
    throw ShapeError(std::string("pattern must store the ") +
                     (pattern.lower ? "full matrix" : "lower triangle") +
                     " for this kind of factor, got the other; reduce with storage(kind)");
  State& s = *state_;
  s.analysed = s.factorised = false;
  s.pattern = pattern;
  s.values.resize(pattern.nonzeros());
  for (Vector* work : {&s.rhs, &s.residual, &s.correction, &s.trial})
    work->resize(pattern.size);
  if (!s.empty()) s.backend->analyse(s.pattern);
  s.analysed = true;
}

FactorStatus Factor::factorise(const ConstVector& values) {
  State& s = *state_;
  if (!s.analysed) throw StateError("factorise needs an analysed pattern; call analyse first");
  require_size("values", values.size(), s.pattern.nonzeros(),
               "gather them with the analysed reduction");
  s.factorised = false;
  s.values = values;
  s.norm = infinity_norm(s.pattern, s.values, s.residual);
  if (!s.values.allFinite()) return {FactorStatus::Cause::NotFinite, -1};
  FactorStatus status;
  if (!s.empty()) {
    const BlasThreads threads(blas_threads(s.backend->flops()));
    status = s.backend->factorise(s.values.data());
  }
  s.factorised = status.ok();
  return status;
}

SolveReport Factor::solve(const ConstVector& rhs, MutableVector x, const Refinement& refinement) {
  State& s = *state_;
  if (!s.factorised)
    throw StateError("solve needs a factor; call factorise and look at its status first");
  require_size("rhs", rhs.size(), s.pattern.size, "give one entry for each unknown");
  require_size("x", x.size(), s.pattern.size, "give one entry for each unknown");
  if (s.empty()) return {};
  const BlasThreads threads(blas_threads(s.backend->flops()));
  s.rhs = rhs; // x may be the same vector
  s.backend->solve(s.rhs.data(), s.trial.data());
  x = s.trial;
  subtract_product(s.pattern, s.values, s.trial, s.rhs, s.residual);
  SolveReport report = measure(s.residual, s.trial, s.rhs, s.norm, 0);
  while (report.steps < refinement.max_steps && !good_enough(report, refinement)) {
    s.backend->solve(s.residual.data(), s.correction.data());
    s.trial += s.correction;
    subtract_product(s.pattern, s.values, s.trial, s.rhs, s.residual);
    const SolveReport next = measure(s.residual, s.trial, s.rhs, s.norm, report.steps + 1);
    if (!(next.backward < report.backward)) break;
    const bool stalled = next.backward > report.backward / 2;
    x = s.trial;
    report = next;
    if (stalled) break;
  }
  return report;
}

void Factor::apply_inverse(const ConstVector& rhs, MutableVector x) {
  State& s = *state_;
  if (!s.factorised)
    throw StateError("apply_inverse needs a factor; call factorise and look at its status first");
  require_size("rhs", rhs.size(), s.pattern.size, "give one entry for each unknown");
  require_size("x", x.size(), s.pattern.size, "give one entry for each unknown");
  if (s.empty()) return;
  const BlasThreads threads(blas_threads(s.backend->flops()));
  s.rhs = rhs; // x may be the same vector
  s.backend->solve(s.rhs.data(), x.data());
}

Inertia Factor::inertia() const {
  if (state_->kind != Kind::QuasiDefinite || !state_->factorised)
    throw StateError(
        "inertia needs a factor of kind QuasiDefinite; factorise one and look at its status");
  return state_->empty() ? Inertia{} : state_->backend->inertia();
}

Kind Factor::kind() const {
  return state_->kind;
}
std::int64_t Factor::size() const {
  return state_->pattern.size;
}
double Factor::flops() const {
  return state_->empty() ? 0.0 : state_->backend->flops();
}
double Factor::nonzeros() const {
  return state_->empty() ? 0.0 : state_->backend->nonzeros();
}
const char* Factor::ordering() const {
  return state_->empty() ? "none" : state_->backend->ordering();
}

} // namespace supple
