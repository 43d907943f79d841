#include "supple/krylov.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "check.hpp"
#include "fixtures.hpp"
#include "supple/error.hpp"

using namespace supple;

namespace {

/// Unsymmetric and well conditioned: the identity plus a random part of norm below 1.
Eigen::MatrixXd random_matrix(int n, double size, unsigned seed) {
  std::mt19937 random(seed);
  std::normal_distribution<double> normal;
  const Eigen::MatrixXd part =
      Eigen::MatrixXd::NullaryExpr(n, n, [&] { return normal(random) / std::sqrt(n); });
  return Eigen::MatrixXd::Identity(n, n) + size * part;
}

Operator product(const Eigen::MatrixXd& matrix) {
  return [&matrix](const Vector& x, Vector& y) { y = matrix * x; };
}

void identity(const Vector& x, Vector& y) {
  y = x;
}

} // namespace

/// Against Eigen's LU with complete pivoting, with and without a preconditioner.
TEST(gmres_solution_equals_dense_solution) {
  const Eigen::MatrixXd a = random_matrix(60, 0.3, 1), m = random_matrix(60, 0.2, 2).inverse();
  const Vector b = Vector::LinSpaced(60, -1.0, 2.0), expected = a.fullPivLu().solve(b);
  for (const bool preconditioned : {false, true}) {
    Vector x = Vector::Zero(60);
    const Operator other = preconditioned ? product(m) : Operator(identity);
    const GmresReport report = gmres(product(a), other, b, x, {1e-13, 60});
    CHECK(report.converged);
    CHECK_BELOW((x - expected).norm(), 1e-11 * expected.norm());
  }
}

/// The residual is the one of A x = b, not of the preconditioned system, whatever its scale.
TEST(reported_residual_is_that_of_the_system) {
  const Eigen::MatrixXd a = random_matrix(40, 0.5, 3);
  const Eigen::MatrixXd m = 1e-6 * random_matrix(40, 0.3, 4);
  const Vector b = Vector::LinSpaced(40, 1.0, 3.0);
  for (const double tolerance : {1e-1, 1e-3, 1e-6}) {
    Vector x = Vector::Zero(40);
    const GmresReport report = gmres(product(a), product(m), b, x, {tolerance, 40});
    CHECK_BELOW(report.residual, tolerance);
    CHECK_BELOW(std::abs((b - a * x).norm() / b.norm() - report.residual), 1e-12);
  }
}

/// Saad (2003), proposition 6.10: the inverse itself ends it in one iteration, and no
/// preconditioner in as many as there are distinct eigenvalues.
TEST(iterations_are_the_degree_of_the_minimal_polynomial) {
  const Eigen::MatrixXd a = random_matrix(30, 0.4, 5), inverse = a.inverse();
  const Vector b = Vector::Ones(30);
  Vector x = Vector::Zero(30);
  CHECK(gmres(product(a), product(inverse), b, x, {1e-10, 30}).iterations == 1);
  Vector three(30);
  for (int i = 0; i < 30; ++i)
    three[i] = 1.0 + i % 3;
  const Eigen::MatrixXd diagonal = three.asDiagonal();
  x.setZero();
  CHECK(gmres(product(diagonal), identity, b, x, {1e-10, 30}).iterations == 3);
}

TEST(a_good_guess_leaves_less_to_do) {
  const Eigen::MatrixXd a = random_matrix(50, 0.4, 6);
  const Vector b = Vector::Ones(50);
  Vector x = Vector::Zero(50), half = x;
  const GmresReport whole = gmres(product(a), identity, b, x, {1e-10, 50});
  gmres(product(a), identity, b, half, {1e-5, 50});
  const GmresReport rest = gmres(product(a), identity, b, half, {1e-10, 50});
  CHECK(rest.converged && rest.iterations < whole.iterations);
  CHECK(gmres(product(a), identity, b, half, {1e-9, 50}).iterations == 0);
  CHECK_BELOW((half - x).norm(), 1e-8 * x.norm());
}

/// The cyclic shift: no iteration but the last lowers the residual (Saad 2003, example 6.2).
TEST(stagnation_is_noticed_long_before_the_limit) {
  const int n = 200;
  const Operator shift = [](const Vector& x, Vector& y) {
    y.resize(x.size());
    for (Eigen::Index i = 0; i < x.size(); ++i)
      y[(i + 1) % x.size()] = x[i];
  };
  Vector x = Vector::Zero(n);
  const GmresReport report = gmres(shift, identity, Vector::Unit(n, 0), x, {1e-8, n});
  CHECK(!report.converged && report.iterations < 20);
  CHECK_BELOW(std::abs(report.residual - 1.0), 1e-12);
}

TEST(singular_matrix_and_no_numbers_do_not_converge) {
  Eigen::MatrixXd a = Eigen::MatrixXd::Identity(10, 10);
  a(9, 9) = 0.0;
  Vector x = Vector::Zero(10);
  CHECK(!gmres(product(a), identity, Vector::Ones(10), x, {1e-8, 10}).converged);
  CHECK(x.allFinite());
  a(0, 0) = std::nan("");
  CHECK(!gmres(product(a), identity, Vector::Ones(10), x, {1e-8, 10}).converged);
}

TEST(zero_right_hand_side_gives_zero) {
  const Eigen::MatrixXd a = random_matrix(5, 0.1, 7);
  Vector x = Vector::Ones(5);
  CHECK(gmres(product(a), identity, Vector::Zero(5), x, {}).converged && x.isZero(0.0));
  CHECK_THROWS(gmres(product(a), identity, Vector::Ones(4), x, {}), ShapeError);
}

/// A quadratic Newton sequence keeps its order: η falls as the square of the residual's ratio.
TEST(forcing_follows_quadratic_convergence) {
  Forcing forcing(1e-2);
  const double first = forcing.next(1.0, 1e-12), second = forcing.next(1e-2, 1e-12);
  CHECK(first == 1e-2);
  CHECK_BELOW(std::abs(second - 0.9e-4), 1e-12);
  const double third = forcing.next(1e-6, 1e-12); // no more than what is left to do
  CHECK_BELOW(std::abs(third - 0.5e-6), 1e-12);
}

TEST(forcing_is_never_looser_than_its_limit) {
  Forcing forcing(1e-3);
  for (const double norm : {1.0, 50.0, 2e4, 1e4, 1e-9}) {
    const double eta = forcing.next(norm, 1e-8);
    CHECK(eta > 0.0 && eta <= 1e-3);
  }
}

/// Against Eigen's Cholesky, with and without a preconditioner.
TEST(conjugate_gradients_solution_equals_dense_solution) {
  const Eigen::MatrixXd b = random_matrix(50, 0.4, 5), c = random_matrix(50, 0.2, 6);
  const Eigen::MatrixXd a = b * b.transpose(), m = c * c.transpose();
  const Vector rhs = Vector::LinSpaced(50, -1.0, 2.0), expected = a.llt().solve(rhs);
  for (const bool preconditioned : {false, true}) {
    Vector x = Vector::Zero(50);
    const Operator other = preconditioned ? product(m) : Operator(identity);
    const CgReport report = conjugate_gradients(product(a), other, rhs, x, {1e-12, 80});
    CHECK(report.converged);
    CHECK(report.definite != Definite::No);
    CHECK_BELOW((x - expected).norm(), 1e-10 * expected.norm());
  }
}

/// A diagonal matrix with one negative entry where the right-hand side has none: the solve does not
/// see it and a probe does. Without that entry a probe knows that the matrix is definite.
TEST(probe_finds_the_negative_eigenvalue_that_the_right_hand_side_spares) {
  Vector diagonal = Vector::LinSpaced(400, 0.5, 2.0), rhs = Vector::Ones(400);
  rhs[7] = 0.0;
  for (const double entry : {-0.01, 0.7}) {
    diagonal[7] = entry;
    const Operator matrix = [&](const Vector& x, Vector& y) { y = diagonal.cwiseProduct(x); };
    Vector x = Vector::Zero(400);
    const CgReport blind = conjugate_gradients(matrix, identity, rhs, x, {1e-10, 100});
    CHECK(blind.converged && blind.definite == Definite::Unknown);
    x.setZero();
    const CgReport probe = conjugate_gradients(matrix, identity, rhs, x, {1e-10, 100, true});
    CHECK(probe.converged);
    CHECK(probe.definite == (entry < 0.0 ? Definite::No : Definite::Yes));
    CHECK_BELOW((diagonal.cwiseProduct(x) - rhs).norm(), 1e-9 * rhs.norm());
  }
}

/// Reflected diagonal matrices, whose eigenvectors have a part in every unknown: one eigenvalue is
/// made −0.02 in turn, 0.01 of the largest below 0, and b has nothing of its eigenvector.
TEST(probe_calls_no_matrix_definite_that_has_an_eigenvalue_below_zero) {
  const Eigen::Index n = 300;
  const Vector normal = Vector::LinSpaced(n, -1.0, 2.0).normalized();
  const auto reflect = [&](const Vector& x) { return Vector(x - 2.0 * normal.dot(x) * normal); };
  Vector diagonal = Vector::LinSpaced(n, 1.6, 2.0);
  int longest = 0;
  for (Eigen::Index i = 0; i < n; i += 3) {
    for (const double entry : {-0.02, 1.7}) {
      const double kept = std::exchange(diagonal[i], entry);
      Vector part = Vector::Ones(n);
      part[i] = 0.0;
      const Vector rhs = reflect(part), echo = probe_noise(n);
      const Operator matrix = [&](const Vector& x, Vector& y) {
        y = reflect(diagonal.cwiseProduct(reflect(x)));
      };
      Vector x = Vector::Zero(n);
      const CgReport probe =
          conjugate_gradients(matrix, identity, rhs, x, {1e-6, 100, true, &echo});
      CHECK(probe.converged && probe.definite == (entry < 0.0 ? Definite::No : Definite::Yes));
      CHECK_BELOW((reflect(diagonal.cwiseProduct(reflect(x))) - rhs).norm(), 2e-6 * rhs.norm());
      if (entry > 0.0) longest = std::max(longest, probe.iterations);
      diagonal[i] = kept;
    }
  }
  CHECK(longest <= probe_iterations(1.6 / 2.0, static_cast<double>(n)));
}
