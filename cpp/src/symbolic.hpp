/// Which supernodes a symmetric pattern has under an order of its groups; private to the runtime.
///
/// All on the graph of the groups, a ninth of the entries of the matrix where a group is a node.
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "group_graph.hpp"

namespace supple {

/// Runs of columns that are eliminated together, and the rows below them.
struct Symbolic {
  std::vector<Index> order;           ///< (n) unknown that is column j
  std::vector<Index> first{0};        ///< (supernodes + 1) first columns; children before parents
  std::vector<std::int64_t> start{0}; ///< (supernodes + 1) offsets into `row`
  std::vector<Index> row;             ///< columns of the rows below, ascending
  double flops = 0.0, nonzeros = 0.0; ///< of LLᵀ, without the zeros that supernodes share
};

/// Symbolic factorisation under `order`, group by group; supernodes are merged where a front costs
/// more than the zeros that it saves.
/// Cost: O(entries of the factor of the group graph).
/// Source: Gilbert, Ng, Peyton (1994), SIAM J. Matrix Anal. 15(4), for fundamental supernodes.
Symbolic factorise_symbolically(const GroupGraph& graph, const std::vector<std::int64_t>& order);

/// A lower triangle, the order that was found for it, and what that order costs.
struct Analysis {
  CscPattern pattern;
  Symbolic symbolic;
  const char* ordering = "none";
};

/// Order a lower triangle by AMD, and by METIS too where that may save more than it takes; the
/// order with fewer flops is kept. If a factor that lives has the same pattern, what it has.
/// @throws NumericalError out of memory.
std::shared_ptr<const Analysis> shared_analysis(const CscPattern& lower);

} // namespace supple
