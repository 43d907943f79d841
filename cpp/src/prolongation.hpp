/// Prolongations of the multigrid levels: from corners to nodes, from aggregates to their members.
#pragma once

#include "node_blocks.hpp"
#include "supple/multigrid.hpp"

namespace supple {

/// Displacements of `nodes` (of `dofs`/3) in the six rigid motions about their middle, scaled to
/// about one; zero where an entry of `free` (3 nodes) is.
Modes rigid_motions(const Vector& points, const std::vector<Index>& nodes,
                    const std::vector<char>& free);

/// From the corners of degree 1 to the nodes of `fine`; `corner` gets the node number of each
/// column. Fixed directions, of a node or a corner, have no part in it.
BlockMatrix<double> from_corners(const NodeBlocks& fine, const Corners& corners,
                                 std::vector<Index>& corner, std::vector<char>& free);

/// (I − ω D⁻¹A) T with the tentative T of the aggregates and ω = 4/3 over `largest`.
BlockMatrix<double> smoothed(const BlockMatrix<double>& A, const std::vector<double>& inverse,
                             double largest, const Aggregates& aggregates);

} // namespace supple
