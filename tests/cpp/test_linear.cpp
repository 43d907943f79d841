#include "supple/linear.hpp"

#include <algorithm>
#include <Eigen/SparseCholesky>
#include <limits>

#include "check.hpp"
#include "fixtures.hpp"
#include "supple/error.hpp"

using namespace supple;
using Cause = FactorStatus::Cause;

namespace {

/// A random block matrix on a box, reduced, with its dense twin.
struct Problem {
  BlockPattern pattern =
      block_pattern(fixtures::box_nodes(4, 3, 2), {fixtures::box_tetrahedra(4, 3, 2)});
  Reduction reduction;
  Vector values;
  Eigen::MatrixXd dense;

  Problem(Kind kind, unsigned seed, double shift) {
    reduction = reduce(pattern, fixtures::some_free(pattern.nodes), storage(kind));
    std::mt19937 random(seed);
    set(fixtures::assemble(pattern, kind == Kind::Unsymmetric ? 3.0 : 0.0, random), shift);
  }

  /// Values minus `shift` on the diagonal: beyond the lowest eigenvalue the matrix is indefinite.
  void set(Vector full, double shift) {
    for (Index a = 0; a < pattern.nodes; ++a)
      for (Index i = 0; i < 3; ++i)
        full[pattern.position(a, a) + i * (pattern.row_stride(a) + 1)] -= shift;
    values.resize(reduction.pattern.nonzeros());
    reduction.gather(full, values);
    dense = fixtures::restrict_dense(fixtures::dense(pattern, full), reduction);
  }

  Factor analysed(Kind kind) const {
    Factor factor(kind);
    factor.analyse(reduction.pattern);
    return factor;
  }
};

double median_eigenvalue(const Eigen::MatrixXd& matrix) {
  const Vector values = matrix.selfadjointView<Eigen::Lower>().eigenvalues();
  return (values[values.size() / 2] + values[values.size() / 2 + 1]) / 2;
}

void check_solve(Factor& factor, const Eigen::MatrixXd& dense) {
  const Vector rhs = Vector::LinSpaced(dense.rows(), -1.0, 1.5);
  Vector x(rhs.size());
  const SolveReport report = factor.solve(rhs, x);
  const Vector expected = dense.fullPivLu().solve(rhs);
  CHECK_BELOW((x - expected).norm(), 1e-9 * expected.norm());
  CHECK_BELOW(report.backward, 4 * std::numeric_limits<double>::epsilon());
  CHECK_BELOW(std::abs((rhs - dense * x).norm() / rhs.norm() - report.residual), 1e-12);
}

} // namespace

/// Each kind against Eigen's dense LU with complete pivoting, to rounding.
TEST(solution_equals_dense_solution) {
  for (const Kind kind : {Kind::Cholesky, Kind::QuasiDefinite, Kind::Unsymmetric}) {
    const Problem problem(kind, 5, 0.0);
    Factor factor = problem.analysed(kind);
    CHECK(factor.factorise(problem.values).ok());
    check_solve(factor, problem.dense);
    CHECK(factor.size() == problem.dense.rows() && factor.nonzeros() > 0 && factor.flops() > 0);
  }
}

TEST(indefinite_solution_equals_dense_solution) {
  const double shift = median_eigenvalue(Problem(Kind::QuasiDefinite, 6, 0.0).dense);
  const Problem problem(Kind::QuasiDefinite, 6, shift);
  Factor factor = problem.analysed(Kind::QuasiDefinite);
  CHECK(factor.factorise(problem.values).ok());
  check_solve(factor, problem.dense);
}

/// Sylvester: the signs of the pivots are the signs of the eigenvalues.
TEST(inertia_counts_the_eigenvalues_signs) {
  const Vector eigen =
      Problem(Kind::QuasiDefinite, 7, 0.0).dense.selfadjointView<Eigen::Lower>().eigenvalues();
  for (const Eigen::Index below : {0, 1, 2, 20, 60}) {
    const double shift = below == 0 ? 0.0 : (eigen[below - 1] + eigen[below]) / 2;
    const Problem problem(Kind::QuasiDefinite, 7, shift);
    Factor factor = problem.analysed(Kind::QuasiDefinite);
    CHECK(factor.factorise(problem.values).ok());
    const Inertia inertia = factor.inertia();
    CHECK(inertia.negative == below && inertia.zero == 0 &&
          inertia.positive == eigen.size() - below);
    CHECK_BELOW(inertia.growth, 1e8);
    CHECK(inertia.growth >= 1.0 - 1e-12);
  }
}

/// One analysis serves many values, as long as the pattern stays.
TEST(analysis_is_reused) {
  for (const Kind kind : {Kind::Cholesky, Kind::QuasiDefinite, Kind::Unsymmetric}) {
    Problem problem(kind, 8, 0.0);
    Factor factor = problem.analysed(kind);
    std::mt19937 random(9);
    for (int repeat = 0; repeat < 4; ++repeat) {
      problem.set(
          fixtures::assemble(problem.pattern, kind == Kind::Unsymmetric ? 3.0 : 0.0, random), 0.0);
      CHECK(factor.factorise(problem.values).ok());
      check_solve(factor, problem.dense);
    }
    const Problem other(kind, 10, 0.0); // and a new analysis replaces the old one
    factor.analyse(other.reduction.pattern);
    CHECK(factor.factorise(other.values).ok());
    check_solve(factor, other.dense);
  }
}

/// An indefinite matrix fails at one of its unknowns, and the factor serves the next matrix again.
TEST(lost_definiteness_is_reported_and_survived) {
  const Problem good(Kind::Cholesky, 11, 0.0);
  const Problem bad(Kind::Cholesky, 11, median_eigenvalue(good.dense));
  Factor factor = good.analysed(Kind::Cholesky);
  const FactorStatus status = factor.factorise(bad.values);
  CHECK(status.cause == Cause::NotPositiveDefinite);
  CHECK(status.unknown >= 0 && status.unknown < factor.size());
  Vector x(factor.size());
  CHECK_THROWS(factor.solve(x, x), StateError);
  CHECK(factor.factorise(good.values).ok());
  check_solve(factor, good.dense);
}

/// A zero diagonal entry that nothing fills is where each kind must stop.
TEST(singular_unknown_is_named) {
  const BlockPattern pattern = block_pattern(4, {Connectivity(0, 4)});
  for (const Kind kind : {Kind::Cholesky, Kind::QuasiDefinite, Kind::Unsymmetric}) {
    const Reduction reduction = reduce(pattern, Mask::Constant(12, true), storage(kind));
    Vector full = Vector::Zero(pattern.nonzeros());
    for (Index a = 0; a < 4; ++a)
      for (Index i = 0; i < 3; ++i)
        full[pattern.position(a, a) + 4 * i] = 3 * a + i == 7 ? 0.0 : 2.0;
    Vector values(reduction.pattern.nonzeros());
    reduction.gather(full, values);
    Factor factor(kind);
    factor.analyse(reduction.pattern);
    const FactorStatus status = factor.factorise(values);
    CHECK(status.cause == (kind == Kind::Cholesky ? Cause::NotPositiveDefinite : Cause::Singular));
    CHECK(status.unknown == 7);
  }
}

TEST(values_that_are_no_numbers_are_reported) {
  for (const Kind kind : {Kind::Cholesky, Kind::QuasiDefinite, Kind::Unsymmetric}) {
    Problem problem(kind, 12, 0.0);
    Factor factor = problem.analysed(kind);
    for (const double wrong :
         {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()}) {
      Vector values = problem.values;
      values[values.size() / 2] = wrong;
      CHECK(factor.factorise(values).cause == Cause::NotFinite);
    }
    CHECK(factor.factorise(problem.values).ok());
  }
}

/// A loose tolerance is met with fewer steps than rounding, and a zero right-hand side gives zero.
TEST(refinement_stops_at_its_tolerance) {
  const Problem problem(Kind::Cholesky, 13, 0.0);
  Factor factor = problem.analysed(Kind::Cholesky);
  CHECK(factor.factorise(problem.values).ok());
  Vector x(factor.size());
  const SolveReport loose = factor.solve(Vector::Ones(factor.size()), x, {1e-6, 10});
  CHECK_BELOW(loose.residual, 1e-6);
  CHECK(loose.steps == 0);
  const SolveReport nothing = factor.solve(Vector::Zero(factor.size()), x);
  CHECK(nothing.residual == 0.0 && nothing.steps == 0 && x.isZero(0.0));
}

TEST(rhs_may_be_the_solution) {
  const Problem problem(Kind::Cholesky, 14, 0.0);
  Factor factor = problem.analysed(Kind::Cholesky);
  CHECK(factor.factorise(problem.values).ok());
  Vector x(factor.size()), both = Vector::Ones(factor.size());
  factor.solve(both, x);
  factor.solve(both, both);
  CHECK(both == x);
}

/// The factor is no fuller than the one that Eigen's own AMD finds on the dofs.
TEST(ordering_nodes_is_as_good_as_ordering_dofs) {
  const BlockPattern pattern =
      block_pattern(fixtures::box_nodes(20, 5, 5), {fixtures::box_tetrahedra(20, 5, 5)});
  const CscPattern csc =
      reduce(pattern, fixtures::some_free(pattern.nodes), Storage::Lower).pattern;
  std::vector<Eigen::Triplet<double>> entries;
  for (int c = 0; c < csc.size; ++c)
    for (auto k = csc.start[static_cast<std::size_t>(c)];
         k < csc.start[static_cast<std::size_t>(c) + 1]; ++k) {
      const auto r = static_cast<int>(csc.row[static_cast<std::size_t>(k)]);
      entries.emplace_back(r, c, r == c ? 1e3 : 1.0);
    }
  Eigen::SparseMatrix<double> matrix(csc.size, csc.size);
  matrix.setFromTriplets(entries.begin(), entries.end());
  const Eigen::SimplicialLLT<Eigen::SparseMatrix<double>, Eigen::Lower, Eigen::AMDOrdering<int>>
      eigen(matrix);
  for (const Kind kind : {Kind::Cholesky, Kind::QuasiDefinite}) {
    Factor factor(kind);
    factor.analyse(csc);
    CHECK_BELOW(factor.nonzeros(),
                1.05 * static_cast<double>(eigen.matrixL().nestedExpression().nonZeros()));
  }
}

TEST(no_unknowns_are_no_special_case) {
  const BlockPattern pattern = block_pattern(2, {});
  for (const Kind kind : {Kind::Cholesky, Kind::QuasiDefinite, Kind::Unsymmetric}) {
    Factor factor(kind);
    factor.analyse(reduce(pattern, Mask::Constant(6, false), storage(kind)).pattern);
    CHECK(factor.factorise(Vector(0)).ok());
    Vector x(0);
    CHECK(factor.solve(Vector(0), x).steps == 0);
  }
}

TEST(calls_out_of_order_are_refused) {
  const Problem problem(Kind::Cholesky, 15, 0.0);
  Factor factor(Kind::Cholesky);
  CHECK_THROWS(factor.factorise(problem.values), StateError);
  CHECK_THROWS(Factor(Kind::Unsymmetric).analyse(problem.reduction.pattern), ShapeError);
  factor.analyse(problem.reduction.pattern);
  CHECK_THROWS(factor.factorise(Vector::Ones(3)), ShapeError);
  CHECK(factor.factorise(problem.values).ok());
  CHECK_THROWS(factor.inertia(), StateError);
  Vector x(factor.size());
  CHECK_THROWS(factor.solve(Vector::Ones(3), x), ShapeError);
  Factor moved = std::move(factor);
  moved.solve(Vector::Ones(moved.size()), x);
}
