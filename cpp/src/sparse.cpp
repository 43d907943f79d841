#include "supple/sparse.hpp"

#include <algorithm>
#include <string>
#include <utility>

#include "node_cells.hpp"
#include "supple/error.hpp"

namespace supple {
namespace {

void expand_to_dofs(BlockPattern& pattern) {
  pattern.row_start.assign(1, 0);
  pattern.row_start.reserve(static_cast<std::size_t>(pattern.dofs()) + 1);
  pattern.column.reserve(9 * pattern.neighbour.size());
  for (Index n = 0; n < pattern.nodes + pattern.scalars(); ++n) {
    const auto node = static_cast<std::size_t>(n);
    for (int i = 0; i < pattern.width(n); ++i) {
      for (Index k = pattern.node_start[node]; k < pattern.node_start[node + 1]; ++k) {
        const Index other = pattern.neighbour[static_cast<std::size_t>(k)];
        for (Index j = 0; j < pattern.width(other); ++j)
          pattern.column.push_back(pattern.first_dof(other) + j);
      }
      pattern.row_start.push_back(static_cast<Index>(pattern.column.size()));
    }
  }
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
  const Index found = find(a, b);
  if (found < 0) return -1;
  const auto node = static_cast<std::size_t>(a);
  const auto first = neighbour.begin() + node_start[node];
  const auto last = neighbour.begin() + found;
  const auto with_three = static_cast<Index>(std::lower_bound(first, last, nodes) - first);
  const auto before = static_cast<Index>(last - first);
  return row_start[static_cast<std::size_t>(first_dof(a))] + before + 2 * with_three;
}

BlockPattern block_pattern(NodeGraph graph, const std::vector<Connectivity>& connectivities) {
  BlockPattern pattern;
  static_cast<NodeGraph&>(pattern) = std::move(graph);
  expand_to_dofs(pattern);
  for (auto cells = connectivities.begin(); cells != connectivities.end(); ++cells) {
    const auto same = std::find_if(connectivities.begin(), cells, [&](const Connectivity& other) {
      return same_cells(other, *cells); // a load's and the body's own
    });
    const auto known = static_cast<std::size_t>(same - connectivities.begin());
    pattern.scatter.push_back(same == cells ? scatter_map(pattern, *cells)
                                            : pattern.scatter[known]);
  }
  return pattern;
}

BlockPattern block_pattern(Index nodes, const std::vector<Connectivity>& connectivities,
                           std::vector<Index> home) {
  return block_pattern(node_graph(nodes, connectivities, std::move(home)), connectivities);
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
