/// GMRES with right preconditioning, and the forcing terms of an inexact Newton method.
///
///     gmres(A, M⁻¹, b, x, {tolerance, max_iterations}):   min ‖b − A M⁻¹ y‖₂ over the Krylov space
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

/// How exactly Newton's equation is to be solved, so that no more is spent than the step is worth.
///
/// η = 0.9 (‖R‖/‖R before‖)², at least 0.9 η before² where that is above 0.1, at most `loosest`,
/// and no less than half of what is left to do, tolerance/‖R‖.
/// Source: Eisenstat, Walker (1996), SIAM J. Sci. Comput. 17(1), choice 2 with γ = 0.9, α = 2.
class Forcing {
 public:
  explicit Forcing(double loosest = 1e-2) : loosest_(loosest) {}
  /// For the step from a residual of size `norm` that shall fall to `tolerance`.
  double next(double norm, double tolerance);

 private:
  double loosest_, before_ = -1.0, last_ = 0.0;
};

} // namespace supple
