/// The reduced matrix in 3 × 3 blocks, one row of blocks a node, and vectors to and fro.
///
/// A fixed direction of a node that is otherwise free is padded: its entries are zero but for a
/// diagonal of the matrix' mean size, so that it couples to nothing.
#pragma once

#include "supple/block_matrix.hpp"

namespace supple {

class NodeBlocks {
 public:
  /// @param dof (unknowns) 3·node + direction of each unknown, ascending.
  /// @throws ShapeError if the pattern stores more than the lower triangle, or sizes do not fit.
  NodeBlocks(const CscPattern& pattern, std::vector<Index> dof);

  /// The matrix with `values` (pattern.nonzeros()); the pattern's blocks stay where they are.
  void fill(const CscPattern& pattern, const ConstVector& values);
  const BlockMatrix<double>& matrix() const { return matrix_; }

  Index nodes() const { return static_cast<Index>(node_.size()); }
  /// (nodes) number in the mesh of each block row.
  const std::vector<Index>& node() const { return node_; }
  /// (unknowns) entry of the block vector that each stands at.
  const std::vector<Index>& place() const { return place_; }
  /// (3 nodes) whether the entry is an unknown.
  const std::vector<char>& free() const { return free_; }

 private:
  void find_blocks(const CscPattern& pattern);
  void find_twins();

  std::vector<Index> node_, place_;
  std::vector<char> free_;
  std::vector<std::int64_t> twin_; // of a block below the diagonal, the one that mirrors it
  BlockMatrix<double> matrix_;
};

} // namespace supple
