/// Dense kernels of a Cholesky front stored in strips of rows; private to the runtime.
///
/// A strip is as many rows as a vector has lanes, column after column, so a column of a strip is
/// one aligned load. A panel of k columns is strips of k columns: first those of the diagonal
/// block, then those of the rows below, each part filled up to whole strips with rows of zeros.
/// Strip s of a triangle, the update of a front, has the (s + 1)·lanes columns that it needs. Every
/// operand of elimination and update lies as the inner loops read it: nothing is packed.
/// The diagonal of L holds reciprocals.
#pragma once

#include <cstdint>

namespace supple::strips {

using Index = std::int32_t;

constexpr Index kDepth = 256; ///< columns of a factor that stay in the first cache

/// Strips that hold so many rows. Internal to each unit, as strips_body.hpp says why.
static inline Index whole(Index rows, Index lanes) {
  return (rows + lanes - 1) / lanes;
}
/// Entries of the first `strips` strips of a triangle.
static inline std::int64_t triangle(Index strips, Index lanes) {
  return static_cast<std::int64_t>(lanes) * lanes * strips * (strips + 1) / 2;
}

/// A run [begin, end) of strips or of columns.
struct Run {
  Index begin, end;
};

/// The kernels for one type of number on one instruction set. None allocates, locks or throws.
/// Entries past the end of a panel may be read, as far as one strip of `lanes` columns.
template <class T>
struct Kernels {
  Index lanes; ///< rows of a strip

  /// Rows `strips`, columns `columns` of a panel (k): C −= L Lᵀ over the columns before these.
  void (*update)(T* panel, Index k, Run strips, Run columns);
  /// Factor the diagonal block of `columns`: the first column without a positive pivot, or −1.
  Index (*factor)(T* panel, Index k, Run columns);
  /// Divide the rows `strips` below the block of `columns` by its transpose.
  void (*divide)(T* panel, Index k, Run strips, Run columns);
  /// Rows `strips` of a triangle := −L Lᵀ, `below` (k columns) are all its rows of L.
  void (*outer)(T* triangle, const T* below, Index k, Run strips);
  /// What strip s of a triangle adds to another front, for `lanes` rows and columns j:
  /// to[row[lane] + column[j]] += from[j·lanes + lane] where lane + s·lanes ≥ j. Other rows of the
  /// strips that it meets are written too, with what they hold.
  void (*scatter)(T* to, const std::uint32_t* row, const std::uint32_t* column, const T* from,
                  Index s, Run columns, Index lanes);
  /// x (whole strips) := L⁻¹ x with the diagonal block; below (`strips`) −= L₂₁ x.
  void (*forward)(const T* panel, Index k, Index strips, T* x, T* below);
  /// x := L⁻ᵀ (x − L₂₁ᵀ below); `work` (k·lanes) is overwritten.
  void (*backward)(const T* panel, Index k, Index strips, T* x, const T* below, T* work);
};

/// The best kernels for this processor.
template <class T>
const Kernels<T>& kernels();

} // namespace supple::strips
