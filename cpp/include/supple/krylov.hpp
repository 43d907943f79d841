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
  int max_iterations = 50;  ///< without restart: twice so many vectors are kept
};

struct GmresReport {
  bool converged = false;
  int iterations = 0;    ///< applications of the preconditioner
  double residual = 0.0; ///< ‖b − Ax‖₂ / ‖b‖₂ as the recurrence has it
};

/// y = operator · x; both have the size of the system.
using Operator = std::function<void(const Vector& x, Vector& y)>;

/// Solve A x = b from the guess `x`; x is the best iterate also where it has not converged.
///
/// Gives up before `max_iterations` where the rate of the first ones shows that it would not get
/// there. What M⁻¹ made of each vector is kept, so that it may round as it likes, as a factor in
/// single precision does. Cost: one A and one M⁻¹ an iteration, 8kn operations in the k-th.
/// Source: Saad (2003), Iterative Methods for Sparse Linear Systems, algorithm 9.6 (FGMRES).
/// @throws ShapeError if x and b differ in size.
GmresReport gmres(const Operator& matrix, const Operator& preconditioner, const Vector& b,
                  Vector& x, const GmresSettings& settings);

/// What is known about the signs of a symmetric matrix's eigenvalues.
enum class Definite { Yes, No, Unknown };

struct CgSettings {
  double tolerance = 1e-10; ///< ‖b − Ax‖₂ ≤ tolerance·‖b‖₂
  int max_iterations = 50;
  bool probe = false;           ///< go on until it is known whether A is positive definite
  const Vector* echo = nullptr; ///< M⁻¹ probe_noise(n), where it is at hand: one M⁻¹ less to do
};

struct CgReport {
  bool converged = false;
  int iterations = 0;    ///< applications of the preconditioner
  double residual = 0.0; ///< ‖b − Ax‖₂ / ‖b‖₂ as the recurrence has it
  Definite definite = Definite::Unknown;
  double spread = 0.0; ///< smallest over largest Ritz value of M⁻¹A, 0 where too few are known
};

/// Entries ±1 in an order without order, the same each time: ν of a probe, but for its size.
Vector probe_noise(Eigen::Index size);

/// Iterations after which a probe should know that A is definite, if the smallest eigenvalue of
/// M⁻¹A is `spread` times the largest: by the bound on the fall of its residual (Saad, eq. 6.128),
/// or by its Ritz values.
int probe_iterations(double spread, double size);

/// Solve A x = b by conjugate gradients preconditioned with M; x is the last iterate also where it
/// has not converged.
///
/// Negative curvature, or a Ritz value of M⁻¹A that is not positive, proves A not to be positive
/// definite; the iteration goes on, as a Galerkin method, as long as it is defined. `probe` starts
/// it from M⁻¹ν, ν noise of a fixed seed that spares no eigenvector, and goes on until it knows:
///
///     A w = λ M w, λ ≤ 0, all Ritz values θ > 0:   |wᵀr| = |wᵀr₀| Π (1 − λ/θ) ≥ |wᵀr₀|
///     wᵀr₀ = wᵀb − λ wᵀν,  wᵀν of size ‖w‖₂|ν|:    P(|wᵀr₀| ≤ δ|λ||ν|‖w‖₂) ≤ 0.8 δ
///
/// so that ‖r‖₂ ≤ δ|λ||ν| leaves no λ below −0.01 of the largest θ but by a chance of 1e-4, and
/// one nearer to 0 by one in proportion. Where M is far from A, and r falls slowly, positive Ritz
/// values are believed after as many iterations as leave the same chance from a random start. A is
/// then called definite, and otherwise stays unknown.
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
