#include "prolongation.hpp"

#include <algorithm>
#include <Eigen/Core>

#include "supple/error.hpp"

namespace supple {
namespace {

constexpr double kDamping = 4.0 / 3.0; // Vaněk, Mandel, Brezina (1996)

/// The aggregates' basis as a matrix of one block a row.
BlockMatrix<double> tentative(const BlockMatrix<double>& A, const Aggregates& aggregates) {
  require_size("aggregate", static_cast<long long>(aggregates.aggregate.size()), A.rows,
               "one a block row");
  require_size("basis", aggregates.basis.rows(), static_cast<long long>(A.rows) * A.height,
               "one row a row of the matrix");
  BlockMatrix<double> T;
  T.rows = A.rows, T.columns = aggregates.count, T.height = A.height, T.width = 6;
  T.start.push_back(0);
  for (const Index a : aggregates.aggregate) {
    if (a >= 0) T.column.push_back(a);
    T.start.push_back(T.blocks());
  }
  T.allocate();
  using Block = Eigen::Matrix<double, Eigen::Dynamic, 6>;
  for (Index i = 0; i < T.rows; ++i)
    if (const std::int64_t k = T.start[static_cast<std::size_t>(i)];
        k < T.start[static_cast<std::size_t>(i) + 1])
      Eigen::Map<Block>(T.block(k), A.height, 6) =
          aggregates.basis.middleRows(Eigen::Index{A.height} * i, A.height);
  return T;
}

} // namespace

Modes rigid_motions(const Vector& points, const std::vector<Index>& nodes,
                    const std::vector<char>& free) {
  const auto at = [&](std::size_t i) { return points.segment<3>(3 * Eigen::Index{nodes[i]}); };
  Eigen::Vector3d middle = Eigen::Vector3d::Zero();
  for (std::size_t i = 0; i < nodes.size(); ++i)
    middle += at(i) / static_cast<double>(nodes.size());
  double size = 0.0;
  for (std::size_t i = 0; i < nodes.size(); ++i)
    size = std::max(size, (at(i) - middle).cwiseAbs().maxCoeff());
  if (!(size > 0.0)) size = 1.0;
  Modes modes = Modes::Zero(static_cast<Eigen::Index>(3 * nodes.size()), 6);
  for (std::size_t i = 0; i < nodes.size(); ++i) {
    const Eigen::Vector3d x = (at(i) - middle) / size;
    auto rows = modes.middleRows<3>(static_cast<Eigen::Index>(3 * i));
    rows.leftCols<3>().setIdentity();
    rows.rightCols<3>() << 0.0, x[2], -x[1], -x[2], 0.0, x[0], x[1], -x[0], 0.0;
    for (int c = 0; c < 3; ++c)
      if (!free[3 * i + static_cast<std::size_t>(c)]) rows.row(c).setZero();
  }
  return modes;
}

BlockMatrix<double> from_corners(const NodeBlocks& fine, const Corners& corners,
                                 std::vector<Index>& corner, std::vector<char>& free) {
  const std::size_t all = corners.start.size() - 1;
  std::vector<Index> own(all, -1), column(all, -1); // row of the fine matrix; column
  for (Index i = 0; i < fine.nodes(); ++i)
    own[static_cast<std::size_t>(fine.node()[static_cast<std::size_t>(i)])] = i;
  corner.clear();
  free.clear();
  for (std::size_t n = 0; n < all; ++n) {
    const bool is_corner = corners.start[n + 1] - corners.start[n] == 1;
    if (!is_corner || own[n] < 0) continue;
    column[n] = static_cast<Index>(corner.size());
    corner.push_back(static_cast<Index>(n));
    const auto* entry = fine.free().data() + 3 * own[n];
    free.insert(free.end(), entry, entry + 3);
  }
  BlockMatrix<double> P;
  P.rows = fine.nodes(), P.columns = static_cast<Index>(corner.size());
  P.start.push_back(0);
  for (const Index n : fine.node()) {
    for (Index k = corners.start[static_cast<std::size_t>(n)];
         k < corners.start[static_cast<std::size_t>(n) + 1]; ++k) {
      const auto parent = static_cast<std::size_t>(corners.corner[static_cast<std::size_t>(k)]);
      if (column[parent] >= 0) P.column.push_back(column[parent]);
    }
    P.start.push_back(P.blocks());
  }
  P.allocate();
  for (std::size_t i = 0; i < fine.node().size(); ++i) {
    const auto n = static_cast<std::size_t>(fine.node()[i]);
    const double weight = 1.0 / static_cast<double>(corners.start[n + 1] - corners.start[n]);
    for (std::int64_t k = P.start[i]; k < P.start[i + 1]; ++k) {
      const auto j = static_cast<std::size_t>(P.column[static_cast<std::size_t>(k)]);
      for (std::size_t c = 0; c < 3; ++c)
        if (fine.free()[3 * i + c] && free[3 * j + c]) P.block(k)[4 * c] = weight;
    }
  }
  return P;
}

BlockMatrix<double> smoothed(const BlockMatrix<double>& A, const std::vector<double>& inverse,
                             double largest, const Aggregates& aggregates) {
  const BlockMatrix<double> T = tentative(A, aggregates);
  BlockMatrix<double> P = product(A, T);
  const double omega = kDamping / largest;
  using Square = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic>;
  using Block = Eigen::Matrix<double, Eigen::Dynamic, 6>;
  for (Index i = 0; i < P.rows; ++i) {
    const auto row = static_cast<std::size_t>(i);
    const Eigen::Map<const Square> D(inverse.data() + A.area() * i, A.height, A.height);
    for (std::int64_t k = P.start[row]; k < P.start[row + 1]; ++k) {
      Eigen::Map<Block> block(P.block(k), A.height, 6);
      block = (-omega * D * block).eval();
      const std::int64_t own = T.start[row];
      const bool has = own < T.start[row + 1];
      if (has && T.column[static_cast<std::size_t>(own)] == P.column[static_cast<std::size_t>(k)])
        block += Eigen::Map<const Block>(T.block(own), A.height, 6);
    }
  }
  return P;
}

} // namespace supple
