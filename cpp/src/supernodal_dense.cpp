#include "supernodal_dense.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

extern "C" {
void dgemm_(const char*, const char*, const int*, const int*, const int*, const double*,
            const double*, const int*, const double*, const int*, const double*, double*,
            const int*);
void dtrsm_(const char*, const char*, const char*, const char*, const int*, const int*,
            const double*, const double*, const int*, double*, const int*);
}

namespace supple::dense {
namespace {

constexpr Index kLeaf = 16;  ///< columns below which loops beat a call of the BLAS
constexpr Index kStrip = 32; ///< rows that stay in registers while a leaf is divided
constexpr Index kWhole = 48; ///< size below which a square is as quick as its lower triangle

void multiply_add(const char* transposed, Block c, Index rows, Index columns, Block a, Block b,
                  Index inner, double beta) {
  if (rows == 0 || columns == 0) return;
  const double minus = -1.0;
  dgemm_("N", transposed, &rows, &columns, &inner, &minus, a.at, &a.stride, b.at, &b.stride, &beta,
         c.at, &c.stride);
}

/// Entry (i, j) of the triangle T in B := B T⁻¹: Lᵀ read from L, or U as it lies.
struct Coefficients {
  const double* at;
  std::ptrdiff_t down, across;
  bool unit;
  double operator()(Index i, Index j) const { return at[i * down + j * across]; }
};

/// A strip of B T⁻¹ of `size` columns: each column minus its share of those before it.
template <Index Rows>
void divide_strip(Block b, const Coefficients& t, Index size) {
  for (Index j = 0; j < size; ++j) {
    double sum[Rows];
    double* const column = &b(0, j);
    for (Index r = 0; r < Rows; ++r)
      sum[r] = column[r];
    for (Index i = 0; i < j; ++i) {
      const double factor = t(i, j);
      const double* const before = &b(0, i);
      for (Index r = 0; r < Rows; ++r)
        sum[r] -= factor * before[r];
    }
    const double scale = t.unit ? 1.0 : 1.0 / t(j, j);
    for (Index r = 0; r < Rows; ++r)
      column[r] = scale * sum[r];
  }
}

void divide_leaf(Block b, Index rows, const Coefficients& t, Index size) {
  Index r = 0;
  for (; r + kStrip <= rows; r += kStrip)
    divide_strip<kStrip>(b.from(r, 0), t, size);
  for (; r + 8 <= rows; r += 8)
    divide_strip<8>(b.from(r, 0), t, size);
  for (; r < rows; ++r)
    divide_strip<1>(b.from(r, 0), t, size);
}

/// Where to split `size`: near the half, the first part a multiple of the leaf.
Index half(Index size) {
  return (size / 2 + kLeaf - 1) / kLeaf * kLeaf;
}

void ldlt_leaf(Block a, Index size, PivotGuard& guard, Index first) {
  for (Index j = 0; j < size; ++j) {
    const double pivot = a(j, j) = guard(a(j, j), first + j);
    for (Index c = j + 1; c < size; ++c) {
      const double factor = a(c, j) / pivot;
      for (Index r = c; r < size; ++r)
        a(r, c) -= factor * a(r, j);
    }
    for (Index r = j + 1; r < size; ++r)
      a(r, j) /= pivot;
  }
}

void ldlt(Block a, Index size, double* work, PivotGuard& guard, Index first) {
  if (size <= kLeaf) {
    ldlt_leaf(a, size, guard, first);
    return;
  }
  const Index left = half(size), right = size - left;
  ldlt(a, left, work, guard, first);
  const Block below = a.from(left, 0), product{work, right}; // L and L·D of the rows below
  divide_by_lower(below, right, a, left);
  for (Index j = 0; j < left; ++j)
    for (Index r = 0; r < right; ++r) {
      product(r, j) = below(r, j);
      below(r, j) /= a(j, j);
    }
  subtract_lower(a.from(left, left), right, below, product, left, 1.0);
  ldlt(a.from(left, left), right, work, guard, first + left);
}

void exchange_rows(Block a, Index columns, const Index* pivot, Index begin, Index end) {
  for (Index j = 0; j < columns; ++j)
    for (Index r = begin; r < end; ++r)
      if (pivot[r] != r) std::swap(a(r, j), a(pivot[r], j));
}

void lu_leaf(Block a, Index rows, Index columns, Index* pivot, PivotGuard& guard, Index first) {
  for (Index j = 0; j < columns; ++j) {
    Index largest = j;
    for (Index r = j + 1; r < rows; ++r)
      if (std::abs(a(r, j)) > std::abs(a(largest, j))) largest = r;
    pivot[j] = largest;
    if (largest != j)
      for (Index c = 0; c < columns; ++c)
        std::swap(a(j, c), a(largest, c));
    const double reciprocal = 1.0 / (a(j, j) = guard(a(j, j), first + j));
    for (Index r = j + 1; r < rows; ++r)
      a(r, j) *= reciprocal;
    for (Index c = j + 1; c < columns; ++c) {
      const double factor = a(j, c);
      for (Index r = j + 1; r < rows; ++r)
        a(r, c) -= factor * a(r, j);
    }
  }
}

/// P A = L U of a tall block; pivots count from its first row.
void lu(Block a, Index rows, Index columns, Index* pivot, PivotGuard& guard, Index first) {
  if (columns <= kLeaf / 2) {
    lu_leaf(a, rows, columns, pivot, guard, first);
    return;
  }
  const Index left = columns / 2, right = columns - left;
  lu(a, rows, left, pivot, guard, first);
  const Block upper = a.from(0, left), corner = a.from(left, left);
  exchange_rows(upper, right, pivot, 0, left);
  const double one = 1.0;
  dtrsm_("L", "L", "N", "U", &left, &right, &one, a.at, &a.stride, upper.at, &upper.stride);
  multiply_add("N", corner, rows - left, right, a.from(left, 0), upper, left, 1.0);
  lu(corner, rows - left, right, pivot + left, guard, first + left);
  for (Index j = left; j < columns; ++j)
    pivot[j] += left;
  exchange_rows(a, left, pivot, left, columns);
}

} // namespace

double PivotGuard::operator()(double pivot, Index column) {
  const double size = scale[column];
  if (std::abs(pivot) > tiny * size) return pivot;
  ++raised;
  const double least =
      std::sqrt(std::numeric_limits<double>::epsilon()) * (size > 0.0 ? size : 1.0);
  return std::signbit(pivot) ? -least : least;
}

void subtract_product(Block c, Index rows, Index columns, Block a, Block b, Index inner,
                      double beta) {
  multiply_add("T", c, rows, columns, a, b, inner, beta);
}

void subtract_lower(Block c, Index size, Block a, Block b, Index inner, double beta) {
  if (size <= kWhole) {
    subtract_product(c, size, size, a, b, inner, beta);
    return;
  }
  const Index top = half(size), bottom = size - top;
  subtract_lower(c, top, a, b, inner, beta);
  subtract_product(c.from(top, 0), bottom, top, a.from(top, 0), b, inner, beta);
  subtract_lower(c.from(top, top), bottom, a.from(top, 0), b.from(top, 0), inner, beta);
}

void divide_by_lower(Block b, Index rows, Block l, Index size) {
  if (size <= kLeaf) {
    divide_leaf(b, rows, {l.at, l.stride, 1, true}, size);
    return;
  }
  const Index left = half(size);
  divide_by_lower(b, rows, l, left);
  subtract_product(b.from(0, left), rows, size - left, b, l.from(left, 0), left, 1.0);
  divide_by_lower(b.from(0, left), rows, l.from(left, left), size - left);
}

void divide_by_upper(Block b, Index rows, Block u, Index size) {
  if (size <= kLeaf) {
    divide_leaf(b, rows, {u.at, 1, u.stride, false}, size);
    return;
  }
  const Index left = half(size);
  divide_by_upper(b, rows, u, left);
  multiply_add("N", b.from(0, left), rows, size - left, b, u.from(0, left), left, 1.0);
  divide_by_upper(b.from(0, left), rows, u.from(left, left), size - left);
}

void factor_ldlt(Block a, Index size, double* work, PivotGuard& guard) {
  ldlt(a, size, work, guard, 0);
}

void factor_lu(Block a, Index size, Index* pivot, PivotGuard& guard) {
  lu(a, size, size, pivot, guard, 0);
}

} // namespace supple::dense
