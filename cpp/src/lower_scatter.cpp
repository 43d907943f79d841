#include <algorithm>
#include <limits>
#include <string>
#include <utility>

#include "node_cells.hpp"
#include "supple/error.hpp"

namespace supple {
namespace {

constexpr Index kNothing = -1, kInPart = -2;
constexpr Index kWrong = std::numeric_limits<Index>::min();

/// Finds blocks and entries in the columns of the reduced lower triangle.
class Places {
 public:
  Places(const NodeGraph& graph, const Reduction& reduction)
      : graph_(graph), reduction_(reduction),
        free_(static_cast<std::size_t>(graph.nodes + graph.scalars())),
        below_(graph.neighbour.size()) {
    const Index all = graph.nodes + graph.scalars();
#pragma omp parallel for schedule(static)
    for (Index node = 0; node < all; ++node)
      free_[static_cast<std::size_t>(node)] = static_cast<std::int8_t>(rank(node, 3));
#pragma omp parallel for schedule(static)
    for (Index node = 0; node < all; ++node) {
      Index rows = 0;
      const Index last = graph.node_start[static_cast<std::size_t>(node) + 1];
      for (Index k = graph.find(node, node); k < last; ++k) {
        below_[static_cast<std::size_t>(k)] = rows;
        rows += free(graph.neighbour[static_cast<std::size_t>(k)]);
      }
    }
  }

  /// How many dofs of a node are free.
  Index free(Index node) const { return free_[static_cast<std::size_t>(node)]; }
  bool whole(Index node) const { return free(node) == graph_.width(node); }

  /// From an entry in the first column of a node to the one beside it; 0 where it has one column.
  Index step(Index node) const {
    if (graph_.width(node) == 1 || !whole(node)) return 0;
    const auto column = static_cast<std::size_t>(unknown(node, 0));
    const std::vector<std::int64_t>& start = reduction_.pattern.start;
    return static_cast<Index>(start[column + 1] - start[column] - 1);
  }

  /// First entry of the block of two nodes, or what stands for it.
  Index block(Index a, Index b) const {
    if (free(a) == 0 || free(b) == 0) return kNothing;
    if (!whole(a) || !whole(b)) return kInPart;
    const Index column = std::min(a, b), found = graph_.find(column, std::max(a, b));
    return found < 0 ? kWrong : at(found, column, 0);
  }

  /// Entry of dof `i` of node `a` and dof `j` of node `b`; −1 if it is not stored.
  Index entry(Index a, Index i, Index b, Index j) const {
    if (a < b) {
      std::swap(a, b);
      std::swap(i, j);
    }
    if (unknown(a, i) < 0 || unknown(b, j) < 0 || (a == b && i < j)) return -1;
    const Index found = graph_.find(b, a);
    return found < 0 ? kWrong : at(found, b, j) + rank(a, i);
  }

 private:
  Index unknown(Index node, Index i) const {
    return reduction_.unknown[static_cast<std::size_t>(graph_.first_dof(node) + i)];
  }
  /// Free dofs of a node before the `i`-th.
  Index rank(Index node, Index i) const {
    Index count = 0;
    for (Index k = 0; k < std::min(i, graph_.width(node)); ++k)
      count += unknown(node, k) >= 0 ? 1 : 0;
    return count;
  }
  /// Where the first row of neighbour `k` is, or would be, in the free column `j` of `node`: each
  /// column of a node has lost one row of the diagonal block to the one before it.
  Index at(Index k, Index node, Index j) const {
    const auto column = static_cast<std::size_t>(unknown(node, j));
    const auto start = static_cast<Index>(reduction_.pattern.start[column]);
    return start + below_[static_cast<std::size_t>(k)] - rank(node, j);
  }

  const NodeGraph& graph_;
  const Reduction& reduction_;
  std::vector<std::int8_t> free_; // (nodes + scalars)
  std::vector<Index> below_;      // (neighbours) rows of a node's first column above each
};

/// Call use(block, global nodes a, b, local a == b) for each block of each cell.
template <class Use>
void each_block(const LowerScatter& map, const Connectivity& cells, Index cell, Use use) {
  const Index m = map.nodes_per_cell + map.scalars_per_cell;
  const Index* node = cells.data() + std::ptrdiff_t{cell} * m;
  std::size_t k = static_cast<std::size_t>(cell) * static_cast<std::size_t>(map.blocks());
  for (Index a = 0; a < m; ++a)
    for (Index b = 0; b <= a; ++b)
      use(k++, node[a], node[b], a == b);
}

LowerScatter scatter(const NodeGraph& graph, const Places& places, const Connectivity& cells) {
  LowerScatter map;
  map.cells = static_cast<Index>(cells.rows());
  map.scalars_per_cell = scalars_of(cells, graph.nodes);
  map.nodes_per_cell = static_cast<Index>(cells.cols()) - map.scalars_per_cell;
  map.position.resize(static_cast<std::size_t>(map.cells * map.blocks()));
#pragma omp parallel for schedule(static)
  for (Index c = 0; c < map.cells; ++c)
    each_block(map, cells, c, [&](std::size_t k, Index a, Index b, bool diagonal) {
      map.position[k] = (a == b) == diagonal ? places.block(a, b) : kWrong;
    });
  for (Index c = 0; c < map.cells; ++c)
    each_block(map, cells, c, [&](std::size_t k, Index a, Index b, bool diagonal) {
      if (map.position[k] == kWrong)
        throw ShapeError("cells must be those of the graph and name a node once, got cell " +
                         std::to_string(c) + "; make the graph of them, repair the mesh");
      if (map.position[k] != kInPart) return;
      map.position[k] = -2 - static_cast<Index>(map.entry.size());
      for (Index i = 0; i < graph.width(a); ++i)
        for (Index j = 0; j < graph.width(b); ++j)
          map.entry.push_back(diagonal && j > i ? kNothing : places.entry(a, i, b, j));
    });
  return map;
}

} // namespace

std::vector<LowerScatter> lower_scatter(const NodeGraph& graph, const Reduction& reduction,
                                        const std::vector<Connectivity>& connectivities) {
  const Places places(graph, reduction);
  auto step = std::make_shared<std::vector<Index>>();
  for (Index node = 0; node < graph.nodes + graph.scalars(); ++node)
    step->push_back(places.step(node));
  std::vector<LowerScatter> maps;
  for (const Connectivity& cells : connectivities) {
    maps.push_back(scatter(graph, places, cells));
    maps.back().step = step;
  }
  return maps;
}

} // namespace supple
