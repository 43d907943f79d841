/// Sparse matrices in small dense blocks: what multigrid multiplies with.
///
/// Blocks are 3 × 3 (nodes), 6 × 6 (rigid motions of aggregates) or 3 × 6 and 6 × 3 between them,
/// column-major, one after the other; a row's blocks may stand in any order. Values may be single
/// precision. Rows are shared among threads and each is summed in a fixed order, so that results
/// do not depend on the thread count.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "supple/sparse.hpp"

namespace supple {

template <class Real>
struct BlockMatrix {
  static constexpr std::size_t kPad = 8; ///< entries behind the last block that may be read

  Index rows = 0, columns = 0;     ///< in blocks
  int height = 3, width = 3;       ///< of a block
  std::vector<std::int64_t> start; ///< (rows + 1) offsets into `column`
  std::vector<Index> column;       ///< (blocks)
  std::vector<Real> value;         ///< (blocks, width, height) and kPad more

  std::int64_t blocks() const { return static_cast<std::int64_t>(column.size()); }
  std::ptrdiff_t area() const { return std::ptrdiff_t{height} * width; }
  Real* block(std::int64_t k) { return value.data() + k * area(); }
  const Real* block(std::int64_t k) const { return value.data() + k * area(); }
  /// The block at (row, column), −1 if there is none.
  std::int64_t find(Index row, Index at) const;
  /// Room for the blocks of `column`, all zero.
  void allocate() { value.assign(column.size() * static_cast<std::size_t>(area()) + kPad, Real{}); }
};

/// y = A x, or y −= A x; vectors hold `width` entries a column block, `height` a row block.
template <class Real>
void multiply(const BlockMatrix<Real>& A, const Real* x, Real* y);
template <class Real>
void subtract_product(const BlockMatrix<Real>& A, const Real* x, Real* y);

/// A B in double precision. Cost O(blocks of A × blocks in a row of B).
/// @throws ShapeError where the sizes do not fit.
template <class Left, class Right>
BlockMatrix<double> product(const BlockMatrix<Left>& A, const BlockMatrix<Right>& B);

template <class Real>
BlockMatrix<Real> transpose(const BlockMatrix<Real>& A);

/// The same in single precision.
BlockMatrix<float> rounded(const BlockMatrix<double>& A);

/// Inverses of the diagonal blocks of a symmetric matrix, column-major one after the other.
///
/// `lost` is set to a block that is not positive definite, −1 if there is none.
std::vector<double> inverse_diagonal(const BlockMatrix<double>& A, Index& lost);

/// x · y, summed over pieces of fixed length.
double dot(const Vector& x, const Vector& y);

} // namespace supple
