/// R(u, s) = 0: a system under a share s of its load, and the record of what was tried on it.
///
/// From zero s scales the loads and the prescribed displacements; from another start u0 the loads
/// stay whole and R(u) − (1 − s) R(u0) = 0 is meant (see newton.hpp).
#pragma once

#include "supple/newton.hpp"

namespace supple {

class Problem {
 public:
  /// @throws ShapeError unless `start` and `prescribed` have one entry for each dof.
  Problem(System& system, const Vector& start, const Vector& prescribed,
          const NewtonSettings& settings, const Progress& progress);

  Vector residual(const Vector& u, double s) const;
  double energy(const Vector& u, double s) const;
  /// −∂R/∂s (dofs), N.
  Vector pull(const Vector& u) const;
  /// du/ds of the fixed dofs, 0 at the others (dofs), m.
  const Vector& travel() const { return travel_; }
  /// What is missing at the fixed dofs from their values at `s` (dofs), m.
  Vector missing(const Vector& u, double s) const;

  double free_norm(const Vector& r) const;
  /// Of forces at `u`, N: max(‖external force‖, ‖reactions‖).
  double scale(const Vector& u, const Vector& r, double s) const;
  double tolerance(const Vector& u, const Vector& r, double s) const;

  /// Volume ratios are positive, where the laws ask for it, and the energy is finite.
  bool admissible(const Vector& u, double s);
  void assemble_tangent(const Vector& u, double s) { system.assemble_tangent(u, loads(s)); }
  void record(const Iteration& iteration);
  /// Converged where nobody judges.
  Outcome judge(const Vector& u, double s) const {
    return settings.judge ? settings.judge(u, s) : Outcome::Converged;
  }

  System& system;
  const NewtonSettings& settings;
  const bool has_energy;
  const bool minimises; ///< an equilibrium is a minimum of the energy, not a saddle
  NewtonResult result;

 private:
  double loads(double s) const { return settings.warm ? 1.0 : s; }
  double held_back(double s) const { return settings.warm ? 1.0 - s : 0.0; }

  const Progress& progress_;
  Mask is_free_;
  Vector start_, travel_, offset_;
  mutable Vector at_, external_; // force at the u whose residual was asked for last
};

} // namespace supple
