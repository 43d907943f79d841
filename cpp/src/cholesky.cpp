/// Our own multifrontal LLᵀ in double or single precision, its fronts in strips of rows.
///
/// Duff and Reid (1983), ACM TOMS 9(3), for the fronts; the branches of the tree go to threads of
/// their own, the fronts of its trunk are each shared by all. Every number is computed in the same
/// order whatever their count is.
#include <omp.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <limits>
#include <memory>
#include <vector>

#include "array.hpp"
#include "front_vectors.hpp"
#include "linear_backend.hpp"
#include "strips.hpp"
#include "supernodal_tree.hpp"
#include "team.hpp"

namespace supple {
namespace {

using strips::Run;

constexpr double kWorthThreads = 1e8; // flops of a factorisation above which a second thread pays
constexpr double kWorthReading = 1e7; // entries of a factor that two threads read faster than one
constexpr int kBranches = 4;          // shares for each thread
constexpr Index kPanel = 128;         // columns that are eliminated together
constexpr Index kColumns = 48;        // columns of a child's update that one thread adds
constexpr Index kRows = 192;          // rows whose part of a panel stays in the second cache

std::size_t at(std::int64_t i) {
  return static_cast<std::size_t>(i);
}

template <class T>
class Cholesky final : public Backend {
 public:
  void analyse(const CscPattern& pattern) override {
    pattern_ = &pattern;
    const int threads = omp_get_max_threads();
    analysis_ = shared_tree(pattern, threads > 1 ? kBranches * threads : 1, S);
    lay_out();
  }

  FactorStatus factorise(double* values) override {
    values_ = values;
    scale_matrix();
    factor_.sized(tree().panels + S * S);
    updates_.sized(tree().updates);
    failed_ = std::numeric_limits<Index>::max();
    together(flops() > kWorthThreads, [this](Worker& worker) { factorise_shares(worker); });
    if (failed_ == std::numeric_limits<Index>::max()) return {};
    return {FactorStatus::Cause::NotPositiveDefinite, tree().order[at(failed_)]};
  }

  void solve(const double* rhs, double* x) override {
    const double largest = scale_right_hand_side(rhs);
    together(nonzeros() > kWorthReading, [&](Worker& worker) {
      const auto branches = static_cast<int>(tree().branch.size());
      const std::vector<Index>& trunk = tree().trunk;
      worker.share(branches, [&](int b) {
        for (Index s = tree().branch[at(b)].begin; s < tree().branch[at(b)].end; ++s)
          vectors_.forward(s, factor_.get(), rhs, 1.0 / largest);
      });
      // By one thread: fronts to share out would cost more waiting than there is to read.
      worker.once([&] {
        for (const Index s : trunk)
          vectors_.forward(s, factor_.get(), rhs, 1.0 / largest);
        for (auto s = trunk.rbegin(); s != trunk.rend(); ++s)
          vectors_.backward(*s, factor_.get(), x, scale_ * largest, 0);
      });
      worker.share(branches, [&](int b) {
        for (Index s = tree().branch[at(b)].end; s-- > tree().branch[at(b)].begin;)
          vectors_.backward(s, factor_.get(), x, scale_ * largest, worker.number);
      });
    });
  }

  Inertia inertia() const override {
    return {0, 0, static_cast<std::int64_t>(tree().order.size()), 1.0};
  }
  double flops() const override { return analysis_->analysis->symbolic.flops; }
  double nonzeros() const override { return analysis_->analysis->symbolic.nonzeros; }
  const char* ordering() const override { return analysis_->analysis->ordering; }

 private:
  const SupernodeTree& tree() const { return analysis_->tree; }
  const Supernode& node(Index s) const { return tree().node[at(s)]; }
  Index wide(const Supernode& node) const { return layout_.wide(node); }
  Index tall(const Supernode& node) const { return layout_.tall(node); }
  T* panel(const Supernode& node) const { return factor_.get() + node.panel; }
  T* update(const Supernode& node) const { return updates_.get() + node.update; }

  void lay_out() {
    layout_ = {&tree(), S};
    tallest_ = 0;
    for (Index s = 0; s < tree().size(); ++s)
      tallest_ = std::max(tallest_, tall(node(s)) * S);
    offset_.resize(at(std::max(omp_get_max_threads(), 1)));
    for (auto& offset : offset_)
      offset.resize(at(4) * at(tallest_));
    vectors_.lay(layout_, offset_.size());
  }

  /// Powers of two keep the numbers inside the range of a float.
  void scale_matrix() {
    scale_ = 1.0;
    if (sizeof(T) == sizeof(double)) return;
    double largest = 0.0;
    for (std::int64_t c = 0; c < pattern_->size; ++c)
      largest = std::max(largest, std::abs(values_[pattern_->start[at(c)]])); // the diagonal
    if (largest > 0.0) scale_ = std::exp2(-std::ilogb(largest));
  }
  double scale_right_hand_side(const double* rhs) const {
    if (sizeof(T) == sizeof(double)) return 1.0;
    double largest = 0.0;
    for (std::int64_t i = 0; i < pattern_->size; ++i)
      largest = std::max(largest, std::abs(rhs[i]));
    return largest > 0.0 && std::isfinite(largest) ? std::exp2(std::ilogb(largest)) : 1.0;
  }

  /// Run `use` by all threads, or by this one where they are not worth their waking.
  template <class Use>
  void together(bool worth, const Use& use) {
    const bool many = worth && offset_.size() > 1 && !omp_in_parallel();
    Worker alone;
    if (!many) return use(alone);
    team_.reset();
#pragma omp parallel num_threads(static_cast<int>(offset_.size()))
    {
      Worker worker{omp_get_thread_num(), &team_};
      use(worker);
    }
  }

  void factorise_shares(Worker& worker) {
    worker.share(static_cast<int>(tree().branch.size()), [&](int b) {
      const Range& range = tree().branch[at(b)];
      Worker alone{worker.number, nullptr};
      for (Index s = range.begin; s < range.end && node(s).first < failed_; ++s)
        front(s, alone);
    });
    for (const Index s : tree().trunk) {
      if (node(s).first >= failed_) return; // a thread that is late may see it sooner
      front(s, worker);
    }
  }

  /// Assemble and eliminate one supernode.
  void front(Index s, Worker& worker) {
    const Supernode& f = node(s);
    worker.once([&] { start_panel(s); });
    layout_.for_children(s, [&](Index child) { add(node(child), f, true, worker); });
    for (Index j = 0; j < f.columns; j += kPanel)
      if (!eliminate(f, {j, std::min(j + kPanel, f.columns)}, worker)) return;
    if (f.below == 0) return;
    const T* const below = panel(f) + static_cast<std::int64_t>(wide(f)) * S * f.columns;
    // The longest rows first: what is left for the end is short.
    share_strips(worker, {0, tall(f)}, true,
                 [&](Run strips) { kernels_.outer(update(f), below, f.columns, strips); });
    layout_.for_children(s, [&](Index child) { add(node(child), f, false, worker); });
  }

  void start_panel(Index s) {
    T* const to = panel(node(s));
    std::fill(to, panel(tree().node[at(s) + 1]), T(0));
    for (std::size_t e = node(s).slots; e < tree().node[at(s) + 1].slots; ++e) {
      const Slot& slot = tree().slot[e];
      to[slot.target] += static_cast<T>(values_[slot.source] * scale_);
    }
  }

  /// The columns `run` of a front; false if they cannot be eliminated.
  bool eliminate(const Supernode& f, Run run, Worker& worker) {
    const Run diagonal{run.begin / S, strips::whole(run.end, S)};
    T* const to = panel(f);
    worker.once([&] {
      kernels_.update(to, f.columns, diagonal, run);
      const Index column = kernels_.factor(to, f.columns, run);
      if (column >= 0) fail(f.first + column);
    });
    if (f.first + run.end > failed_ && f.first <= failed_) return false;
    share_strips(worker, {diagonal.end, wide(f) + tall(f)}, false, [&](Run strips) {
      kernels_.update(to, f.columns, strips, run);
      kernels_.divide(to, f.columns, strips, run);
    });
    return true;
  }

  void fail(Index column) {
    Index lowest = failed_;
    while (column < lowest && !failed_.compare_exchange_weak(lowest, column)) {
    }
  }

  /// Add what a child leaves to the panel of its parent's front, or to its update.
  void add(const Supernode& child, const Supernode& f, bool to_panel, Worker& worker) {
    const Index* const place = layout_.places(child);
    const auto m = child.below;
    const auto inside = static_cast<Index>(std::lower_bound(place, place + m, f.columns) - place);
    if (to_panel ? inside == 0 : inside == m) return;
    std::uint32_t* const row = offset_[at(worker.number)].data();
    std::uint32_t* const column = row + 2 * tallest_;
    const Index begin = to_panel ? 0 : inside, end = to_panel ? inside : m;
    for (Index i = begin; i < end; ++i)
      column[i] = static_cast<std::uint32_t>((place[i] - (to_panel ? 0 : f.columns)) * S);
    for (Index i = begin / S * S; i < m; ++i)
      row[i] = to_panel ? panel_row(f, place[i]) : update_row(std::max(place[i] - f.columns, 0));
    T* const to = to_panel ? panel(f) : update(f);
    // By columns, for a strip of the target may take rows from two of the child's.
    const Index step = worker.team == nullptr ? end - begin : kColumns;
    worker.share((end - begin + step - 1) / step, [&](int i) {
      const Run columns{begin + i * step, std::min(begin + (i + 1) * step, end)};
      for (Index t = columns.begin / S; t * S < m; ++t)
        kernels_.scatter(to, row + t * S, column, update(child) + strips::triangle(t, S), t,
                         columns, std::min<Index>(S, m - t * S));
    });
  }
  std::uint32_t panel_row(const Supernode& f, Index place) const {
    const Index row = place < f.columns ? place : place - f.columns + wide(f) * S;
    return static_cast<std::uint32_t>(static_cast<std::int64_t>(row / S) * S * f.columns + row % S);
  }
  std::uint32_t update_row(Index row) const {
    return static_cast<std::uint32_t>(strips::triangle(row / S, S) + row % S);
  }

  template <class Use>
  void share_strips(Worker& worker, Run strips, bool backwards, const Use& use) const {
    const Index step = worker.team == nullptr ? kRows / S : kRows / 2 / S;
    const int count = std::max((strips.end - strips.begin + step - 1) / step, 0);
    worker.share(count, [&](int i) {
      const Index begin = strips.begin + (backwards ? count - 1 - i : i) * step;
      use(Run{begin, std::min(begin + step, strips.end)});
    });
  }

  const strips::Kernels<T>& kernels_ = strips::kernels<T>();
  const Index S = kernels_.lanes;
  const CscPattern* pattern_ = nullptr;
  const double* values_ = nullptr;
  double scale_ = 1.0; // of the matrix
  std::shared_ptr<const TreeReport> analysis_;
  FrontLayout layout_;
  ArrayOf<T> factor_, updates_;
  FrontVectors<T> vectors_;
  Index tallest_ = 0;                              // rows below, in whole strips
  std::vector<std::vector<std::uint32_t>> offset_; // of each thread
  Team team_;
  std::atomic<Index> failed_{0}; // the first column without a positive pivot
};

} // namespace

std::unique_ptr<Backend> make_cholesky(Precision precision) {
  if (precision == Precision::Single) return std::make_unique<Cholesky<float>>();
  return std::make_unique<Cholesky<double>>();
}

} // namespace supple
