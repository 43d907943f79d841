#include "supple/newton.hpp"

#include <algorithm>

#include "arc_length.hpp"
#include "stopwatch.hpp"

namespace supple {

namespace {

constexpr double kSmallestStep = 1.0 / 64.0; // of the load, where it is halved

/// Follows the path from load to load.
class Path {
 public:
  explicit Path(Problem& problem) : p_(problem), step_(problem) {}

  Outcome run() { return p_.settings.load_steps > 0 ? equal_steps() : adaptive_steps(); }

 private:
  Outcome equal_steps() {
    const int count = p_.settings.load_steps;
    for (int k = 1; k <= count; ++k) {
      Outcome outcome = reach(static_cast<double>(k) / count, Manner::Full);
      if (ends(outcome)) outcome = reach(static_cast<double>(k) / count, Manner::Guarded);
      if (ends(outcome)) return outcome;
    }
    return Outcome::Converged;
  }

  /// The whole load at once; by descent where there is an energy, or kinks to get past; the path,
  /// along which multigrid, without a factor of indefinite tangents, cannot go.
  Outcome adaptive_steps() {
    Outcome outcome = p_.settings.follow ? Outcome::Stalled : reach(1.0, Manner::Full);
    const bool descends = (p_.minimises || p_.settings.kinks) && verdict_ == Outcome::Converged;
    const bool unstable = outcome == Outcome::Unstable;
    if (ends(outcome) && descends && !p_.settings.follow) outcome = reach(1.0, Manner::Guarded);
    if (ends(outcome) && unstable && p_.system.has_grid()) return Outcome::Unstable;
    if (ends(outcome) && !p_.system.has_grid()) outcome = ArcLength(p_, step_, verdict_).run();
    const bool lost = outcome == Outcome::Stalled || outcome == Outcome::Inverted;
    return lost && p_.minimises ? halved_steps() : outcome;
  }

  /// From where the path was lost, along the energy: slow, but no stiffness is too uneven for it.
  Outcome halved_steps() {
    double step = 1.0 - p_.result.load_factor;
    while (p_.result.load_factor < 1.0) {
      const double target = std::min(1.0, p_.result.load_factor + step);
      const Outcome outcome = reach(target, Manner::Guarded);
      step = ends(outcome) ? 0.5 * (target - p_.result.load_factor) : 2.0 * step;
      if (ends(outcome) && step < kSmallestStep) return outcome;
    }
    return Outcome::Converged;
  }

  static bool ends(Outcome outcome) { return outcome != Outcome::Converged; }

  /// Equilibrium at load factor `s` from the last one; the result keeps the last one if it fails.
  Outcome reach(double s, Manner manner) {
    Vector u = p_.result.u;
    Outcome outcome = step_.iterate(u, s, manner);
    if (outcome == Outcome::Converged && s == 1.0) outcome = verdict_ = p_.judge(u, s);
    if (outcome == Outcome::Converged) {
      p_.result.u = u;
      p_.result.load_factor = s;
    }
    return outcome;
  }

  Problem& p_;
  LoadStep step_;
  Outcome verdict_ = Outcome::Converged; // of the whole load, where it was in equilibrium
};

} // namespace

NewtonResult solve(System& system, const Vector& start, const Vector& prescribed,
                   const NewtonSettings& settings, const Progress& progress) {
  const Stopwatch watch(system.timings.total);
  Problem problem(system, start, prescribed, settings, progress);
  problem.result.outcome = Path(problem).run();
  problem.result.residual = system.residual(problem.result.u, 1.0);
  return std::move(problem.result);
}

} // namespace supple
