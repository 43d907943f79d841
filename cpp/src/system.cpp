#include "supple/system.hpp"

#include "node_rotations.hpp"
#include "stopwatch.hpp"
#include "supple/error.hpp"

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

Vector System::residual_beside(const ConstVector& u, double load_factor, Vector& external) const {
  external = this->external(u);
  const Stopwatch watch(timings.residual);
  Vector r = -load_factor * external;
  for (const auto& term : terms_)
    if (!term->is_load && !term->is_silent) term->residual(u, 1.0, r);
  return r;
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
  std::vector<bool> done(terms_.size(), false);
  for (std::size_t t = 0; t < terms_.size(); ++t) {
    const double scale = factor_of(*terms_[t], load_factor_);
    if (done[t] || scale == 0.0 || terms_[t]->is_silent) continue;
    const std::size_t other = scale == 1.0 ? add_with_another(t, done) : t;
    done[other] = true;
    if (other == t) terms_[t]->tangent(at_, scale, p.scatter[t], values_);
  }
  full_is_made_ = true;
}

/// The term behind `t` whose tangent was added together with its own, or `t` if there is none such.
std::size_t System::add_with_another(std::size_t t, const std::vector<bool>& done) {
  for (std::size_t k = t + 1; k < terms_.size(); ++k) {
    if (done[k] || factor_of(*terms_[k], load_factor_) != 1.0 || terms_[k]->is_silent) continue;
    if (terms_[t]->tangent_with(*terms_[k], at_, pattern_->scatter[t], values_)) return k;
  }
  return t;
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

Vector System::apply(const ConstVector& x) {
  Vector y = Vector::Zero(dofs());
  multiply(pattern(), full_tangent(), x, y);
  return y;
}

} // namespace supple
