#include <algorithm>
#include <numeric>
#include <string>
#include <utility>

#include "node_cells.hpp"
#include "supple/error.hpp"

namespace supple {
namespace {

/// The batches around each node; a batch may come twice where its cells at the node do not follow
/// one another.
struct NodeBatches {
  std::vector<Index> start; // (nodes + 1)
  std::vector<Index> batch; // ascending for each node
};

/// Call use(node, batch) once for each node and batch around it.
template <class Use>
void each_node(const Connectivity& cells, Index nodes, Index size, Use use) {
  std::vector<Index> last(static_cast<std::size_t>(nodes), -1);
  for (Eigen::Index c = 0; c < cells.rows(); ++c) {
    const auto batch = static_cast<Index>(c / size);
    for (Eigen::Index a = 0; a < cells.cols(); ++a) {
      const auto node = static_cast<std::size_t>(cells(c, a));
      if (std::exchange(last[node], batch) != batch) use(node, batch);
    }
  }
}

NodeBatches node_batches(const Connectivity& cells, Index nodes, Index size) {
  NodeBatches around;
  around.start.assign(static_cast<std::size_t>(nodes) + 1, 0);
  each_node(cells, nodes, size, [&](std::size_t node, Index) { ++around.start[node + 1]; });
  std::partial_sum(around.start.begin(), around.start.end(), around.start.begin());
  around.batch.resize(static_cast<std::size_t>(around.start.back()));
  std::vector<Index> next(around.start.begin(), around.start.end() - 1);
  each_node(cells, nodes, size, [&](std::size_t node, Index batch) {
    around.batch[static_cast<std::size_t>(next[node]++)] = batch;
  });
  return around;
}

/// Lowest colour that no batch around the nodes of a batch has.
class FirstFit {
 public:
  FirstFit(const NodeBatches& around, std::size_t batches)
      : around_(around), colour_(batches, -1) {}

  /// Mark the colours around a node of `batch` as taken.
  void see(std::size_t node, Index batch) {
    for (Index k = around_.start[node]; k < around_.start[node + 1]; ++k) {
      const Index other = around_.batch[static_cast<std::size_t>(k)];
      if (other >= batch) break; // has no colour yet
      taken_[static_cast<std::size_t>(colour_[static_cast<std::size_t>(other)])] = batch;
    }
  }
  void colour(Index batch) {
    const auto found =
        std::find_if(taken_.begin(), taken_.end(), [&](Index t) { return t != batch; });
    colour_[static_cast<std::size_t>(batch)] = static_cast<Index>(found - taken_.begin());
    if (found == taken_.end()) taken_.push_back(-1);
  }
  const std::vector<Index>& colours() const { return colour_; }
  Index count() const { return static_cast<Index>(taken_.size()); }

 private:
  const NodeBatches& around_;
  std::vector<Index> colour_; // (batches)
  std::vector<Index> taken_;  // (colours) the batch that marked each last
};

Colouring sort_by_colour(const std::vector<Index>& colour, Index colours) {
  Colouring result;
  result.offset.assign(static_cast<std::size_t>(colours) + 1, 0);
  for (Index c : colour)
    ++result.offset[static_cast<std::size_t>(c) + 1];
  for (std::size_t c = 1; c < result.offset.size(); ++c)
    result.offset[c] += result.offset[c - 1];
  std::vector<Index> next(result.offset.begin(), result.offset.end() - 1);
  result.order.resize(colour.size());
  for (std::size_t k = 0; k < colour.size(); ++k) {
    Index& place = next[static_cast<std::size_t>(colour[k])];
    result.order[static_cast<std::size_t>(place++)] = static_cast<Index>(k);
  }
  return result;
}

} // namespace

Colouring colour_cells(const Connectivity& cells, Index nodes, Index batch) {
  if (batch < 1)
    throw ShapeError("batch must be 1 or more, got " + std::to_string(batch) +
                     "; 1 colours single cells");
  check_nodes(cells, nodes);
  const auto batches = static_cast<std::size_t>((cells.rows() + batch - 1) / batch);
  const NodeBatches around = node_batches(cells, nodes, batch);
  FirstFit fit(around, batches);
  for (std::size_t k = 0; k < batches; ++k) {
    const auto number = static_cast<Index>(k);
    const auto first = static_cast<Eigen::Index>(k) * batch;
    const auto last = std::min<Eigen::Index>(cells.rows(), first + batch);
    for (Eigen::Index c = first; c < last; ++c)
      for (Eigen::Index a = 0; a < cells.cols(); ++a)
        fit.see(static_cast<std::size_t>(cells(c, a)), number);
    fit.colour(number);
  }
  return sort_by_colour(fit.colours(), fit.count());
}

} // namespace supple
