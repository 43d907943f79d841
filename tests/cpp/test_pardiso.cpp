/// MKL's Pardiso behind Factor, where the dynamic loader finds MKL; else only that it is refused.
#include "supple/pardiso.hpp"

#include <Eigen/Dense>
#include <Eigen/Eigenvalues>
#include <limits>

#include "check.hpp"
#include "fixtures.hpp"
#include "supple/error.hpp"
#include "supple/linear.hpp"

using namespace supple;
using Eigen::MatrixXd;
using fixtures::random_matrix;
using fixtures::Sparse;

namespace {

bool found() {
  for (const char* name : {"libmkl_rt.so.3", "libmkl_rt.so.2"})
    try {
      load_pardiso(name);
      return true;
    } catch (const NumericalError&) {
    }
  return false;
}

/// A band matrix with both signs on its diagonal, unless it is to be definite.
MatrixXd banded(Kind kind, unsigned seed) {
  constexpr Index size = 90, width = 9;
  MatrixXd a = random_matrix(size, size, seed);
  for (Index i = 0; i < size; ++i)
    for (Index j = 0; j < size; ++j)
      if (std::abs(i - j) > width) a(i, j) = 0.0;
  if (kind != Kind::Unsymmetric) a = MatrixXd(a + a.transpose());
  for (Index i = 0; i < size; ++i)
    a(i, i) = kind == Kind::QuasiDefinite && i % 3 == 0 ? -40.0 : 40.0;
  return a;
}

} // namespace

TEST(a_factor_by_a_library_that_is_not_there_is_refused) {
  CHECK(!pardiso_loaded());
  CHECK_THROWS(load_pardiso("no_such_library.so"), NumericalError);
  CHECK_THROWS(load_pardiso("libm.so.6"), NumericalError);
  CHECK_THROWS(Factor(Kind::Cholesky, Precision::Double, Library::Pardiso), StateError);
}

/// Each kind against Eigen's dense LU with complete pivoting.
TEST(solution_equals_dense_solution) {
  if (!found()) return;
  for (const Kind kind : {Kind::Cholesky, Kind::QuasiDefinite, Kind::Unsymmetric}) {
    const MatrixXd a = banded(kind, 1);
    const Sparse sparse(a, kind != Kind::Unsymmetric);
    Factor factor(kind, Precision::Double, Library::Pardiso);
    factor.analyse(sparse.pattern);
    CHECK(factor.factorise(sparse.values).ok());
    const Vector rhs = Vector::LinSpaced(a.rows(), -1.0, 1.5), expected = a.fullPivLu().solve(rhs);
    Vector x(a.rows());
    const SolveReport report = factor.solve(rhs, x);
    CHECK_BELOW((x - expected).norm(), 1e-12 * expected.norm());
    CHECK_BELOW(report.backward, 4 * std::numeric_limits<double>::epsilon());
    CHECK(!factor.fell_back() && factor.nonzeros() > 0);
    if (kind != Kind::QuasiDefinite) continue;
    const Vector eigen = a.selfadjointView<Eigen::Lower>().eigenvalues();
    CHECK(factor.inertia().negative == (eigen.array() < 0.0).count());
  }
}

/// An indefinite matrix fails as Cholesky, at one of its unknowns.
TEST(lost_definiteness_is_reported) {
  if (!found()) return;
  const Sparse sparse(banded(Kind::QuasiDefinite, 2), true);
  Factor factor(Kind::Cholesky, Precision::Double, Library::Pardiso);
  factor.analyse(sparse.pattern);
  const FactorStatus status = factor.factorise(sparse.values);
  CHECK(status.cause == FactorStatus::Cause::NotPositiveDefinite);
  CHECK(status.unknown >= 0 && status.unknown < factor.size());
}
