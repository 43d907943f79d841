/// Solves with the tangents of a body in motion, one after the other, on few factorisations.
///
///     K at u ≈ Q K at u₀ Qᵀ, Q the nodes' rotations from u₀ to u     as strain is small beside
///     turns M = Q L Lᵀ Qᵀ, L the factor kept from u₀                       preconditions conjugate
///     gradients
///
/// A new factor where the iterations cost more than it; a matrix that is not positive definite is
/// found by negative curvature, or by the factor that then fails. Of small factors two are kept,
/// made far from each other, and the one made nearer to u serves: the next path that begins and
/// ends where this one did finds both ends.
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
  /// A preconditioner, and how it has served.
  struct Kept {
    std::unique_ptr<Preconditioner> made;
    std::vector<Eigen::Matrix3d> turned; // rotations where it was made
    Vector at;                           // u there
    Vector echo;                         // of a probe's noise, once there was one
    bool usable = false;                 // it was made, and that was ok
    bool worn = false;                   // a new one would have cost less
    bool anew = true;                    // it was made from nothing
    double rate = 0.0;                   // digits an iteration, when it was fresh
    double best_rate = 0.0;              // and when it had been made from nothing
    double spread = 0.0;                 // of the last matrix solved with, seen through it
  };

  FactorStatus renew();
  Kept& now() { return kept_[now_]; }
  const Kept& now() const { return kept_[now_]; }
  void choose();
  Vector echo();
  void make_room();
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
  std::vector<Kept> kept_{1};
  std::size_t now_ = 0;                       // the one that serves
  std::vector<Eigen::Matrix3d> turn_, since_; // rotations at hand, and from where that was made
  Vector at_;                                 // u of the matrix at hand
  bool fresh_ = false;                        // what serves was made of the matrix at hand
  Definite definite_ = Definite::Unknown;
  const Vector* values_ = nullptr;
};

} // namespace supple
