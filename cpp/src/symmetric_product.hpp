/// y = A x from the lower triangle by columns; private to the runtime.
#pragma once

#include <vector>

#include "supple/sparse.hpp"

namespace supple {

/// Both triangles in one pass. The columns of a node share their rows, so that each row is looked
/// up once for three columns.
class SymmetricProduct {
 public:
  /// @param pattern of storage Lower; outlives this.
  explicit SymmetricProduct(const CscPattern& pattern);

  /// `values` (pattern.nonzeros()); y may not be x.
  void apply(const Vector& values, const Vector& x, Vector& y) const;

 private:
  struct Columns {
    Index first, count;   ///< columns of one node, 1 to 3
    Index below;          ///< rows below their diagonal block
    std::size_t rows;     ///< offset of those in row_
    std::ptrdiff_t at[3]; ///< of each column's first value
  };
  std::vector<Columns> columns_;
  std::vector<Index> row_;
};

} // namespace supple
