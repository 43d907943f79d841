/// Newton's method on R(u) = 0 with load steps, back-tracking and arc length; never a silent
/// failure.
///
///     the whole load by full Newton steps, guarded: J > 0 and ψ finite   quick, the usual case
///     else by steps that lower the energy, where equilibria are its minima
///     else along the path of equilibria by arc length, past its folds (cpp/src/arc_length.hpp)
///
/// From zero the load factor scales the loads and the prescribed displacements. From another start
/// u0 the loads stay whole and R(u) − (1 − s) R(u0) = 0 is followed from s = 0, where u0 solves it.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "supple/system.hpp"

namespace supple {

enum class Outcome {
  Converged,
  Unstable,   ///< an equilibrium with negative stiffness: a small push leaves it
  Inverted,   ///< no step without an inverted cell
  Singular,   ///< the tangent has no inverse
  LimitPoint, ///< the load has a largest value on the path, below the whole, and did not come back
  Stalled     ///< the residual does not fall any more
};

/// Whether an equilibrium (u, load factor) is of use; Converged if so, else what is wrong with it.
using Judge = std::function<Outcome(const Vector&, double)>;

struct NewtonSettings {
  double rtol = 1e-10;     ///< of max(‖external force‖, ‖reactions‖)
  double atol = 1e-14;     ///< N
  double step_tol = 1e-8;  ///< of `size`, on the largest entry of the Newton step
  double size = 1.0;       ///< of the body, m
  int max_iterations = 25; ///< of one load step; four times as many where each lowers the energy
  int load_steps = 0;      ///< equal steps without cut-back; 0: adaptive
  bool refuse_inversion = true; ///< J ≤ 0 at a point is refused (not for barrier laws)
  bool warm = false;            ///< follow from u0 as it is instead of scaling the loads
  bool follow = false;          ///< the path at once, without trying the whole load first
  Judge judge; ///< of the whole load's equilibrium and of those on the path; may be empty
};

/// One Newton iteration, or the start of a load step (iteration 0).
struct Iteration {
  double load_factor = 0.0; ///< that this iteration aims at
  int iteration = 0;
  double residual = 0.0;  ///< ‖R‖₂ on free dofs after it, N
  double tolerance = 0.0; ///< that it is compared with, N
  double step = 0.0;      ///< ‖Δu‖∞, m
  double length = 1.0;    ///< share of the Newton step that was taken
  double shift = 0.0;     ///< added to an indefinite tangent, relative to its diagonal
};

struct NewtonResult {
  Outcome outcome = Outcome::Converged;
  Vector u;                 ///< (dofs) at the last equilibrium found
  double load_factor = 0.0; ///< of that equilibrium, the largest found
  double fold = 0.0;        ///< load factor at the first limit point passed, 0 if there was none
  Vector residual;          ///< (dofs) at u with the whole load; reactions at fixed dofs
  std::vector<Iteration> history;
  VolumeRatio worst;         ///< smallest volume ratio met in the last attempt
  Vector last_residual;      ///< (dofs) of the last attempt, to find the cells at fault
  std::int64_t negative = 0; ///< negative eigenvalues, where the outcome is Unstable
};

/// Called after each iteration; may throw to stop the solve.
using Progress = std::function<void(const Iteration&)>;

/// Find equilibrium from `start` (dofs) with the fixed dofs brought to `prescribed` (3n; free
/// entries are not read).
/// @throws ShapeError on sizes; whatever `progress` throws.
NewtonResult solve(System& system, const Vector& start, const Vector& prescribed,
                   const NewtonSettings& settings, const Progress& progress);

} // namespace supple
