/// Solves with the tangents of a body in motion, one after the other, on few factorisations.
///
///     K at u ≈ Q K at u₀ Qᵀ, Q the nodes' rotations from u₀ to u     as strain is small beside
///     turns M = Q L Lᵀ Qᵀ, L the factor kept from u₀                       preconditions conjugate
///     gradients
///
/// A new factor where the iterations cost more than it; a matrix that is not positive definite is
/// found by negative curvature, or by the factor that then fails.
/// Source of the rotations: Müller, Gross (2004), Interactive virtual materials, §2 (there of
/// cells).
#pragma once

#include <Eigen/Core>
#include <memory>
#include <vector>

#include "supple/krylov.hpp"
#include "supple/preconditioner.hpp"

namespace supple {

class NodeRotations;
class SymmetricProduct;

/// What a SymmetricSolver did since this was last cleared.
struct SymmetricWork {
  int factorisations = 0, iterations = 0;
  double factor = 0.0, solve = 0.0; ///< seconds
};

class SymmetricSolver {
 public:
  /// @param pattern of the reduced tangents, storage Lower; it and `rotations` outlive the solver.
  /// @param make the kind of preconditioner, one of which is made here for each that is kept.
  SymmetricSolver(const CscPattern& pattern, const NodeRotations& rotations,
                  MakePreconditioner make);
  ~SymmetricSolver();

  /// Take the reduced tangent's values (kept by reference) at `u` (dofs); a preconditioner is made
  /// if none is kept that serves.
  FactorStatus prepare(const Vector& values, const ConstVector& u);
  /// ‖rhs − K x‖₂ ≤ tolerance·‖rhs‖₂ on the free dofs, or as small as it gets with M made of K
  /// itself; both (free). A status that is not ok is that of M where it had to be made anew.
  /// @param probe find out, too, whether K is positive definite: see definite().
  FactorStatus solve(const Vector& rhs, double tolerance, bool probe, Vector& x);

  /// Take the values as `prepare` does, make a preconditioner of them in any case, and find out
  /// whether they are positive definite; NotPositiveDefinite where they are not.
  FactorStatus prove(const Vector& values, const ConstVector& u);

  /// What is known of the matrix at hand.
  Definite definite() const { return definite_; }
  /// Find out whether it is definite, where that is unknown; it may stay so.
  void find_definite();

  /// Let go of what is kept, so that results do not depend on what was solved before.
  void forget();

  SymmetricWork work;

 private:
  FactorStatus renew();
  void take(const Vector& values, const ConstVector& u);
  int excess(const CgReport& report) const;
  void rate(const CgReport& report);
  void set_turn();
  bool cheap_to_probe(double size) const;
  CgReport iterate(const Vector& rhs, double tolerance, bool probe, Vector& x);

  const CscPattern& pattern_;
  const NodeRotations& rotations_;
  std::unique_ptr<SymmetricProduct> product_;
  MakePreconditioner make_;
  std::unique_ptr<Preconditioner> kept_;
  std::vector<Eigen::Matrix3d> turned_, turn_, since_; // rotations where it was made, now, between
  bool usable_ = false;                                // it was made, and that was ok
  bool fresh_ = false;                                 // of the matrix at hand
  bool worn_ = false;                                  // a new one would have cost less
  bool anew_ = true;                                   // it was made from nothing
  double rate_ = 0.0;                                  // digits an iteration, when it was fresh
  double best_rate_ = 0.0;                             // and when it had been made from nothing
  double spread_ = 0.0; // of the last matrix solved with, seen through what is kept
  Definite definite_ = Definite::Unknown;
  const Vector* values_ = nullptr;
};

} // namespace supple
