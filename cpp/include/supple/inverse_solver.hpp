/// Solves with the tangents of an inverse form, one after the other, on few factorisations.
///
///     A = K D, D = −F⁻¹ at the nodes       near to symmetric, and to the A of other rest shapes
///     L Lᵀ of (A + Aᵀ)/2 at one of them    at the loaded shape itself it is the direct tangent
///     GMRES on A preconditioned by it      5 iterations for 2 digits, 20 for 8, at 30 % strain
///
/// A new factor where the iterations cost more than it; LDLᵀ where it is not positive definite or
/// wants double precision, and LU of A where GMRES does not get there even so: it fails where LU
/// fails and nowhere else.
#pragma once

#include <memory>

#include "supple/linear.hpp"

namespace supple {

class Relabelling;

/// What an InverseSolver did since this was last cleared.
struct SolverWork {
  int symmetric = 0;                ///< factorisations of the symmetric part
  int lu = 0;                       ///< LU factorisations
  int iterations = 0;               ///< of GMRES
  double factor = 0.0, solve = 0.0; ///< seconds
};

class InverseSolver {
 public:
  /// @param pattern of the tangents; `reduction`, of storage Lower; `points` (3n) loaded, m. All
  /// outlive the solver.
  InverseSolver(const BlockPattern& pattern, const Reduction& reduction, const Vector& points);
  ~InverseSolver();

  /// Take the tangent's CSR values (kept by reference) at `u` (dofs), and factorise if need be.
  FactorStatus prepare(const Vector& tangent, const ConstVector& u);
  /// ‖rhs − K x‖₂ ≤ tolerance·‖rhs‖₂ on the free dofs, or as small as LU makes it; false where K
  /// is singular. Both (free).
  bool solve(const Vector& rhs, double tolerance, Vector& x);

  /// The factor that is kept, if it is L Lᵀ: a preconditioner for tangents near it; else nothing.
  std::shared_ptr<Factor> definite_factor() const;

  /// Let go of the factor that is kept, so that results do not depend on what was solved before.
  void forget();

  SolverWork work;

 private:
  FactorStatus factorise();
  FactorStatus factorise_lu();
  FactorStatus keep_symmetric(Factor& factor);
  FactorStatus keep(Factor& factor);
  bool iterate(const Vector& rhs, double tolerance, Vector& y);
  Vector moved(const Vector& y) const;
  int break_even() const;

  const BlockPattern& pattern_;
  const Reduction& reduction_;
  Mask free_;
  std::unique_ptr<Relabelling> relabelling_;
  std::vector<Index> mirror_;
  std::unique_ptr<Reduction> full_; // for LU, made when it is first needed
  std::shared_ptr<Factor> light_;   // L Lᵀ
  bool light_serves_;
  Factor exact_{Kind::QuasiDefinite}, lu_{Kind::Unsymmetric};
  Factor* kept_ = nullptr; // that preconditions
  bool fresh_ = false;     // it is of the tangent at hand
  bool worn_ = false;      // a new one would have cost less
  const Vector* tangent_ = nullptr;
  Vector scaled_, reduced_;
};

} // namespace supple
