/// Dense kernels of the supernodal factorisation on column-major blocks; private to the runtime.
///
/// All are recursive, so that nearly every operation is a dgemm, and none allocates, locks or
/// throws.
#pragma once

#include "supple/sparse.hpp"

namespace supple::dense {

/// A block inside a column-major array: entry (i, j) is at[i + j·stride].
struct Block {
  double* at;
  Index stride;

  double& operator()(Index i, Index j) const {
    return at[i + static_cast<std::ptrdiff_t>(j) * stride];
  }
  Block from(Index i, Index j) const { return {&(*this)(i, j), stride}; }
};

/// Pivots that are kept away from zero, so that a factorisation without a choice of pivots goes on:
/// one below `tiny` of its column's largest entry in A becomes √ε of that entry, its sign kept.
/// Source: Li and Demmel (2003), ACM TOMS 29(2), §2; refinement repairs what that spoils.
struct PivotGuard {
  static constexpr double tiny = 1e-14;
  const double* scale;     ///< (columns) largest magnitude in each column of A
  std::int64_t raised = 0; ///< pivots that were too small

  double operator()(double pivot, Index column);
};

/// C (rows × columns) = beta·C − A (rows × inner) Bᵀ, B (columns × inner).
void subtract_product(Block c, Index rows, Index columns, Block a, Block b, Index inner,
                      double beta);
/// The same for square C (size) of which only the lower triangle is wanted; some of the upper one
/// is overwritten.
void subtract_lower(Block c, Index size, Block a, Block b, Index inner, double beta);

/// B (rows × size) := B L⁻ᵀ, with the unit lower triangle L (size).
void divide_by_lower(Block b, Index rows, Block l, Index size);
/// B (rows × size) := B U⁻¹, with the upper triangle U (size).
void divide_by_upper(Block b, Index rows, Block u, Index size);

/// A = L D Lᵀ in place, lower triangle of A (size): D on the diagonal, unit L below it.
/// @param work (size²/4) overwritten.
void factor_ldlt(Block a, Index size, double* work, PivotGuard& guard);

/// P A = L U in place, A (size): rows are exchanged, row j with pivot[j] ≥ j in the order of j.
void factor_lu(Block a, Index size, Index* pivot, PivotGuard& guard);

} // namespace supple::dense
