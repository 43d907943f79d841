#include "supple/block_matrix.hpp"

#include <algorithm>
#include <Eigen/Cholesky>
#include <string>
#include <utility>

#include "supple/error.hpp"

namespace supple {
namespace {

constexpr Index kWorthThreads = 2000; // block rows

/// Lanes that hold a column of a block; those behind its end are read and never used.
template <class Real, int Height>
struct Lanes {
  static constexpr int count = Height <= 4 ? 4 : 8;
  typedef Real type __attribute__((vector_size(count * sizeof(Real)), aligned(sizeof(Real))));
};

/// Σ A_ij x_j over the blocks of row i.
template <int Height, int Width, class Real>
inline typename Lanes<Real, Height>::type row_times(const BlockMatrix<Real>& A, Index i,
                                                    const Real* x) {
  using Column = typename Lanes<Real, Height>::type;
  Column sum{};
  const auto row = static_cast<std::size_t>(i);
  const Real* block = A.block(A.start[row]);
  for (std::int64_t k = A.start[row]; k < A.start[row + 1]; ++k, block += Height * Width) {
    const Real* part = x + std::ptrdiff_t{Width} * A.column[static_cast<std::size_t>(k)];
    for (int j = 0; j < Width; ++j)
      sum += *reinterpret_cast<const Column*>(block + j * Height) * part[j];
  }
  return sum;
}

template <int Height, int Width, class Real, class Use>
void for_rows(const BlockMatrix<Real>& A, const Real* x, Use use) {
#pragma omp parallel for schedule(static) if (A.rows > kWorthThreads)
  for (Index i = 0; i < A.rows; ++i) {
    const auto sum = row_times<Height, Width>(A, i, x);
    for (int r = 0; r < Height; ++r)
      use(std::ptrdiff_t{Height} * i + r, sum[r]);
  }
}

template <class Real, class Use>
void for_entries(const BlockMatrix<Real>& A, const Real* x, Use use) {
  if (A.height == 3)
    A.width == 3 ? for_rows<3, 3>(A, x, use) : for_rows<3, 6>(A, x, use);
  else
    A.width == 3 ? for_rows<6, 3>(A, x, use) : for_rows<6, 6>(A, x, use);
}

/// Calls use(column of A's block, block of A, column of B's block, block of B) for a row of A B.
template <class Left, class Right, class Use>
inline void for_terms(const BlockMatrix<Left>& A, const BlockMatrix<Right>& B, Index i, Use use) {
  for (std::int64_t k = A.start[static_cast<std::size_t>(i)];
       k < A.start[static_cast<std::size_t>(i) + 1]; ++k) {
    const auto middle = static_cast<std::size_t>(A.column[static_cast<std::size_t>(k)]);
    for (std::int64_t l = B.start[middle]; l < B.start[middle + 1]; ++l)
      use(k, l, static_cast<std::size_t>(B.column[static_cast<std::size_t>(l)]));
  }
}

/// The pattern of A B: a row's columns in the order in which they are met.
template <class Left, class Right>
BlockMatrix<double> product_pattern(const BlockMatrix<Left>& A, const BlockMatrix<Right>& B) {
  BlockMatrix<double> C;
  C.rows = A.rows, C.columns = B.columns, C.height = A.height, C.width = B.width;
  C.start.assign(static_cast<std::size_t>(A.rows) + 1, 0);
  const auto width = static_cast<std::size_t>(B.columns);
#pragma omp parallel if (A.rows > kWorthThreads)
  {
    std::vector<Index> seen(width, -1);
#pragma omp for schedule(dynamic, 512)
    for (Index i = 0; i < A.rows; ++i) {
      std::int64_t& count = C.start[static_cast<std::size_t>(i) + 1];
      for_terms(A, B, i, [&](std::int64_t, std::int64_t, std::size_t j) {
        count += seen[j] != i;
        seen[j] = i;
      });
    }
  }
  for (std::size_t i = 0; i < static_cast<std::size_t>(C.rows); ++i)
    C.start[i + 1] += C.start[i];
  C.column.resize(static_cast<std::size_t>(C.start.back()));
  C.allocate();
  return C;
}

template <int H, int K, int W, class Left, class Right>
BlockMatrix<double> product_of(const BlockMatrix<Left>& A, const BlockMatrix<Right>& B) {
  BlockMatrix<double> C = product_pattern(A, B);
  using Sum = Eigen::Map<Eigen::Matrix<double, H, W>>;
#pragma omp parallel if (A.rows > kWorthThreads)
  {
    std::vector<std::int64_t> place(static_cast<std::size_t>(B.columns), -1);
#pragma omp for schedule(dynamic, 512)
    for (Index i = 0; i < A.rows; ++i) {
      const std::int64_t begin = C.start[static_cast<std::size_t>(i)];
      std::int64_t end = begin;
      for_terms(A, B, i, [&](std::int64_t k, std::int64_t l, std::size_t j) {
        if (place[j] < begin || place[j] >= end ||
            C.column[static_cast<std::size_t>(place[j])] != static_cast<Index>(j)) {
          place[j] = end++;
          C.column[static_cast<std::size_t>(place[j])] = static_cast<Index>(j);
        }
        const Eigen::Matrix<double, H, K> left =
            Eigen::Map<const Eigen::Matrix<Left, H, K>>(A.block(k)).template cast<double>();
        const Eigen::Matrix<double, K, W> right =
            Eigen::Map<const Eigen::Matrix<Right, K, W>>(B.block(l)).template cast<double>();
        Sum(C.block(place[j])) += left.lazyProduct(right);
      });
    }
  }
  return C;
}

template <int Size>
Index invert_blocks(const BlockMatrix<double>& A, std::vector<double>& inverse) {
  using Block = Eigen::Matrix<double, Size, Size>;
  Index lost = -1;
#pragma omp parallel for schedule(static) reduction(max : lost) if (A.rows > kWorthThreads)
  for (Index i = 0; i < A.rows; ++i) {
    const Eigen::LLT<Block> factor{Eigen::Map<const Block>(A.block(A.find(i, i)))};
    if (factor.info() != Eigen::Success) {
      lost = std::max(lost, i);
      continue;
    }
    Eigen::Map<Block>(inverse.data() + std::ptrdiff_t{Size} * Size * i) =
        factor.solve(Block::Identity());
  }
  return lost;
}

} // namespace

template <class Real>
std::int64_t BlockMatrix<Real>::find(Index row, Index at) const {
  const auto i = static_cast<std::size_t>(row);
  const auto first = column.begin() + start[i], last = column.begin() + start[i + 1];
  const auto found = std::find(first, last, at);
  return found == last ? -1 : found - column.begin();
}

template <class Real>
void multiply(const BlockMatrix<Real>& A, const Real* x, Real* y) {
  for_entries(A, x, [y](std::ptrdiff_t at, Real sum) { y[at] = sum; });
}

template <class Real>
void subtract_product(const BlockMatrix<Real>& A, const Real* x, Real* y) {
  for_entries(A, x, [y](std::ptrdiff_t at, Real sum) { y[at] -= sum; });
}

template <class Left, class Right>
BlockMatrix<double> product(const BlockMatrix<Left>& A, const BlockMatrix<Right>& B) {
  if (A.columns != B.rows || A.width != B.height)
    throw ShapeError("B must have a row for each of the " + std::to_string(A.columns) +
                     " columns of A, got " + std::to_string(B.rows) + "; in blocks of one size");
  if (A.height == 3 && A.width == 3)
    return B.width == 3 ? product_of<3, 3, 3>(A, B) : product_of<3, 3, 6>(A, B);
  if (A.height == 6) return A.width == 3 ? product_of<6, 3, 6>(A, B) : product_of<6, 6, 6>(A, B);
  return product_of<3, 6, 6>(A, B);
}

template <class Real>
BlockMatrix<Real> transpose(const BlockMatrix<Real>& A) {
  BlockMatrix<Real> T;
  T.rows = A.columns, T.columns = A.rows, T.height = A.width, T.width = A.height;
  T.start.assign(static_cast<std::size_t>(T.rows) + 1, 0);
  for (const Index j : A.column)
    ++T.start[static_cast<std::size_t>(j) + 1];
  for (std::size_t j = 0; j < static_cast<std::size_t>(T.rows); ++j)
    T.start[j + 1] += T.start[j];
  T.column.resize(A.column.size());
  T.allocate();
  std::vector<std::int64_t> next(T.start.begin(), T.start.end() - 1);
  using Block = Eigen::Matrix<Real, Eigen::Dynamic, Eigen::Dynamic>;
  for (Index i = 0; i < A.rows; ++i)
    for (std::int64_t k = A.start[static_cast<std::size_t>(i)];
         k < A.start[static_cast<std::size_t>(i) + 1]; ++k) {
      const auto j = static_cast<std::size_t>(A.column[static_cast<std::size_t>(k)]);
      T.column[static_cast<std::size_t>(next[j])] = i;
      Eigen::Map<Block>(T.block(next[j]++), T.height, T.width) =
          Eigen::Map<const Block>(A.block(k), A.height, A.width).transpose();
    }
  return T;
}

BlockMatrix<float> rounded(const BlockMatrix<double>& A) {
  BlockMatrix<float> S;
  S.rows = A.rows, S.columns = A.columns, S.height = A.height, S.width = A.width;
  S.start = A.start, S.column = A.column;
  S.value.resize(A.value.size());
  const auto size = static_cast<std::ptrdiff_t>(A.value.size());
#pragma omp parallel for schedule(static) if (A.rows > kWorthThreads)
  for (std::ptrdiff_t k = 0; k < size; ++k)
    S.value[static_cast<std::size_t>(k)] = static_cast<float>(A.value[static_cast<std::size_t>(k)]);
  return S;
}

std::vector<double> inverse_diagonal(const BlockMatrix<double>& A, Index& lost) {
  std::vector<double> inverse(static_cast<std::size_t>(A.rows * A.area()));
  lost = A.height == 3 ? invert_blocks<3>(A, inverse) : invert_blocks<6>(A, inverse);
  return inverse;
}

double dot(const Vector& x, const Vector& y) {
  constexpr Eigen::Index kPiece = 8192;
  const Eigen::Index pieces = (x.size() + kPiece - 1) / kPiece;
  Vector sums(pieces);
#pragma omp parallel for schedule(static) if (pieces > 4)
  for (Eigen::Index p = 0; p < pieces; ++p) {
    const Eigen::Index size = std::min(kPiece, x.size() - p * kPiece);
    sums[p] = x.segment(p * kPiece, size).dot(y.segment(p * kPiece, size));
  }
  return sums.sum();
}

template struct BlockMatrix<float>;
template struct BlockMatrix<double>;
template void multiply(const BlockMatrix<float>&, const float*, float*);
template void multiply(const BlockMatrix<double>&, const double*, double*);
template void subtract_product(const BlockMatrix<float>&, const float*, float*);
template BlockMatrix<double> product(const BlockMatrix<double>&, const BlockMatrix<float>&);
template BlockMatrix<double> product(const BlockMatrix<float>&, const BlockMatrix<double>&);
template BlockMatrix<double> product(const BlockMatrix<double>&, const BlockMatrix<double>&);
template BlockMatrix<float> transpose(const BlockMatrix<float>&);

} // namespace supple
