/// How a System solves with its tangent: which factor, which preconditioner, what is kept.
#include <limits>

#include "node_rotations.hpp"
#include "stopwatch.hpp"
#include "supple/error.hpp"
#include "supple/pardiso.hpp"
#include "supple/system.hpp"
#include "symmetric_product.hpp"

namespace supple {
namespace {

constexpr int kMostProbes = 30; // as long as about half of LDLᵀ at 10,000 unknowns

} // namespace

void System::forget_factors() {
  factor_.reset();
  indefinite_.reset();
  inverse_.reset();
  symmetric_.reset();
  rotations_.reset();
}

void System::use_method(Method method) {
  if (method == Method::Pardiso && !pardiso_loaded())
    throw StateError("Method::Pardiso needs MKL; call load_pardiso first");
  if ((method == Method::Pardiso) != (method_ == Method::Pardiso)) {
    factor_.reset();
    indefinite_.reset();
    current_ = nullptr;
  }
  method_ = method;
}

/// A factor of the reduced tangent, ready for its values.
std::unique_ptr<Factor> System::analysed(Kind kind) {
  const Reduction& r = reduction();
  const Stopwatch watch(timings.analysis);
  const Library library = method_ == Method::Pardiso ? Library::Pardiso : Library::Own;
  auto factor = std::make_unique<Factor>(kind, Precision::Double, library);
  factor->analyse(r.pattern);
  return factor;
}

void System::use_grid(Corners corners, Aggregate aggregate) {
  corners_ = std::move(corners);
  aggregate_ = std::move(aggregate);
}

void System::forget_kept() {
  if (symmetric_) symmetric_->forget();
}

void System::use_gmres(bool gmres) {
  if (inverse_) inverse_->forget();
  if (gmres == gmres_) return;
  gmres_ = gmres;
  reduction_.reset();
  forget_factors();
}

std::pair<double, double> System::predicted_factor() {
  if (!factor_) factor_ = analysed(kind());
  return {factor_->flops(), factor_->nonzeros()};
}

FactorStatus System::factorise(double shift) {
  if (iterates()) return prepare_inverse();
  if (has_grid()) {
    const FactorStatus status = symmetric().prove(reduced_tangent(shift), at_);
    count_kept();
    return status;
  }
  if (!factor_) factor_ = analysed(kind());
  const Stopwatch watch(timings.factor);
  const Vector& values = reduced_tangent(shift);
  current_ = factor_.get();
  ++timings.factorisations;
  const FactorStatus status = factor_->factorise(values);
  definite_ = status.ok() && kind() == Kind::Cholesky && shift == 0.0    ? Definite::Yes
              : status.cause == FactorStatus::Cause::NotPositiveDefinite ? Definite::No
                                                                         : Definite::Unknown;
  return status;
}

/// What solves on a preconditioner, which becomes what `solve` uses.
SymmetricSolver& System::symmetric() {
  current_ = nullptr;
  if (symmetric_) return *symmetric_;
  const Stopwatch watch(timings.analysis);
  MakePreconditioner make = make_factor_preconditioner;
  if (has_grid())
    make = [this] {
      const Places places = [this]() -> Vector { return *points_ + at_.head(points_->size()); };
      return std::make_unique<Multigrid>(reduction().dof, places, corners_, aggregate_);
    };
  symmetric_ = std::make_unique<SymmetricSolver>(reduction().pattern, rotations(), make);
  return *symmetric_;
}

FactorStatus System::prepare() {
  if (!keeps()) return factorise();
  const FactorStatus status = symmetric().prepare(reduced_tangent(), at_);
  count_kept();
  return status;
}

const NodeRotations& System::rotations() {
  if (!rotations_) rotations_ = std::make_unique<NodeRotations>(graph(), reduction(), *points_);
  return *rotations_;
}

Vector System::along_arcs(const ConstVector& u, const ConstVector& d) {
  return rotations().along_arcs(u, d);
}

Definite System::definite() const {
  return current_ == nullptr && symmetric_ ? symmetric_->definite() : definite_;
}

Definite System::find_definite() {
  if (definite() == Definite::Unknown && current_ == nullptr && symmetric_) {
    symmetric_->find_definite();
    count_kept();
  }
  if (definite() == Definite::Unknown) factorise();
  return definite();
}

bool System::definite_beside(const System& inverse) {
  if (kind() != Kind::Cholesky || !inverse.inverse_ || !inverse.reduction_) return false;
  const std::shared_ptr<Factor> factor = inverse.inverse_->definite_factor();
  if (!factor || !(inverse.reduction_->pattern == reduction().pattern)) return false;
  const Stopwatch watch(timings.solve);
  const SymmetricProduct product(reduction().pattern);
  const Vector& values = reduced_tangent();
  const auto matrix = [&](const Vector& in, Vector& out) { product.apply(values, in, out); };
  const auto preconditioner = [&](const Vector& in, Vector& out) {
    factor->apply_inverse(in, out);
  };
  Vector x = Vector::Zero(reduction().free());
  const CgReport report = conjugate_gradients(matrix, preconditioner, Vector::Ones(x.size()), x,
                                              {1.0, kMostProbes, true, nullptr});
  timings.krylov_iterations += report.iterations;
  return report.definite == Definite::Yes;
}

/// By conjugate gradients; by LDLᵀ where those led to a new factor that the tangent does not have.
void System::solve_kept(const Vector& rhs, double tolerance, bool probe, Vector& x) {
  const FactorStatus status = symmetric_->solve(rhs, tolerance, probe, x);
  count_kept();
  if (status.ok()) return;
  definite_ = symmetric_->definite();
  if (status.cause == FactorStatus::Cause::NotPositiveDefinite && factorise_indefinite().ok()) {
    current_->solve(rhs, x);
  } else {
    x.setConstant(std::numeric_limits<double>::quiet_NaN());
  }
}

void System::count_kept() {
  SymmetricWork& work = symmetric_->work;
  timings.factor += work.factor;
  timings.solve += work.solve;
  timings.factorisations += work.factorisations;
  timings.krylov_iterations += work.iterations;
  work = {};
}

FactorStatus System::prepare_inverse() {
  if (!inverse_) inverse_ = std::make_unique<InverseSolver>(pattern(), reduction(), *points_);
  const FactorStatus status = inverse_->prepare(values_, at_);
  count_work();
  return status;
}

void System::count_work() {
  SolverWork& work = inverse_->work;
  timings.factor += work.factor;
  timings.solve += work.solve;
  timings.factorisations += work.symmetric + work.lu;
  timings.krylov_iterations += work.iterations;
  work = {};
}

FactorStatus System::factorise_indefinite() {
  if (has_grid()) return {FactorStatus::Cause::NotPositiveDefinite, -1}; // it has no such factor
  if (!indefinite_) indefinite_ = analysed(Kind::QuasiDefinite);
  const Stopwatch watch(timings.factor);
  current_ = indefinite_.get();
  ++timings.factorisations;
  return indefinite_->factorise(reduced_tangent());
}

Vector System::solve(const ConstVector& rhs, double tolerance, bool probe) {
  const Reduction& r = reduction();
  Vector x(r.free());
  if (iterates()) {
    if (!inverse_->solve(r.restrict(rhs), tolerance, x))
      x.setConstant(std::numeric_limits<double>::quiet_NaN());
    count_work();
  } else if (current_ == nullptr) {
    solve_kept(r.restrict(rhs), tolerance, probe, x);
  } else {
    const Stopwatch watch(timings.solve);
    Refinement refinement;
    refinement.tolerance = 1e-12;
    current_->solve(r.restrict(rhs), x, refinement);
  }
  Vector full = Vector::Zero(dofs());
  r.add_to(x, 1.0, full);
  return full;
}

Inertia System::inertia() {
  if (has_grid()) return {factorise().ok() ? 0 : 1, 0, 0, 0.0}; // as far as it can tell
  if (kind() == Kind::QuasiDefinite && factor_) return factor_->inertia();
  if (!factorise_indefinite().ok()) return {0, 1, 0, 0.0};
  return indefinite_->inertia();
}

} // namespace supple
