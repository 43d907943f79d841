#include "supple/system.hpp"

#include <limits>

#include "node_rotations.hpp"
#include "stopwatch.hpp"
#include "supple/error.hpp"
#include "supple/pardiso.hpp"

namespace supple {

namespace {

double factor_of(const Term& term, double load_factor) {
  return term.is_load ? load_factor : 1.0;
}

} // namespace

System::System(std::shared_ptr<Vector> points, std::vector<Index> home)
    : points_(std::move(points)), home_(std::move(home)) {}
System::~System() = default;

void System::add(std::shared_ptr<Term> term) {
  terms_.push_back(std::move(term));
  graph_.reset();
  pattern_.reset();
  reduction_.reset();
  forget_factors();
}

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

void System::move_points(const ConstVector& points) {
  require_size("points", points.size(), static_cast<Index>(points_->size()), "three a node");
  *points_ = points;
  inverse_.reset(); // it knows the loaded shape
  if (symmetric_) symmetric_->forget();
}

void System::set_free(Mask free) {
  require_size("free", free.size(), dofs(), "one entry for each dof");
  if (free_.size() == free.size() && (free_ == free).all()) return;
  free_ = std::move(free);
  reduction_.reset();
  forget_factors();
}

bool System::has_energy() const {
  for (const auto& term : terms_) {
    if (!term->has_energy()) return false;
  }
  return true;
}

Kind System::kind() const {
  for (const auto& term : terms_) {
    if (!term->symmetric()) return Kind::Unsymmetric;
  }
  return scalars() > 0 ? Kind::QuasiDefinite : Kind::Cholesky;
}

double System::energy(const ConstVector& u, double load_factor) const {
  const Stopwatch watch(timings.residual);
  double total = 0.0;
  for (const auto& term : terms_)
    if (!term->is_silent) total += factor_of(*term, load_factor) * term->energy(u);
  return total;
}

Vector System::residual(const ConstVector& u, double load_factor) const {
  Vector r(dofs());
  residual(u, load_factor, r);
  return r;
}

void System::residual(const ConstVector& u, double load_factor, MutableVector r) const {
  const Stopwatch watch(timings.residual);
  r.setZero();
  for (const auto& term : terms_)
    if (!term->is_silent) term->residual(u, factor_of(*term, load_factor), r);
}

Vector System::external(const ConstVector& u) const {
  const Stopwatch watch(timings.residual);
  Vector r = Vector::Zero(dofs());
  for (const auto& term : terms_) {
    if (term->is_load && !term->is_silent) term->residual(u, -1.0, r);
  }
  return r;
}

VolumeRatio System::volume_ratio(const ConstVector& u) const {
  const Stopwatch watch(timings.residual);
  VolumeRatio smallest;
  for (std::size_t t = 0; t < terms_.size(); ++t) {
    const VolumeRatio ratio = terms_[t]->volume_ratio(u);
    if (ratio.value < smallest.value) smallest = {ratio.value, ratio.cell, static_cast<Index>(t)};
  }
  return smallest;
}

std::vector<Connectivity> System::connectivities() const {
  std::vector<Connectivity> cells;
  cells.reserve(terms_.size());
  for (const auto& term : terms_)
    cells.push_back(term->cells());
  return cells;
}

const NodeGraph& System::graph() {
  if (!graph_) {
    const auto nodes = static_cast<Index>(points_->size() / 3);
    const Stopwatch watch(timings.analysis);
    graph_ = std::make_unique<NodeGraph>(node_graph(nodes, connectivities(), home_));
  }
  return *graph_;
}

const BlockPattern& System::pattern() {
  if (!pattern_) {
    const NodeGraph& nodes = graph();
    const Stopwatch watch(timings.analysis);
    pattern_ = std::make_unique<BlockPattern>(block_pattern(nodes, connectivities()));
  }
  return *pattern_;
}

const Reduction& System::reduction() {
  if (reduction_) return *reduction_;
  if (free_.size() == 0) free_ = Mask::Constant(dofs(), true);
  if (kind() == Kind::Unsymmetric) {
    const Storage part = iterates() ? Storage::Lower : Storage::Full;
    const BlockPattern& whole = pattern();
    const Stopwatch watch(timings.analysis);
    reduction_ = std::make_unique<Reduction>(reduce(whole, free_, part));
  } else {
    const NodeGraph& nodes = graph();
    const Stopwatch watch(timings.analysis);
    reduction_ = std::make_unique<Reduction>(reduce_lower(nodes, free_));
    lower_ = lower_scatter(nodes, *reduction_, connectivities());
  }
  return *reduction_;
}

void System::assemble_tangent(const ConstVector& u, double load_factor) {
  const Reduction& r = reduction();
  at_ = u;
  load_factor_ = load_factor;
  full_is_made_ = false;
  if (kind() == Kind::Unsymmetric) return assemble_full();
  const Stopwatch watch(timings.assembly);
  lower_values_.setZero(r.pattern.nonzeros());
  for (std::size_t t = 0; t < terms_.size(); ++t) {
    const double scale = factor_of(*terms_[t], load_factor);
    if (scale != 0.0 && !terms_[t]->is_silent)
      terms_[t]->tangent(u, scale, lower_[t], lower_values_);
  }
}

void System::assemble_full() {
  const BlockPattern& p = pattern();
  const Stopwatch watch(timings.assembly);
  values_.setZero(p.nonzeros());
  for (std::size_t t = 0; t < terms_.size(); ++t) {
    const double scale = factor_of(*terms_[t], load_factor_);
    if (scale != 0.0 && !terms_[t]->is_silent)
      terms_[t]->tangent(at_, scale, p.scatter[t], values_);
  }
  full_is_made_ = true;
}

const Vector& System::full_tangent() {
  if (!full_is_made_) assemble_full();
  return values_;
}

/// The reduced values of the tangent last assembled, plus `shift` times their diagonal's mean.
const Vector& System::reduced_tangent(double shift) {
  const Reduction& r = reduction();
  if (kind() == Kind::Unsymmetric) {
    reduced_.resize(r.pattern.nonzeros());
    r.gather(values_, reduced_);
  } else if (shift > 0.0) {
    reduced_ = lower_values_;
  } else {
    return lower_values_;
  }
  if (shift <= 0.0) return reduced_;
  // The lower triangle's columns begin with their diagonal entry.
  double mean = 0.0;
  for (std::int64_t j = 0; j < r.pattern.size; ++j)
    mean += std::abs(reduced_[r.pattern.start[static_cast<std::size_t>(j)]]);
  mean /= static_cast<double>(r.pattern.size);
  for (std::int64_t j = 0; j < r.pattern.size; ++j)
    reduced_[r.pattern.start[static_cast<std::size_t>(j)]] += shift * mean;
  return reduced_;
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

Vector System::apply(const ConstVector& x) {
  Vector y = Vector::Zero(dofs());
  multiply(pattern(), full_tangent(), x, y);
  return y;
}

Inertia System::inertia() {
  if (has_grid()) return {factorise().ok() ? 0 : 1, 0, 0, 0.0}; // as far as it can tell
  if (kind() == Kind::QuasiDefinite && factor_) return factor_->inertia();
  if (!factorise_indefinite().ok()) return {0, 1, 0, 0.0};
  return indefinite_->inertia();
}

} // namespace supple
