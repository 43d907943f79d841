/// Our LLᵀ in double and in single precision against Eigen's dense factorisations.
#include <omp.h>

#include <Eigen/Dense>
#include <Eigen/Eigenvalues>
#include <limits>

#include "check.hpp"
#include "fixtures.hpp"
#include "linear_backend.hpp"
#include "strips.hpp"
#include "supernodal_tree.hpp"
#include "supple/linear.hpp"

using namespace supple;
using Cause = FactorStatus::Cause;
using Eigen::MatrixXd;
using fixtures::random_matrix;
using fixtures::Sparse;

namespace {

constexpr double kRounding = std::numeric_limits<double>::epsilon();

double epsilon(Precision precision) {
  return precision == Precision::Single ? std::numeric_limits<float>::epsilon() : kRounding;
}

/// Positive definite with a condition of about a hundred.
MatrixXd definite(Index size, unsigned seed) {
  const MatrixXd b = random_matrix(size, size, seed);
  return b * b.transpose() / size + 0.05 * MatrixXd::Identity(size, size);
}

/// Eigenvalues from 1 down to `least`, each as much smaller than the one before.
MatrixXd graded(Index size, double least, unsigned seed) {
  const MatrixXd q = random_matrix(size, size, seed).householderQr().householderQ();
  const double digits = std::log10(least);
  const Vector eigen =
      Vector::LinSpaced(size, 0.0, digits).unaryExpr([](double e) { return std::pow(10.0, e); });
  const MatrixXd a = q * eigen.asDiagonal() * q.transpose();
  return (a + a.transpose()) / 2;
}

/// A positive definite matrix of a mesh, with some dofs fixed.
struct Mesh {
  BlockPattern pattern;
  Reduction reduction;
  Vector values;

  Mesh(Index x, Index y, Index z, unsigned seed)
      : pattern(block_pattern(fixtures::box_nodes(x, y, z), {fixtures::box_tetrahedra(x, y, z)})) {
    reduction = reduce(pattern, fixtures::some_free(pattern.nodes), Storage::Lower);
    std::mt19937 random(seed);
    Vector full = fixtures::assemble(pattern, 0.0, random);
    for (Index a = 0; a < pattern.nodes; ++a)
      for (Index i = 0; i < 3; ++i)
        full[pattern.position(a, a) + i * (pattern.row_stride(a) + 1)] += 1.0;
    values.resize(reduction.pattern.nonzeros());
    reduction.gather(full, values);
    whole = full;
  }

  MatrixXd dense() const {
    return fixtures::restrict_dense(fixtures::dense(pattern, whole), reduction);
  }

 private:
  Vector whole;
};

void check_backend(const CscPattern& pattern, Vector values, const MatrixXd& dense) {
  const Vector rhs = Vector::LinSpaced(dense.rows(), -1.0, 1.5);
  const Eigen::LLT<MatrixXd> llt(dense);
  const Vector expected = llt.solve(rhs);
  for (const Precision precision : {Precision::Double, Precision::Single}) {
    const auto backend = make_cholesky(precision);
    backend->analyse(pattern);
    CHECK(backend->factorise(values.data()).ok());
    Vector x(rhs.size());
    backend->solve(rhs.data(), x.data());
    const double error = (x - expected).norm() / expected.norm();
    CHECK_BELOW(error, 8 * epsilon(precision) / llt.rcond());
  }
}

} // namespace

/// One front: sizes on both sides of strips, tiles, panels and the depth that stays in the cache.
TEST(dense_matrices_are_factorised) {
  for (const Index size : {1, 2, 3, 7, 8, 9, 15, 16, 17, 24, 33, 127, 128, 129, 300, 530}) {
    const MatrixXd a = definite(size, static_cast<unsigned>(size));
    const Sparse sparse(a, true);
    check_backend(sparse.pattern, sparse.values, a);
  }
}

/// Fronts of every shape, and updates that pass through many generations.
TEST(meshes_are_factorised) {
  for (const auto& [x, y, z] : {std::array<Index, 3>{1, 1, 1}, {4, 3, 2}, {12, 2, 2}, {7, 7, 6}}) {
    const Mesh mesh(x, y, z, 3);
    check_backend(mesh.reduction.pattern, mesh.values, mesh.dense());
  }
}

/// A block of unknowns over a dense root: an update that is deeper than the cache and taller than
/// a chunk.
TEST(a_tall_front_updates_its_parent) {
  constexpr Index leaf = 290, all = 2 * leaf + 260;
  MatrixXd a = definite(all, 4) + 4.0 * MatrixXd::Identity(all, all);
  a.block(leaf, 0, leaf, leaf).setZero();
  a.block(0, leaf, leaf, leaf).setZero();
  const Sparse sparse(a, true);
  check_backend(sparse.pattern, sparse.values, a);
}

/// It stops at the column whose leading minor is the first without a positive determinant, in
/// either precision and on any number of threads.
TEST(indefinite_matrices_are_refused_at_the_right_unknown) {
  const int before = omp_get_max_threads();
  const Mesh mesh(6, 5, 4, 5);
  const MatrixXd dense = mesh.dense();
  const Vector eigen = dense.selfadjointView<Eigen::Lower>().eigenvalues();
  for (const Eigen::Index negative : {1, 3, 40}) {
    const double shift = (eigen[negative - 1] + eigen[negative]) / 2;
    const auto size = dense.rows();
    const Sparse bad(dense - shift * MatrixXd::Identity(size, size), true);
    for (const int threads : {1, 2}) {
      omp_set_num_threads(threads);
      const auto backend = make_cholesky(Precision::Double);
      CscPattern pattern = bad.pattern;
      backend->analyse(pattern);
      Vector values = bad.values;
      const FactorStatus status = backend->factorise(values.data());
      CHECK(status.cause == Cause::NotPositiveDefinite);
      const std::vector<Index> order =
          make_tree(pattern, 1, strips::kernels<double>().lanes).tree.order;
      const auto found = std::find(order.begin(), order.end(), status.unknown) - order.begin();
      MatrixXd permuted(size, size);
      for (Eigen::Index i = 0; i < size; ++i)
        for (Eigen::Index j = 0; j < size; ++j)
          permuted(i, j) =
              dense(order[static_cast<std::size_t>(i)], order[static_cast<std::size_t>(j)]) -
              (i == j ? shift : 0.0);
      CHECK(permuted.topLeftCorner(found, found).llt().info() == Eigen::Success);
      const Vector part = permuted.topLeftCorner(found + 1, found + 1)
                              .selfadjointView<Eigen::Lower>()
                              .eigenvalues();
      CHECK(part[0] < 0.0 && (found == 0 || part[1] > 0.0));
    }
  }
  omp_set_num_threads(before);
}

/// The numbers of one thread, to the last bit, in factor and solution.
TEST(threads_do_not_change_the_answer) {
  const int before = omp_get_max_threads();
  Mesh mesh(13, 12, 12, 6);
  const Vector rhs = Vector::Ones(mesh.reduction.free());
  for (const Precision precision : {Precision::Double, Precision::Single}) {
    std::vector<Vector> answers;
    for (const int threads : {1, 2, 3}) {
      omp_set_num_threads(threads);
      const auto backend = make_cholesky(precision);
      backend->analyse(mesh.reduction.pattern);
      CHECK(backend->flops() > 1e8); // else there is nothing to share
      Vector x(rhs.size());
      for (int repeat = 0; repeat < 3; ++repeat) {
        CHECK(backend->factorise(mesh.values.data()).ok());
        backend->solve(rhs.data(), x.data());
        answers.push_back(x);
      }
    }
    for (const Vector& x : answers)
      CHECK(x == answers.front());
  }
  omp_set_num_threads(before);
}

/// Refinement makes of a rounded factor the answer of a double one, up to its condition.
TEST(single_precision_is_refined_to_double) {
  for (const double least : {1e-2, 1e-4, 1e-5}) {
    const MatrixXd a = graded(120, least, 7);
    const Sparse sparse(a, true);
    Factor factor(Kind::Cholesky, Precision::Single);
    factor.analyse(sparse.pattern);
    CHECK(factor.factorise(sparse.values).ok());
    const Vector rhs = Vector::LinSpaced(120, -1.0, 1.5), expected = a.llt().solve(rhs);
    Vector x(120);
    const SolveReport report = factor.solve(rhs, x);
    CHECK_BELOW(report.backward, 4 * kRounding);
    CHECK_BELOW((x - expected).norm(), 64 * kRounding / least * expected.norm());
    CHECK(!factor.fell_back() && report.steps > 0);
    const SolveReport loose = factor.solve(rhs, x, {1e-8, 10});
    CHECK_BELOW(loose.residual, 1e-8);
    CHECK_BELOW((rhs - a * x).norm(), 1.01e-8 * rhs.norm());
    CHECK(loose.steps < report.steps);
  }
}

/// Beyond the condition that a float can hold the factor in double precision decides.
TEST(single_precision_falls_back_where_it_fails) {
  const MatrixXd a = graded(80, 1e-11, 8);
  const Sparse bad(a, true);
  Factor factor(Kind::Cholesky, Precision::Single);
  factor.analyse(bad.pattern);
  const Vector rhs = Vector::LinSpaced(80, -1.0, 1.5);
  Vector x(80);
  for (int repeat = 0; repeat < 2; ++repeat) {
    CHECK(factor.factorise(bad.values).ok());
    CHECK_BELOW(factor.solve(rhs, x).backward, 16 * kRounding);
    CHECK(factor.fell_back());
    const Sparse good(graded(80, 1e-2, 9), true); // and the next matrix is tried in single again
    CHECK(factor.factorise(good.values).ok());
    CHECK_BELOW(factor.solve(rhs, x).backward, 16 * kRounding);
    CHECK(!factor.fell_back());
  }
  const Sparse indefinite(a - 1e-3 * MatrixXd::Identity(80, 80), true);
  CHECK(factor.factorise(indefinite.values).cause == Cause::NotPositiveDefinite);
}

/// Numbers far outside of a float's range are scaled into it.
TEST(single_precision_keeps_its_range) {
  const MatrixXd a = definite(50, 10);
  const Vector rhs = Vector::LinSpaced(50, -1.0, 1.5);
  for (const double scale : {1e-60, 1e60}) {
    const Sparse sparse(scale * a, true);
    Factor factor(Kind::Cholesky, Precision::Single);
    factor.analyse(sparse.pattern);
    CHECK(factor.factorise(sparse.values).ok());
    Vector x(50);
    CHECK_BELOW(factor.solve(1e-50 * rhs, x).backward, 4 * kRounding);
    CHECK(!factor.fell_back());
  }
}
