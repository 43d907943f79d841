/// The dense kernels of a front against the products that they undo.
#include <Eigen/Dense>

#include "check.hpp"
#include "fixtures.hpp"
#include "supernodal_dense.hpp"

using namespace supple;
using Eigen::MatrixXd;
using fixtures::random_matrix;

namespace {

dense::Block block(MatrixXd& matrix) {
  return {matrix.data(), static_cast<Index>(matrix.rows())};
}

/// Symmetric, as dominated by its diagonal as is safe without pivoting, of both signs.
MatrixXd quasi_definite(Index size, unsigned seed) {
  const MatrixXd b = random_matrix(size, size, seed);
  MatrixXd a = (b + b.transpose()) / 4;
  for (Index i = 0; i < size; ++i)
    a(i, i) += (i % 3 == 0 ? -1.0 : 1.0) * size;
  return a;
}

} // namespace

/// L D Lᵀ gives A back, for sizes on both sides of every recursion.
TEST(dense_ldlt_reproduces_its_matrix) {
  for (const Index size : {1, 2, 7, 16, 17, 33, 48, 49, 100, 130}) {
    const MatrixXd a = quasi_definite(size, 1);
    MatrixXd f = a;
    std::vector<double> work(static_cast<std::size_t>(size * size / 4 + 1));
    const Vector scale = a.cwiseAbs().colwise().maxCoeff();
    dense::PivotGuard guard{scale.data()};
    dense::factor_ldlt(block(f), size, work.data(), guard);
    const MatrixXd l = f.triangularView<Eigen::UnitLower>();
    CHECK_BELOW((l * f.diagonal().asDiagonal() * l.transpose() - a).norm(), 1e-13 * a.norm());
    CHECK(guard.raised == 0);
  }
}

/// P A = L U with multipliers of at most one: rows are chosen.
TEST(dense_lu_reproduces_its_matrix) {
  for (const Index size : {1, 2, 7, 8, 9, 16, 33, 70}) {
    const MatrixXd a = random_matrix(size, size, 2);
    MatrixXd f = a, permuted = a;
    std::vector<Index> pivot(static_cast<std::size_t>(size));
    const Vector scale = a.cwiseAbs().colwise().maxCoeff();
    dense::PivotGuard guard{scale.data()};
    dense::factor_lu(block(f), size, pivot.data(), guard);
    for (Index j = 0; j < size; ++j)
      permuted.row(j).swap(permuted.row(pivot[static_cast<std::size_t>(j)]));
    const MatrixXd l = f.triangularView<Eigen::UnitLower>(), u = f.triangularView<Eigen::Upper>();
    CHECK_BELOW((l * u - permuted).norm(), 1e-13 * a.norm());
    CHECK(l.cwiseAbs().maxCoeff() <= 1.0);
  }
}

TEST(dense_divisions_undo_products) {
  for (const Index size : {1, 5, 16, 17, 40, 70})
    for (const Index rows : {1, 7, 8, 31, 32, 45}) {
      MatrixXd t = random_matrix(size, size, 3) / size + MatrixXd::Identity(size, size) * 2;
      const MatrixXd x = random_matrix(rows, size, 4);
      MatrixXd b = x * t.triangularView<Eigen::Upper>();
      dense::divide_by_upper(block(b), rows, block(t), size);
      CHECK_BELOW((b - x).norm(), 1e-13 * x.norm());
      const MatrixXd l = t.triangularView<Eigen::UnitLower>();
      b = x * l.transpose();
      dense::divide_by_lower(block(b), rows, block(t), size);
      CHECK_BELOW((b - x).norm(), 1e-13 * x.norm());
    }
}

TEST(dense_update_of_a_lower_triangle_equals_the_product) {
  for (const Index size : {1, 48, 49, 150}) {
    const MatrixXd a = random_matrix(size, 20, 5), b = random_matrix(size, 20, 6);
    MatrixXd c = random_matrix(size, size, 7);
    const MatrixXd expected = c - a * b.transpose();
    MatrixXd a2 = a, b2 = b;
    dense::subtract_lower(block(c), size, block(a2), block(b2), 20, 1.0);
    const MatrixXd difference = (c - expected).triangularView<Eigen::Lower>();
    CHECK_BELOW(difference.norm(), 1e-13 * expected.norm());
  }
}
