/// The graph of the groups of a symmetric pattern: the unknowns of a node have equal neighbours, so
/// one stands for all and an ordering works on a matrix of a ninth of the entries. Private to the
/// runtime.
#pragma once

#include <cstdint>
#include <vector>

#include "supple/sparse.hpp"

namespace supple {

/// Lower triangle of the group graph by columns, and the unknowns behind each group.
struct GroupGraph {
  std::vector<std::int64_t> start{0}, row;
  std::vector<std::vector<std::int64_t>> unknowns; ///< of each group, ascending

  /// Groups are numbered by their first unknown; a pattern without groups has one for each unknown.
  explicit GroupGraph(const CscPattern& pattern);

  /// The order of the unknowns that an order of the groups gives.
  std::vector<std::int64_t> expand(const std::vector<std::int64_t>& order) const;
};

} // namespace supple
