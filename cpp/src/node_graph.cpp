#include <algorithm>
#include <limits>
#include <numeric>
#include <string>
#include <utility>

#include "node_cells.hpp"
#include "supple/error.hpp"

namespace supple {
namespace {

/// The nodes of a cell, by its number in all connectivities.
class CellNodes {
 public:
  explicit CellNodes(const std::vector<Connectivity>& connectivities) : all_(connectivities) {
    Index first = 0;
    for (const Connectivity& cells : all_)
      first_.push_back(first += static_cast<Index>(cells.rows()));
  }
  template <class Use>
  void each(Index cell, Use use) const {
    std::size_t k = 0;
    while (cell >= first_[k])
      ++k;
    const Connectivity& cells = all_[k];
    const Index* node = cells.data() + (cell - first_[k] + cells.rows()) * cells.cols();
    for (Eigen::Index a = 0; a < cells.cols(); ++a)
      use(node[a]);
  }

 private:
  const std::vector<Connectivity>& all_;
  std::vector<Index> first_; // cell after the last of each
};

void require_storable(std::size_t neighbours, Index node, Index nodes) {
  if (neighbours <= static_cast<std::size_t>(std::numeric_limits<Index>::max()) / 9) return;
  throw ShapeError("the matrix must have fewer than 2147483648 entries, got more at node " +
                   std::to_string(node) + " of " + std::to_string(nodes) +
                   "; use a coarser mesh or a lower order");
}

/// The least node of a piece stands for it; every path that is walked is halved.
/// Source: Tarjan, van Leeuwen (1984), J. ACM 31(2).
Index root(std::vector<Index>& parent, Index node) {
  auto at = static_cast<std::size_t>(node);
  while (parent[at] != static_cast<Index>(at)) {
    parent[at] = parent[static_cast<std::size_t>(parent[at])];
    at = static_cast<std::size_t>(parent[at]);
  }
  return static_cast<Index>(at);
}

} // namespace

std::vector<Index> connected_pieces(Index nodes, const Connectivity& cells) {
  check_nodes(cells, nodes);
  std::vector<Index> parent(static_cast<std::size_t>(nodes));
  std::iota(parent.begin(), parent.end(), 0);
  for (Eigen::Index c = 0; c < cells.rows(); ++c)
    for (Eigen::Index a = 1; a < cells.cols(); ++a) {
      const Index one = root(parent, cells(c, 0)), other = root(parent, cells(c, a));
      parent[static_cast<std::size_t>(std::max(one, other))] = std::min(one, other);
    }
  Index pieces = 0; // a root comes before the nodes of its piece
  for (Index node = 0; node < nodes; ++node) {
    const auto n = static_cast<std::size_t>(node);
    parent[n] = parent[n] == node ? pieces++ : parent[static_cast<std::size_t>(parent[n])];
  }
  return parent;
}

Index NodeGraph::find(Index a, Index b) const {
  const auto node = static_cast<std::size_t>(a);
  const auto last = neighbour.begin() + node_start[node + 1];
  const auto found = std::lower_bound(neighbour.begin() + node_start[node], last, b);
  return found == last || *found != b ? -1 : static_cast<Index>(found - neighbour.begin());
}

NodeGraph node_graph(Index nodes, const std::vector<Connectivity>& connectivities,
                     std::vector<Index> home) {
  if (nodes < 0)
    throw ShapeError("nodes must be 0 or more, got " + std::to_string(nodes) +
                     "; give the number of points of the mesh");
  NodeGraph graph;
  graph.nodes = nodes;
  graph.home = std::move(home);
  const Index all = nodes + graph.scalars();
  const NodeCells around = node_cells(all, connectivities);
  const CellNodes cells(connectivities);
  std::vector<Index> seen(static_cast<std::size_t>(all), -1);
  graph.node_start.reserve(static_cast<std::size_t>(all) + 1);
  graph.node_start.push_back(0);
  for (Index n = 0; n < all; ++n) {
    const auto node = static_cast<std::size_t>(n);
    const auto begin = static_cast<std::ptrdiff_t>(graph.neighbour.size());
    const auto take = [&](Index other) {
      if (std::exchange(seen[static_cast<std::size_t>(other)], n) != n)
        graph.neighbour.push_back(other);
    };
    take(n);
    for (Index k = around.start[node]; k < around.start[node + 1]; ++k)
      cells.each(around.cell[static_cast<std::size_t>(k)], take);
    std::sort(graph.neighbour.begin() + begin, graph.neighbour.end());
    require_storable(graph.neighbour.size(), n, nodes);
    graph.node_start.push_back(static_cast<Index>(graph.neighbour.size()));
  }
  return graph;
}

} // namespace supple
