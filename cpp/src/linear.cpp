#include "supple/linear.hpp"

#include <omp.h>

#include <cmath>
#include <string>

#include "linear_backend.hpp"
#include "refinement.hpp"
#include "supple/blas.hpp"
#include "supple/error.hpp"

namespace supple {

struct Factor::State {
  Kind kind;
  Precision precision;
  std::unique_ptr<Backend> backend, reserve; ///< the reserve is made where it is needed
  Backend* active = nullptr;                 ///< the one that solves
  bool reserve_analysed = false;
  CscPattern pattern;
  Vector values; ///< of the last factorise
  Refiner refiner;
  bool analysed = false, factorised = false;

  bool empty() const { return pattern.size == 0; }
  bool rounded() const { return precision == Precision::Single && active == backend.get(); }
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

/// Steps of conjugate gradients that cost no more than one correction may: ten corrections, thirty
/// steps are about the time of the factorisation in double precision that they save.
constexpr int kConjugateSteps = 3;

} // namespace

Factor::Factor(Kind kind, Precision precision, Library library)
    : state_(std::make_unique<State>()) {
  const bool own = library == Library::Own;
  const bool cholesky = own && kind == Kind::Cholesky;
  state_->kind = kind;
  state_->precision = cholesky ? precision : Precision::Double;
  state_->backend = !own       ? make_pardiso(kind)
                    : cholesky ? make_cholesky(precision)
                               : make_supernodal(kind);
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
  s.refiner.analyse(s.pattern);
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
  s.refiner.take(s.values);
  if (!s.values.allFinite()) return {FactorStatus::Cause::NotFinite, -1};
  FactorStatus status;
  if (!s.empty()) {
    status = s.factorise_with(*s.backend);
    const bool doubtful = status.ok() ? s.backend->raised_pivots() > 0 && !s.probe()
                                      : s.precision == Precision::Single;
    if (doubtful) status = s.fall_back();
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
  if (!reserve)
    reserve = kind == Kind::Cholesky ? make_cholesky(Precision::Double) : make_umfpack();
  if (!reserve_analysed) reserve->analyse(pattern);
  reserve_analysed = true;
  return factorise_with(*reserve);
}

/// Does the factor, with pivots raised, still serve a right-hand side that spares no unknown?
bool Factor::State::probe() {
  Vector& rhs = refiner.rhs;
  for (Eigen::Index i = 0; i < rhs.size(); ++i)
    rhs[i] = 1.0 + 0.5 * std::sin(static_cast<double>(i));
  Vector x(rhs.size());
  return usable(refine(x, {}), {});
}

/// x = A⁻¹ rhs by the active factor, refined.
SolveReport Factor::State::refine(MutableVector x, const Refinement& refinement) {
  const BlasThreads threads(blas_threads(active->flops()));
  if (!rounded() || refinement.max_steps == 0) return refiner.correct(*active, x, refinement);
  Refinement more = refinement;
  more.max_steps *= kConjugateSteps;
  return refiner.conjugate(*active, x, more);
}

SolveReport Factor::solve(const ConstVector& rhs, MutableVector x, const Refinement& refinement) {
  State& s = *state_;
  if (!s.factorised)
    throw StateError("solve needs a factor; call factorise and look at its status first");
  require_size("rhs", rhs.size(), s.pattern.size, "give one entry for each unknown");
  require_size("x", x.size(), s.pattern.size, "give one entry for each unknown");
  if (s.empty()) return {};
  s.refiner.rhs = rhs; // x may be the same vector
  const SolveReport report = s.refine(x, refinement);
  const bool exact = s.kind == Kind::Cholesky ? !s.rounded() : s.active != s.backend.get();
  if (exact || refinement.max_steps == 0 || usable(report, refinement)) return report;
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
  s.refiner.rhs = rhs; // x may be the same vector
  s.active->solve(s.refiner.rhs.data(), x.data());
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

Precision Factor::precision() const {
  return state_->precision;
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
