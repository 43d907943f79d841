/// The order in which cells lie together in space; private to the runtime.
#pragma once

#include <vector>

#include "supple/sparse.hpp"

namespace supple {

/// (cells) cell numbers along Morton's curve through the cells' centres, ties in their own order.
///
/// Cells that follow one another then share nodes, whatever the order in which a mesher wrote them:
/// what a run of them reads and adds to stays in the cache.
/// @param points (3n) m; `cells` name the nodes of `points` in their first `m` columns.
/// Source: Morton (1966), A computer oriented geodetic data base; IBM.
std::vector<Index> order_cells(const Vector& points, const Connectivity& cells, Index m);

} // namespace supple
