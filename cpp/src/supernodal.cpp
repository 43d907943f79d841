/// Our own multifrontal LDLᵀ and LU: dense fronts, pivots that do not leave their supernode.
#include <omp.h>

#include <algorithm>
#include <cmath>
#include <Eigen/Dense>
#include <memory>
#include <utility>
#include <vector>

#include "array.hpp"
#include "linear_backend.hpp"
#include "supernodal_dense.hpp"
#include "supernodal_tree.hpp"
#include "supple/blas.hpp"

namespace supple {
namespace {

using dense::Block;
using Panel = Eigen::Map<const Eigen::MatrixXd, 0, Eigen::OuterStride<>>;
using Part = Eigen::Map<Vector>;

constexpr double kWorthThreads = 2e8; // flops of a factorisation above which a second thread pays
constexpr int kBranches = 2; // shares for each thread: more of them leave more to the trunk

std::size_t at(std::int64_t i) {
  return static_cast<std::size_t>(i);
}

class Supernodal final : public Backend {
 public:
  explicit Supernodal(Kind kind) : lu_(kind == Kind::Unsymmetric) {}

  void analyse(const CscPattern& pattern) override {
    pattern_ = &pattern;
    const int threads = omp_get_max_threads();
    analysis_ = shared_tree(pattern, threads > 1 ? kBranches * threads : 1);
    const Symbolic& symbolic = analysis_->analysis->symbolic;
    const double entries = symbolic.nonzeros;
    flops_ = symbolic.flops * (lu_ ? 2.0 : 1.0);
    nonzeros_ = lu_ ? 2.0 * entries - static_cast<double>(pattern.size) : entries;
    ordering_ = analysis_->analysis->ordering;
    scale_.resize(pattern.size);
    x_.resize(pattern.size);
    pivot_.resize(lu_ ? at(pattern.size) : 0);
  }

  FactorStatus factorise(double* values) override {
    values_ = values;
    measure_columns();
    factor_.sized(tree().panels);
    updates_.sized(tree().updates);
    work_.resize(at(std::max(omp_get_max_threads(), 1)));
    for (Array& work : work_)
      work.sized(tree().tallest_product);
    raised_ = 0;
    factorise_branches();
    for (const Index s : tree().trunk)
      raised_ += front(s, work_[0].get());
    return {};
  }

  void solve(const double* rhs, double* x) override {
    for (Eigen::Index j = 0; j < x_.size(); ++j)
      x_[j] = rhs[tree().order[at(j)]];
    for (Index s = 0; s < tree().size(); ++s)
      forward(tree().node[at(s)]);
    for (Index s = tree().size() - 1; s >= 0; --s)
      backward(tree().node[at(s)]);
    for (Eigen::Index j = 0; j < x_.size(); ++j)
      x[tree().order[at(j)]] = x_[j];
  }

  Inertia inertia() const override {
    Inertia result;
    Vector diagonal = Vector::Zero(x_.size()); // of |L||D||Lᵀ|
    for (Index s = 0; s < tree().size(); ++s) {
      const Supernode& node = tree().node[at(s)];
      const Panel l = panel(node);
      for (Index j = 0; j < node.columns; ++j) {
        const double pivot = l(j, j), size = std::abs(pivot);
        ++(pivot < 0.0 ? result.negative : pivot > 0.0 ? result.positive : result.zero);
        diagonal[node.first + j] += size;
        for (Index i = j + 1; i < node.columns; ++i)
          diagonal[node.first + i] += l(i, j) * l(i, j) * size;
        for (Index i = 0; i < node.below; ++i)
          diagonal[row(node, i)] += l(node.columns + i, j) * l(node.columns + i, j) * size;
      }
    }
    result.growth = diagonal.maxCoeff() / scale_.maxCoeff();
    return result;
  }

  std::int64_t raised_pivots() const override { return raised_; }
  double flops() const override { return flops_; }
  double nonzeros() const override { return nonzeros_; }
  const char* ordering() const override { return ordering_; }

 private:
  /// Largest magnitude in each column of A, in the order of the factorisation.
  void measure_columns() {
    Vector largest = Vector::Zero(scale_.size());
    for (std::int64_t c = 0; c < pattern_->size; ++c)
      for (std::int64_t e = pattern_->start[at(c)]; e < pattern_->start[at(c) + 1]; ++e) {
        const double size = std::abs(values_[e]);
        largest[c] = std::max(largest[c], size);
        if (pattern_->lower)
          largest[pattern_->row[at(e)]] = std::max(largest[pattern_->row[at(e)]], size);
      }
    for (Eigen::Index j = 0; j < scale_.size(); ++j)
      scale_[j] = largest[tree().order[at(j)]];
  }

  void factorise_branches() {
    const auto count = static_cast<Index>(tree().branch.size());
    const int threads = count > 1 && flops_ > kWorthThreads ? static_cast<int>(work_.size()) : 1;
    const auto one_thread = threads > 1 ? std::make_unique<BlasThreads>(1) : nullptr;
    std::int64_t raised = 0;
#pragma omp parallel for num_threads(threads) schedule(dynamic) reduction(+ : raised)
    for (Index b = 0; b < count; ++b) {
      const Range& range = tree().branch[at(b)];
      for (Index s = range.begin; s < range.end; ++s)
        raised += front(s, work_[at(omp_get_thread_num())].get());
    }
    raised_ += raised;
  }

  Block lower(const Supernode& node) const { return {factor_.get() + node.panel, node.height()}; }
  Block upper(const Supernode& node) const {
    return {factor_.get() + node.panel + static_cast<std::int64_t>(node.columns) * node.height(),
            node.below};
  }
  Block update(const Supernode& node) const { return {updates_.get() + node.update, node.below}; }
  Panel panel(const Supernode& node) const {
    return {factor_.get() + node.panel, node.height(), node.columns,
            Eigen::OuterStride<>(node.height())};
  }
  const SupernodeTree& tree() const { return analysis_->tree; }
  Index row(const Supernode& node, Index i) const { return tree().row[at(node.rows + i)]; }

  /// Assemble and eliminate one supernode; how many pivots had to be raised.
  std::int64_t front(Index s, double* work) {
    const Supernode& node = tree().node[at(s)];
    const Supernode& next = tree().node[at(s) + 1];
    std::fill(factor_.get() + node.panel, factor_.get() + next.panel, 0.0);
    for (std::size_t e = node.slots; e < next.slots; ++e)
      factor_.get()[node.panel + tree().slot[e].target] += values_[tree().slot[e].source];
    for_children(s, [&](const Supernode& child) { add_to_panel(child, node); });
    dense::PivotGuard guard{scale_.data() + node.first};
    const Block below = lower(node).from(node.columns, 0);
    if (lu_) {
      eliminate_lu(node, guard);
      dense::subtract_product(update(node), node.below, node.below, below, upper(node),
                              node.columns, 0.0);
    } else {
      eliminate_ldlt(node, work, guard);
      dense::subtract_lower(update(node), node.below, below, {work, node.below}, node.columns, 0.0);
    }
    for_children(s, [&](const Supernode& child) { add_to_update(child, node); });
    return guard.raised;
  }

  void eliminate_lu(const Supernode& node, dense::PivotGuard& guard) {
    const Index k = node.columns, m = node.below;
    const Block l = lower(node), u = upper(node);
    Index* const pivot = pivot_.data() + node.first;
    dense::factor_lu(l, k, pivot, guard);
    for (Index j = 0; j < k; ++j)
      if (pivot[j] != j) std::swap_ranges(&u(0, j), &u(0, j) + m, &u(0, pivot[j]));
    dense::divide_by_lower(u, m, l, k);
    dense::divide_by_upper(l.from(k, 0), m, l, k);
  }

  /// Leaves L₂₁ D in `work` (m, k).
  void eliminate_ldlt(const Supernode& node, double* work, dense::PivotGuard& guard) {
    const Index k = node.columns, m = node.below;
    const Block l = lower(node), below = l.from(k, 0), product{work, m};
    dense::factor_ldlt(l, k, work, guard);
    dense::divide_by_lower(below, m, l, k);
    for (Index j = 0; j < k; ++j) {
      const double reciprocal = 1.0 / l(j, j);
      for (Index i = 0; i < m; ++i) {
        product(i, j) = below(i, j);
        below(i, j) *= reciprocal;
      }
    }
  }

  template <class Use>
  void for_children(Index s, Use use) const {
    for (Index c = tree().child_start[at(s)]; c < tree().child_start[at(s) + 1]; ++c)
      use(tree().node[at(tree().child[at(c)])]);
  }

  const Index* places(const Supernode& child) const { return tree().place.data() + child.rows; }
  /// Rows of the child that are columns of its parent's panel.
  Index taken(const Supernode& child, const Supernode& node) const {
    const Index* const place = places(child);
    return static_cast<Index>(std::lower_bound(place, place + child.below, node.columns) - place);
  }

  void add_to_panel(const Supernode& child, const Supernode& node) {
    const Block from = update(child), l = lower(node), u = upper(node);
    const Index* const place = places(child);
    const Index inside = taken(child, node), m = child.below;
    for (Index j = 0; j < inside; ++j) {
      const double* const source = &from(0, j);
      double* const target = &l(0, place[j]);
      for (Index i = lu_ ? 0 : j; i < m; ++i)
        target[place[i]] += source[i];
    }
    if (!lu_) return;
    for (Index j = inside; j < m; ++j)
      for (Index i = 0; i < inside; ++i)
        u(place[j] - node.columns, place[i]) += from(i, j);
  }

  void add_to_update(const Supernode& child, const Supernode& node) {
    const Block from = update(child), to = update(node);
    const Index* const place = places(child);
    const Index inside = taken(child, node), m = child.below;
    for (Index j = inside; j < m; ++j) {
      const double* const source = &from(0, j);
      double* const target = &to(0, place[j] - node.columns) - node.columns;
      for (Index i = lu_ ? inside : j; i < m; ++i)
        target[place[i]] += source[i];
    }
  }

  void forward(const Supernode& node) {
    const Panel l = panel(node);
    const Index k = node.columns, m = node.below;
    Part x(x_.data() + node.first, k);
    if (lu_)
      for (Index j = 0; j < k; ++j)
        std::swap(x[j], x[pivot_[at(node.first + j)]]);
    l.topRows(k).triangularView<Eigen::UnitLower>().solveInPlace(x);
    if (m == 0) return;
    Part product(work_[0].get(), m);
    product.noalias() = l.bottomRows(m) * x;
    for (Index i = 0; i < m; ++i)
      x_[row(node, i)] -= product[i];
  }

  void backward(const Supernode& node) {
    const Panel l = panel(node);
    const Index k = node.columns, m = node.below;
    Part x(x_.data() + node.first, k), below(work_[0].get(), m);
    for (Index i = 0; i < m; ++i)
      below[i] = x_[row(node, i)];
    if (lu_) {
      const Block u = upper(node);
      if (m > 0) x.noalias() -= Panel(u.at, m, k, Eigen::OuterStride<>(m)).transpose() * below;
      l.topRows(k).triangularView<Eigen::Upper>().solveInPlace(x);
    } else {
      x.array() /= l.topRows(k).diagonal().array();
      if (m > 0) x.noalias() -= l.bottomRows(m).transpose() * below;
      l.topRows(k).triangularView<Eigen::UnitLower>().transpose().solveInPlace(x);
    }
  }

  bool lu_;
  const CscPattern* pattern_ = nullptr;
  const double* values_ = nullptr;
  std::shared_ptr<const TreeReport> analysis_;
  Array factor_, updates_;
  std::vector<Array> work_; // of each thread
  std::vector<Index> pivot_;
  Vector scale_, x_;
  std::int64_t raised_ = 0;
  double flops_ = 0.0, nonzeros_ = 0.0;
  const char* ordering_ = "none";
};

} // namespace

std::unique_ptr<Backend> make_supernodal(Kind kind) {
  return std::make_unique<Supernodal>(kind);
}

} // namespace supple
