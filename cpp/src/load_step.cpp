#include "load_step.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "supple/krylov.hpp"
#include "supple/stability.hpp"

namespace supple {

namespace {

constexpr double kShortest = 1.0 / 1024.0; // of a Newton step
constexpr double kArmijo = 1e-4;           // Nocedal and Wright (2006), eq. 3.4
constexpr double kLargestShift = 1e4;
constexpr double kSettled = 0.1; // accuracy of the step that shows that no more are needed
constexpr int kPatience = 4;     // times more iterations where each is sure to lower the energy
constexpr double kCreeping = 1.0 / 32.0;       // of a step, below which there are better ways on
constexpr double kSure = 0.1;                  // of the tolerance, that a chord's step is to reach
constexpr double kLoosest = 0.1, kAlpha = 1.5; // of the forcing, where solves are iterated
constexpr double kStraight = 1e-3;             // of the size: a step that turns nothing
constexpr double kBent = 0.02; // of a step, by which arcs must differ to be looked at
constexpr int kHopeless = 3;   // full steps in a row after which the residual must have halved

/// Full steps that no longer gain: a quick no, for there are better ways than to wait.
class Gain {
 public:
  bool lost(double norm) {
    if (norm <= 0.5 * best_) {
      best_ = norm;
      idle_ = 0;
      return false;
    }
    return ++idle_ >= kHopeless;
  }

 private:
  double best_ = std::numeric_limits<double>::infinity();
  int idle_ = 0;
};

} // namespace

Outcome LoadStep::iterate(Vector& u, double s, Manner manner) {
  p_.result.worst = {};
  Vector r = p_.residual(u, s);
  double norm = p_.free_norm(r), tol = p_.tolerance(u, r, s);
  p_.record({s, 0, norm, tol, 0.0, 1.0, shift_});
  Forcing forcing = p_.minimises ? Forcing(kLoosest, kAlpha) : Forcing();
  bool chord = false;
  // Steps that lower an energy cannot run away: cutting the load instead would lose their ground.
  const bool descends = manner == Manner::Guarded && p_.minimises;
  const int limit = (descends ? kPatience : 1) * p_.settings.max_iterations;
  Gain gain;
  for (int k = 1; k <= limit; ++k) {
    const Outcome factored = chord ? Outcome::Converged : factorise(u, s, manner);
    if (factored != Outcome::Converged) return factored;
    Vector d = p_.missing(u, s);
    const bool moves_supports = d.cwiseAbs().maxCoeff() > 0.0;
    Vector rhs = -r;
    if (moves_supports) rhs -= p_.system.apply(d);
    // A solve as exact as the end needs may be the last: it then says whether K is definite.
    const double exact = forcing.next(norm, tol);
    d += p_.system.solve(rhs, exact, p_.minimises && exact * norm <= tol);
    if (!d.allFinite()) return Outcome::Singular;
    if (first_.size() == 0) first_ = d;
    ahead_.resize(0);
    if (manner == Manner::Full) bend(u, d, s);
    const double length = line_search(u, d, r, norm, s, manner, moves_supports);
    if (length == 0.0) return fault();
    u += length * d;
    const double before = norm;
    r = length == 1.0 && ahead_.size() > 0 ? ahead_ : p_.residual(u, s);
    norm = p_.free_norm(r);
    p_.result.last_residual = r;
    tol = p_.tolerance(u, r, s);
    const double step = length * d.cwiseAbs().maxCoeff();
    p_.record({s, k, norm, tol, step, length, shift_});
    if (!std::isfinite(norm)) return Outcome::Inverted;
    if (norm <= tol && length == 1.0 && shift_ == 0.0 && settled(u, r, norm, step, s)) {
      return stable(u);
    }
    if (norm <= tol && shift_ > 0.0 && step <= p_.settings.step_tol * p_.settings.size) {
      return stable(u);
    }
    // A step with the tangent at hand shrinks R as this one did: if that is enough, it may stay.
    chord = !chord && manner == Manner::Full && p_.has_energy && !p_.settings.kinks &&
            norm / before * norm <= kSure * tol;
    if (!descends && length < kCreeping) break;
    if (manner == Manner::Full && norm > tol && gain.lost(norm)) break;
  }
  return fault();
}

/// Lay the step on arcs where that leaves less force: what turns is then not stretched.
void LoadStep::bend(const Vector& u, Vector& d, double s) {
  if (!p_.has_energy || d.cwiseAbs().maxCoeff() < kStraight * p_.settings.size) return;
  const Vector arcs = p_.system.along_arcs(u, d);
  if (!((arcs - d).cwiseAbs().maxCoeff() > kBent * d.cwiseAbs().maxCoeff())) return;
  ahead_ = p_.residual(u + d, s);
  Vector bent = p_.residual(u + arcs, s);
  if (p_.free_norm(bent) >= p_.free_norm(ahead_)) return;
  d = arcs;
  ahead_ = std::move(bent);
}

/// Factorise K at `u`; an indefinite K is shifted in the guarded manner until it is not.
Outcome LoadStep::factorise(const Vector& u, double s, Manner manner) {
  p_.assemble_tangent(u, s);
  shift_ = 0.0;
  const bool plain = manner == Manner::Full && p_.minimises;
  FactorStatus status = plain ? p_.system.prepare() : p_.system.factorise();
  if (status.ok()) return Outcome::Converged;
  if (status.cause == FactorStatus::Cause::NotFinite) return Outcome::Inverted;
  if (status.cause == FactorStatus::Cause::Singular) return Outcome::Singular;
  if (manner == Manner::Full) { // on the way an indefinite K is no fault, at the end it is
    const bool solvable = p_.system.factorise_indefinite().ok();
    return solvable ? Outcome::Converged : Outcome::LimitPoint;
  }
  for (shift_ = 1e-3; shift_ < kLargestShift; shift_ *= 10.0) {
    if (p_.system.factorise(shift_).ok()) return Outcome::Converged;
  }
  return Outcome::LimitPoint;
}

/// The step is small enough, or one more with the factor at hand is and does no harm.
bool LoadStep::settled(Vector& u, Vector& r, double norm, double step, double s) {
  const double limit = p_.settings.step_tol * p_.settings.size;
  if (step <= limit) return true;
  const Vector d = p_.system.solve(-r, kSettled);
  const Vector next = u + d;
  const Vector r_next = p_.residual(next, s);
  if (p_.free_norm(r_next) <= norm) {
    u = next;
    r = r_next;
  }
  return d.cwiseAbs().maxCoeff() <= limit;
}

/// An equilibrium with an indefinite tangent is not where a body rests.
Outcome LoadStep::stable(const Vector& u) {
  if (!p_.has_energy) return Outcome::Converged;
  if (p_.minimises && shift_ == 0.0) { // what K was one step ago
    if (p_.system.find_definite() == Definite::Yes) return Outcome::Converged;
  }
  p_.result.negative =
      p_.minimises ? unstable_directions(p_.system, u) : unstable_directions_of_saddle(p_.system);
  return p_.result.negative > 0 ? Outcome::Unstable : Outcome::Converged;
}

Outcome LoadStep::fault() const {
  return p_.result.worst.value <= 0.0 ? Outcome::Inverted : Outcome::Stalled;
}

/// Largest acceptable share of the step, 0 if there is none.
double LoadStep::line_search(const Vector& u, const Vector& d, const Vector& r, double norm,
                             double s, Manner manner, bool moves_supports) {
  const bool only_guard = manner == Manner::Full || moves_supports;
  const double before = p_.minimises && !only_guard ? p_.energy(u, s) : 0.0;
  const double slope = r.dot(d), rounding = 1e-12 * std::abs(before);
  for (double a = 1.0; a >= kShortest; a *= 0.5) {
    const Vector trial = u + a * d;
    if (!p_.admissible(trial, s)) continue;
    if (only_guard) return a;
    if (p_.minimises) {
      if (p_.energy(trial, s) <= before + kArmijo * a * slope + rounding) return a;
    } else if (p_.free_norm(p_.residual(trial, s)) <= (1.0 - kArmijo * a) * norm) {
      return a;
    }
  }
  // At the bottom, rounding hides every decrease: a full step that leaves R small is a good one.
  const Vector trial = u + d;
  if (p_.admissible(trial, s)) {
    const Vector r_trial = p_.residual(trial, s);
    if (p_.free_norm(r_trial) <= p_.tolerance(trial, r_trial, s)) return 1.0;
  }
  return 0.0;
}

} // namespace supple
