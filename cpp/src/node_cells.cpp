#include "node_cells.hpp"

#include <string>

#include "supple/error.hpp"

namespace supple {

void check_nodes(const Connectivity& cells, Index nodes) {
  if (cells.size() == 0) return;
  const Index low = cells.minCoeff();
  const Index high = cells.maxCoeff();
  if (low >= 0 && high < nodes) return;
  throw ShapeError("cells must name nodes from 0 to " + std::to_string(nodes - 1) + ", got " +
                   std::to_string(low < 0 ? low : high) +
                   "; give the number of nodes that the points have, or renumber the cells");
}

NodeCells node_cells(Index nodes, const std::vector<Connectivity>& connectivities) {
  for (const Connectivity& cells : connectivities)
    check_nodes(cells, nodes);
  NodeCells map;
  map.start.assign(static_cast<std::size_t>(nodes) + 1, 0);
  for (const Connectivity& cells : connectivities)
    for (Eigen::Index k = 0; k < cells.size(); ++k)
      ++map.start[static_cast<std::size_t>(cells.data()[k]) + 1];
  for (std::size_t n = 0; n < static_cast<std::size_t>(nodes); ++n)
    map.start[n + 1] += map.start[n];
  map.cell.resize(static_cast<std::size_t>(map.start.back()));
  std::vector<Index> next(map.start.begin(), map.start.end() - 1);
  Index number = 0;
  for (const Connectivity& cells : connectivities)
    for (Eigen::Index c = 0; c < cells.rows(); ++c, ++number)
      for (Eigen::Index a = 0; a < cells.cols(); ++a)
        map.cell[static_cast<std::size_t>(next[static_cast<std::size_t>(cells(c, a))]++)] = number;
  return map;
}

bool same_cells(const Connectivity& a, const Connectivity& b) {
  return a.rows() == b.rows() && a.cols() == b.cols() && a == b;
}

Index scalars_of(const Connectivity& cells, Index nodes) {
  if (cells.rows() == 0) return 0;
  const auto count = static_cast<Index>((cells.row(0).array() >= nodes).count());
  const Eigen::Index m = cells.cols() - count;
  if ((cells.leftCols(m).array() >= nodes).any() || (cells.rightCols(count).array() < nodes).any())
    throw ShapeError("cells must name their nodes first and their scalars last, got a row that "
                     "mixes them; number the scalars from the number of nodes on");
  return count;
}

} // namespace supple
