#include "supple/sparse.hpp"

#include <algorithm>
#include <limits>
#include <string>
#include <utility>

#include "node_cells.hpp"
#include "supple/error.hpp"

namespace supple {
namespace {

/// Pointer to the nodes of each cell, all connectivities one after the other.
struct CellNodes {
  std::vector<const Index*> first;
  std::vector<Index> count;
};

CellNodes cell_nodes(const std::vector<Connectivity>& connectivities) {
  CellNodes nodes;
  for (const Connectivity& cells : connectivities)
    for (Eigen::Index c = 0; c < cells.rows(); ++c) {
      nodes.first.push_back(cells.data() + c * cells.cols());
      nodes.count.push_back(static_cast<Index>(cells.cols()));
    }
  return nodes;
}

void find_neighbours(BlockPattern& pattern, const NodeCells& around, const CellNodes& cells) {
  const Index all = pattern.nodes + pattern.scalars();
  std::vector<Index> seen(static_cast<std::size_t>(all), -1);
  pattern.node_start.assign(1, 0);
  const auto most = static_cast<std::size_t>(std::numeric_limits<Index>::max()) / 9;
  for (Index n = 0; n < all; ++n) {
    const auto node = static_cast<std::size_t>(n);
    const std::size_t begin = pattern.neighbour.size();
    pattern.neighbour.push_back(n);
    seen[node] = n;
    for (Index k = around.start[node]; k < around.start[node + 1]; ++k) {
      const auto cell = static_cast<std::size_t>(around.cell[static_cast<std::size_t>(k)]);
      for (Index a = 0; a < cells.count[cell]; ++a) {
        const Index other = cells.first[cell][a];
        if (seen[static_cast<std::size_t>(other)] == n) continue;
        seen[static_cast<std::size_t>(other)] = n;
        pattern.neighbour.push_back(other);
      }
    }
    std::sort(pattern.neighbour.begin() + static_cast<std::ptrdiff_t>(begin),
              pattern.neighbour.end());
    if (pattern.neighbour.size() > most)
      throw ShapeError("the matrix must have fewer than 2147483648 entries, got more at node " +
                       std::to_string(n) + " of " + std::to_string(pattern.nodes) +
                       "; use a coarser mesh or a lower order");
    pattern.node_start.push_back(static_cast<Index>(pattern.neighbour.size()));
  }
}

void expand_to_dofs(BlockPattern& pattern) {
  pattern.row_start.assign(1, 0);
  pattern.row_start.reserve(static_cast<std::size_t>(pattern.dofs()) + 1);
  pattern.column.reserve(9 * pattern.neighbour.size());
  const auto width = [&](Index a) { return a < pattern.nodes ? 3 : 1; };
  for (Index n = 0; n < pattern.nodes + pattern.scalars(); ++n) {
    const auto node = static_cast<std::size_t>(n);
    for (int i = 0; i < width(n); ++i) {
      for (Index k = pattern.node_start[node]; k < pattern.node_start[node + 1]; ++k) {
        const Index other = pattern.neighbour[static_cast<std::size_t>(k)];
        for (Index j = 0; j < width(other); ++j)
          pattern.column.push_back(pattern.first_dof(other) + j);
      }
      pattern.row_start.push_back(static_cast<Index>(pattern.column.size()));
    }
  }
}

/// How many columns at the end are scalars, in every row alike.
Index scalars_of(const Connectivity& cells, Index nodes) {
  if (cells.rows() == 0) return 0;
  const auto count = static_cast<Index>((cells.row(0).array() >= nodes).count());
  const Eigen::Index m = cells.cols() - count;
  if ((cells.leftCols(m).array() >= nodes).any() || (cells.rightCols(count).array() < nodes).any())
    throw ShapeError("cells must name their nodes first and their scalars last, got a row that "
                     "mixes them; number the scalars from the number of nodes on");
  return count;
}

Scatter scatter_map(const BlockPattern& pattern, const Connectivity& cells) {
  Scatter map;
  map.cells = static_cast<Index>(cells.rows());
  map.scalars_per_cell = scalars_of(cells, pattern.nodes);
  map.nodes_per_cell = static_cast<Index>(cells.cols()) - map.scalars_per_cell;
  const auto m = static_cast<std::size_t>(cells.cols());
  map.position.resize(static_cast<std::size_t>(cells.rows()) * m * m);
  map.row_stride.resize(static_cast<std::size_t>(cells.rows()) * m);
#pragma omp parallel for schedule(static)
  for (Index c = 0; c < map.cells; ++c)
    for (std::size_t a = 0; a < m; ++a) {
      const std::size_t row = static_cast<std::size_t>(c) * m + a;
      const Index node = cells(c, static_cast<Eigen::Index>(a));
      map.row_stride[row] = pattern.row_stride(node);
      for (std::size_t b = 0; b < m; ++b)
        map.position[row * m + b] = pattern.position(node, cells(c, static_cast<Eigen::Index>(b)));
    }
  return map;
}

} // namespace

Index BlockPattern::row_stride(Index a) const {
  const auto row = static_cast<std::size_t>(first_dof(a));
  return row_start[row + 1] - row_start[row];
}

Index BlockPattern::position(Index a, Index b) const {
  const auto node = static_cast<std::size_t>(a);
  const auto first = neighbour.begin() + node_start[node];
  const auto last = neighbour.begin() + node_start[node + 1];
  const auto found = std::lower_bound(first, last, b);
  if (found == last || *found != b) return -1;
  const auto with_three = static_cast<Index>(std::lower_bound(first, found, nodes) - first);
  const auto before = static_cast<Index>(found - first);
  return row_start[static_cast<std::size_t>(first_dof(a))] + before + 2 * with_three;
}

BlockPattern block_pattern(Index nodes, const std::vector<Connectivity>& connectivities,
                           std::vector<Index> home) {
  if (nodes < 0)
    throw ShapeError("nodes must be 0 or more, got " + std::to_string(nodes) +
                     "; give the number of points of the mesh");
  BlockPattern pattern;
  pattern.nodes = nodes;
  pattern.home = std::move(home);
  const Index all = nodes + pattern.scalars();
  find_neighbours(pattern, node_cells(all, connectivities), cell_nodes(connectivities));
  expand_to_dofs(pattern);
  for (const Connectivity& cells : connectivities)
    pattern.scatter.push_back(scatter_map(pattern, cells));
  return pattern;
}

void multiply(const BlockPattern& pattern, const ConstVector& values, const ConstVector& x,
              MutableVector y) {
  require_size("values", values.size(), pattern.nonzeros(), "assemble them on this pattern");
  require_size("x", x.size(), pattern.dofs(), "give one entry for each dof");
  require_size("y", y.size(), pattern.dofs(), "give one entry for each dof");
#pragma omp parallel for schedule(static) if (pattern.nonzeros() > 1000000)
  for (Index r = 0; r < pattern.dofs(); ++r) {
    double sum = 0.0;
    const auto row = static_cast<std::size_t>(r);
    for (Index k = pattern.row_start[row]; k < pattern.row_start[row + 1]; ++k)
      sum += values[k] * x[pattern.column[static_cast<std::size_t>(k)]];
    y[r] = sum;
  }
}

} // namespace supple
