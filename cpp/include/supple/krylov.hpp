/// GMRES, conjugate gradients, and the forcing terms of an inexact Newton method.
///
///     gmres(A, M⁻¹, b, x, {tolerance, max_iterations}):   min ‖b − A M⁻¹ y‖₂ over the Krylov space
///     conjugate_gradients(A, M⁻¹, b, x, …):               A symmetric, M positive definite
///
/// Right preconditioning keeps the residual that Newton's method asks for the one that is measured.
#pragma once

#include <functional>

#include "supple/sparse.hpp"

namespace supple {

struct GmresSettings {
  double tolerance = 1e-10; ///< ‖b − Ax‖₂ ≤ tolerance·‖b‖₂
  int max_iterations = 50;  ///< without restart: so many vectors are kept
};

struct GmresReport {
  bool converged = false;
  int iterations = 0;    ///< applications of the preconditioner, but for the last
  double residual = 0.0; ///< ‖b − Ax‖₂ / ‖b‖₂ as the recurrence has it
};

/// y = operator · x; both have the size of the system.
using Operator = std::function<void(const Vector& x, Vector& y)>;

/// Solve A x = b from the guess `x`; x is the best iterate also where it has not converged.
///
/// Gives up before `max_iterations` where the rate of the first ones shows that it would not get
/// there. Cost: one A and one M⁻¹ an iteration, 4kn operations in the k-th.
/// Source: Saad (2003), Iterative Methods for Sparse Linear Systems, algorithm 9.5.
/// @throws ShapeError if x and b differ in size.
GmresReport gmres(const Operator& matrix, const Operator& preconditioner, const Vector& b,
                  Vector& x, const GmresSettings& settings);

/// What is known about the signs of a symmetric matrix's eigenvalues.
enum class Definite { Yes, No, Unknown };

struct CgSettings {
  double tolerance = 1e-10; ///< ‖b − Ax‖₂ ≤ tolerance·‖b‖₂
  int max_iterations = 50;
  bool probe = false; ///< go on until it is known whether A is positive definite
};

struct CgReport {
  bool converged = false;
  int iterations = 0;    ///< applications of the preconditioner
  double residual = 0.0; ///< ‖b − Ax‖₂ / ‖b‖₂ as the recurrence has it
  Definite definite = Definite::Unknown;
  double spread = 0.0; ///< smallest over largest Ritz value of M⁻¹A, 0 where too few are known
};

/// Iterations of a probe after which A is known to be definite, if these are its extreme values.
///
/// The fewer of two bounds, each for a chance of 5e-5 (Kuczyński, Woźniakowski): that a value below
/// 0 goes unseen beside the largest of M⁻¹A (theorem 4.2); and that M⁻¹A − cI, c in the middle of
/// the values seen, has one of size c unseen where none seen is larger than (1−s)/(1+s)·c, s their
/// spread (theorem 4.1, of the power method with (M⁻¹A − cI)², which Lanczos' is no worse than).
int probe_iterations(double spread, double size);

/// Solve A x = b by conjugate gradients preconditioned with M; x is the last iterate also where it
/// has not converged.
///
/// Negative curvature, or a Ritz value of M⁻¹A that is not positive, proves A not to be positive
/// definite; the iteration goes on, as a Galerkin method, as long as it is defined. `probe` starts
/// it from noise, of a fixed seed, that spares no eigenvector: A is then called definite when the
/// chance that an eigenvalue below 0 was missed is at most 1e-4, and otherwise stays unknown.
/// Cost: one A and one M⁻¹ an iteration, 10 n operations; a probe one more of each.
/// Sources: Saad (2003), Iterative Methods for Sparse Linear Systems, algorithm 9.1 and §6.7.3;
/// Kuczyński, Woźniakowski (1992), SIAM J. Matrix Anal. Appl. 13(4), theorem 4.2.
/// @throws ShapeError if x and b differ in size.
CgReport conjugate_gradients(const Operator& matrix, const Operator& preconditioner,
                             const Vector& b, Vector& x, const CgSettings& settings);

/// How exactly Newton's equation is to be solved, so that no more is spent than the step is worth.
///
/// η = 0.9 (‖R‖/‖R before‖)^α, at least 0.9 (η before)^α where that is above 0.1, at most
/// `loosest`, and no less than half of what is left to do, tolerance/‖R‖.
/// Source: Eisenstat, Walker (1996), SIAM J. Sci. Comput. 17(1), choice 2 with γ = 0.9.
class Forcing {
 public:
  explicit Forcing(double loosest = 0.03, double alpha = 2.0) : loosest_(loosest), alpha_(alpha) {}
  /// For the step from a residual of size `norm` that shall fall to `tolerance`.
  double next(double norm, double tolerance);

 private:
  double loosest_, alpha_, before_ = -1.0, last_ = 0.0;
};

} // namespace supple
