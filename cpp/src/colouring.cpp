#include <algorithm>
#include <string>

#include "node_cells.hpp"
#include "supple/error.hpp"

namespace supple {
namespace {

/// Lowest colour that no batch around the cells of `batch` has; `taken[c] == batch` marks c as
/// used.
Index first_free_colour(const Connectivity& cells, const NodeCells& around, Index size, Index batch,
                        const std::vector<Index>& colour, std::vector<Index>& taken) {
  const auto last = std::min<Eigen::Index>(cells.rows(), (batch + Eigen::Index{1}) * size);
  for (Eigen::Index c = Eigen::Index{batch} * size; c < last; ++c)
    for (Eigen::Index a = 0; a < cells.cols(); ++a) {
      const auto node = static_cast<std::size_t>(cells(c, a));
      for (Index k = around.start[node]; k < around.start[node + 1]; ++k) {
        const Index other = around.cell[static_cast<std::size_t>(k)] / size;
        const Index used = colour[static_cast<std::size_t>(other)];
        if (used >= 0) taken[static_cast<std::size_t>(used)] = batch;
      }
    }
  const auto found = std::find_if(taken.begin(), taken.end(), [&](Index t) { return t != batch; });
  return static_cast<Index>(found - taken.begin());
}

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
  const NodeCells around = node_cells(nodes, {cells});
  const auto batches = (cells.rows() + batch - 1) / batch;
  std::vector<Index> colour(static_cast<std::size_t>(batches), -1);
  std::vector<Index> taken; // one entry a colour
  for (Index k = 0; k < static_cast<Index>(batches); ++k) {
    const Index c = first_free_colour(cells, around, batch, k, colour, taken);
    if (c == static_cast<Index>(taken.size())) taken.push_back(-1);
    colour[static_cast<std::size_t>(k)] = c;
  }
  return sort_by_colour(colour, static_cast<Index>(taken.size()));
}

} // namespace supple
