#include "supple/linear.hpp"

#include <omp.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

#include "linear_backend.hpp"
#include "supple/blas.hpp"
#include "supple/error.hpp"

namespace supple {

struct Factor::State {
  Kind kind;
  std::unique_ptr<Backend> backend, reserve; ///< the reserve is made where it is needed
  Backend* active = nullptr;                 ///< the one that solves
  bool reserve_analysed = false;
  CscPattern pattern;
  Vector values;                           ///< of the last factorise
  Vector rhs, residual, correction, trial; ///< work space of a solve
  double norm = 0.0;                       ///< ‖A‖∞
  bool analysed = false, factorised = false;

  bool empty() const { return pattern.size == 0; }
  FactorStatus factorise_with(Backend& chosen);
  FactorStatus fall_back();
  SolveReport refine(MutableVector x, const Refinement& refinement);
  bool probe();
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

/// What refinement of a usable factor reaches; the rest is the fault of pivots not chosen.
bool usable(const SolveReport& report, const Refinement& refinement) {
  const double rounding = 16 * std::numeric_limits<double>::epsilon();
  return report.backward <= rounding || report.residual <= std::max(refinement.tolerance, 1e-12);
}

} // namespace

Factor::Factor(Kind kind) : state_(std::make_unique<State>()) {
  state_->kind = kind;
  state_->backend = kind == Kind::Cholesky ? make_cholmod(kind) : make_supernodal(kind);
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
  s.analysed = s.factorised = s.reserve_analysed = false;
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
    status = s.factorise_with(*s.backend);
    if (status.ok() && s.backend->raised_pivots() > 0 && !s.probe()) status = s.fall_back();
  }
  s.factorised = status.ok();
  return status;
}

FactorStatus Factor::State::factorise_with(Backend& chosen) {
  const BlasThreads threads(blas_threads(chosen.flops()));
  active = &chosen;
  return chosen.factorise(values.data());
}

FactorStatus Factor::State::fall_back() {
  if (!reserve) reserve = make_umfpack();
  if (!reserve_analysed) reserve->analyse(pattern);
  reserve_analysed = true;
  return factorise_with(*reserve);
}

/// Does the factor, with pivots raised, still serve a right-hand side that spares no unknown?
bool Factor::State::probe() {
  for (Eigen::Index i = 0; i < rhs.size(); ++i)
    rhs[i] = 1.0 + 0.5 * std::sin(static_cast<double>(i));
  Vector x(rhs.size());
  return usable(refine(x, {}), {});
}

/// x = A⁻¹ rhs by the active factor, refined.
SolveReport Factor::State::refine(MutableVector x, const Refinement& refinement) {
  const BlasThreads threads(blas_threads(active->flops()));
  active->solve(rhs.data(), trial.data());
  x = trial;
  subtract_product(pattern, values, trial, rhs, residual);
  SolveReport report = measure(residual, trial, rhs, norm, 0);
  while (report.steps < refinement.max_steps && !good_enough(report, refinement)) {
    active->solve(residual.data(), correction.data());
    trial += correction;
    subtract_product(pattern, values, trial, rhs, residual);
    const SolveReport next = measure(residual, trial, rhs, norm, report.steps + 1);
    if (!(next.backward < report.backward)) break;
    const bool stalled = next.backward > report.backward / 2;
    x = trial;
    report = next;
    if (stalled) break;
  }
  return report;
}

SolveReport Factor::solve(const ConstVector& rhs, MutableVector x, const Refinement& refinement) {
  State& s = *state_;
  if (!s.factorised)
    throw StateError("solve needs a factor; call factorise and look at its status first");
  require_size("rhs", rhs.size(), s.pattern.size, "give one entry for each unknown");
  require_size("x", x.size(), s.pattern.size, "give one entry for each unknown");
  if (s.empty()) return {};
  s.rhs = rhs; // x may be the same vector
  const SolveReport report = s.refine(x, refinement);
  const bool chosen_pivots = s.kind == Kind::Cholesky || s.active != s.backend.get();
  if (chosen_pivots || refinement.max_steps == 0 || usable(report, refinement)) return report;
  if (!s.fall_back().ok()) {
    s.active = s.backend.get();
    return report;
  }
  Vector other(x.size());
  const SolveReport second = s.refine(other, refinement);
  if (second.backward >= report.backward) return report; // false where one is no number
  x = other;
  return second;
}

void Factor::apply_inverse(const ConstVector& rhs, MutableVector x) {
  State& s = *state_;
  if (!s.factorised)
    throw StateError("apply_inverse needs a factor; call factorise and look at its status first");
  require_size("rhs", rhs.size(), s.pattern.size, "give one entry for each unknown");
  require_size("x", x.size(), s.pattern.size, "give one entry for each unknown");
  if (s.empty()) return;
  const BlasThreads threads(blas_threads(s.active->flops()));
  s.rhs = rhs; // x may be the same vector
  s.active->solve(s.rhs.data(), x.data());
}

Inertia Factor::inertia() const {
  if (state_->kind != Kind::QuasiDefinite || !state_->factorised)
    throw StateError(
        "inertia needs a factor of kind QuasiDefinite; factorise one and look at its status");
  return state_->empty() ? Inertia{} : state_->backend->inertia();
}

bool Factor::fell_back() const {
  return state_->reserve && state_->active == state_->reserve.get();
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
