#include <algorithm>
#include <numeric>

#include "supple/error.hpp"
#include "supple/sparse.hpp"

namespace supple {
namespace {

std::vector<Index> number_free(const Mask& free, std::vector<Index>& dof) {
  std::vector<Index> unknown(static_cast<std::size_t>(free.size()), -1);
  for (Eigen::Index d = 0; d < free.size(); ++d)
    if (free[d]) {
      unknown[static_cast<std::size_t>(d)] = static_cast<Index>(dof.size());
      dof.push_back(static_cast<Index>(d));
    }
  return unknown;
}

/// Call use(row unknown, column unknown, position) for every entry between free dofs, row by row.
template <class Use>
void for_free_entries(const BlockPattern& pattern, const Reduction& reduction, Use use) {
  for (Index row = 0; row < reduction.free(); ++row) {
    const auto dof = static_cast<std::size_t>(reduction.dof[static_cast<std::size_t>(row)]);
    for (Index k = pattern.row_start[dof]; k < pattern.row_start[dof + 1]; ++k) {
      const Index column = pattern.column[static_cast<std::size_t>(k)];
      const Index unknown = reduction.unknown[static_cast<std::size_t>(column)];
      if (unknown >= 0) use(row, unknown, k);
    }
  }
}

/// Column c of the lower triangle is row c of the upper one, in the same order.
void fill_lower(const BlockPattern& pattern, Reduction& reduction) {
  CscPattern& csc = reduction.pattern;
  for_free_entries(pattern, reduction, [&](Index row, Index column, Index position) {
    if (column < row) return;
    csc.row.push_back(column);
    reduction.source.push_back(position);
    csc.start[static_cast<std::size_t>(row) + 1] = csc.nonzeros();
  });
}

void fill_full(const BlockPattern& pattern, Reduction& reduction) {
  CscPattern& csc = reduction.pattern;
  for_free_entries(pattern, reduction, [&](Index, Index column, Index) {
    ++csc.start[static_cast<std::size_t>(column) + 1];
  });
  for (std::size_t c = 1; c < csc.start.size(); ++c)
    csc.start[c] += csc.start[c - 1];
  csc.row.resize(static_cast<std::size_t>(csc.start.back()));
  reduction.source.resize(csc.row.size());
  std::vector<std::int64_t> next(csc.start.begin(), csc.start.end() - 1);
  for_free_entries(pattern, reduction, [&](Index row, Index column, Index position) {
    const auto k = static_cast<std::size_t>(next[static_cast<std::size_t>(column)]++);
    csc.row[k] = row;
    reduction.source[k] = position;
  });
}

/// Everything but which entries there are.
Reduction number(const NodeGraph& graph, const Mask& free) {
  require_size("free", free.size(), graph.dofs(), "give one entry for each dof");
  Reduction reduction;
  reduction.unknown = number_free(free, reduction.dof);
  CscPattern& csc = reduction.pattern;
  csc.size = reduction.free();
  csc.start.assign(static_cast<std::size_t>(csc.size) + 1, 0);
  csc.group.reserve(reduction.dof.size());
  for (Index dof : reduction.dof) { // a scalar is eliminated together with its home
    const Index scalar = dof - 3 * graph.nodes;
    csc.group.push_back(scalar < 0 ? dof / 3 : graph.home[static_cast<std::size_t>(scalar)]);
  }
  return reduction;
}

/// The free dofs of a node and of its neighbours.
class FreeBlocks {
 public:
  FreeBlocks(const NodeGraph& graph, const Mask& free) : graph_(graph), free_(free) {}

  /// Call use(dof) for the rows ≥ `dof` of its column; how many they are.
  template <class Use>
  std::int64_t column(Index dof, Use use) const {
    const Index node = dof < 3 * graph_.nodes ? dof / 3 : dof - 2 * graph_.nodes;
    const Index last = graph_.node_start[static_cast<std::size_t>(node) + 1];
    std::int64_t count = 0;
    for (Index k = graph_.find(node, node); k < last; ++k) {
      const Index other = graph_.neighbour[static_cast<std::size_t>(k)];
      const Index begin = graph_.first_dof(other), end = begin + graph_.width(other);
      for (Index row = std::max(begin, dof); row < end; ++row) {
        if (!free_[row]) continue;
        use(row);
        ++count;
      }
    }
    return count;
  }

 private:
  const NodeGraph& graph_;
  const Mask& free_;
};

} // namespace

Reduction reduce(const BlockPattern& pattern, const Mask& free, Storage storage) {
  Reduction reduction = number(pattern, free);
  reduction.full_nonzeros = pattern.nonzeros();
  reduction.pattern.lower = storage == Storage::Lower;
  reduction.pattern.lower ? fill_lower(pattern, reduction) : fill_full(pattern, reduction);
  return reduction;
}

Reduction reduce_lower(const NodeGraph& graph, const Mask& free) {
  Reduction reduction = number(graph, free);
  CscPattern& csc = reduction.pattern;
  csc.lower = true;
  const FreeBlocks blocks(graph, free);
#pragma omp parallel for schedule(static)
  for (Index c = 0; c < reduction.free(); ++c)
    csc.start[static_cast<std::size_t>(c) + 1] =
        blocks.column(reduction.dof[static_cast<std::size_t>(c)], [](Index) {});
  std::partial_sum(csc.start.begin(), csc.start.end(), csc.start.begin());
  csc.row.resize(static_cast<std::size_t>(csc.start.back()));
#pragma omp parallel for schedule(static)
  for (Index c = 0; c < reduction.free(); ++c) {
    std::int64_t* row = csc.row.data() + csc.start[static_cast<std::size_t>(c)];
    blocks.column(reduction.dof[static_cast<std::size_t>(c)],
                  [&](Index dof) { *row++ = reduction.unknown[static_cast<std::size_t>(dof)]; });
  }
  return reduction;
}

std::vector<Index> mirror(const BlockPattern& pattern, const Reduction& reduction) {
  if (!reduction.pattern.lower)
    throw ShapeError("mirror wants a reduction to the lower triangle, got the full matrix; "
                     "reduce with Storage::Lower");
  std::vector<Index> position(reduction.source.size());
  const CscPattern& csc = reduction.pattern;
  std::vector<std::int64_t> next(csc.start.begin(), csc.start.end() - 1);
  for_free_entries(pattern, reduction, [&](Index row, Index column, Index at) {
    if (column > row) return;
    position[static_cast<std::size_t>(next[static_cast<std::size_t>(column)]++)] = at;
  });
  return position;
}

void Reduction::gather(const ConstVector& values, MutableVector reduced) const {
  require_size("values", values.size(), full_nonzeros, "assemble them on the reduced pattern");
  require_size("reduced", reduced.size(), pattern.nonzeros(), "size it as pattern.nonzeros()");
  for (std::size_t k = 0; k < source.size(); ++k)
    reduced[static_cast<Eigen::Index>(k)] = values[source[k]];
}

Vector Reduction::restrict(const ConstVector& full) const {
  require_size("full", full.size(), static_cast<long long>(unknown.size()),
               "give one entry for each dof");
  Vector reduced(free());
  for (Index k = 0; k < free(); ++k)
    reduced[k] = full[dof[static_cast<std::size_t>(k)]];
  return reduced;
}

void Reduction::add_to(const ConstVector& reduced, double scale, MutableVector full) const {
  require_size("reduced", reduced.size(), free(), "give one entry for each free dof");
  require_size("full", full.size(), static_cast<long long>(unknown.size()),
               "give one entry for each dof");
  for (Index k = 0; k < free(); ++k)
    full[dof[static_cast<std::size_t>(k)]] += scale * reduced[k];
}

} // namespace supple
