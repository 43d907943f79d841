/// The cells around each node; private to the runtime.
#pragma once

#include <vector>

#include "supple/sparse.hpp"

namespace supple {

/// Cells around each node, for all connectivities numbered one after the other.
struct NodeCells {
  std::vector<Index> start; ///< (nodes + 1)
  std::vector<Index> cell;  ///< ascending for each node
};

/// @throws ShapeError if a cell names a node outside [0, nodes).
void check_nodes(const Connectivity& cells, Index nodes);

/// @throws ShapeError if a cell names a node outside [0, nodes).
NodeCells node_cells(Index nodes, const std::vector<Connectivity>& connectivities);

bool same_cells(const Connectivity& a, const Connectivity& b);

/// How many columns at the end are scalars, numbered from `nodes` on, in every row alike.
/// @throws ShapeError if a row mixes them.
Index scalars_of(const Connectivity& cells, Index nodes);

} // namespace supple
