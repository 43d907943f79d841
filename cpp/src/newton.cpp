#include "supple/newton.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>

#include "supple/error.hpp"
#include "supple/krylov.hpp"

namespace supple {

namespace {

constexpr double kShortest = 1.0 / 1024.0; // of a Newton step
constexpr double kArmijo = 1e-4;           // Nocedal and Wright (2006), eq. 3.4
constexpr double kLargestShift = 1e4;
constexpr double kSettled = 1e-3; // accuracy of the step that shows that no more are needed
constexpr double kDoubtful = 1e8; // growth of LDLᵀ above which the signs of its pivots mean little
constexpr int kPatience = 4;      // times more iterations where each is sure to lower the energy

/// How one load step is attacked: full Newton steps, or steps that must lower the energy.
enum class Manner { Full, Guarded };

/// Follows the path from load to load; owns what the load steps share.
class Path {
 public:
  Path(System& system, const Vector& start, const Vector& prescribed,
       const NewtonSettings& settings, const Progress& progress)
      : system_(system), prescribed_(prescribed), settings_(settings), progress_(progress) {
    require_size("start", start.size(), system.dofs(), "one entry for each dof");
    require_size("prescribed", prescribed.size(), system.dofs(), "one entry for each dof");
    const Reduction& reduction = system_.reduction();
    is_free_ = Mask::Constant(system.dofs(), false);
    for (const Index dof : reduction.dof)
      is_free_[dof] = true;
    result_.u = start;
    start_fixed_ = start;
    offset_ = Vector::Zero(system.dofs());
    if (settings_.warm) offset_ = system_.residual(start, 1.0);
    has_energy_ = system_.has_energy();
    minimises_ = has_energy_ && system_.kind() == Kind::Cholesky;
  }

  NewtonResult run() {
    const auto begin = std::chrono::steady_clock::now();
    if (settings_.load_steps > 0) {
      equal_steps();
    } else {
      adaptive_steps();
    }
    result_.residual = system_.residual(result_.u, 1.0);
    const std::chrono::duration<double> seconds = std::chrono::steady_clock::now() - begin;
    system_.timings.total += seconds.count();
    return std::move(result_);
  }

 private:
  void equal_steps() {
    for (int k = 1; k <= settings_.load_steps; ++k) {
      if (!reach(static_cast<double>(k) / settings_.load_steps)) return;
    }
  }

  void adaptive_steps() {
    double step = 1.0;
    while (result_.load_factor < 1.0) {
      const double target = std::min(1.0, result_.load_factor + step);
      if (reach(target)) {
        step = std::min(2.0 * step, 1.0);
      } else {
        step = 0.5 * (target - result_.load_factor);
        if (step < settings_.smallest_step) return;
      }
    }
    result_.outcome = Outcome::Converged;
  }

  /// Equilibrium at load factor `s` from the last one; result_ keeps the last one if it fails.
  bool reach(double s) {
    for (const Manner manner : {Manner::Full, Manner::Guarded}) {
      Vector u = result_.u;
      result_.outcome = iterate(u, s, manner);
      if (result_.outcome == Outcome::Converged) {
        result_.u = u;
        result_.load_factor = s;
        return true;
      }
    }
    return false;
  }

  double loads(double s) const { return settings_.warm ? 1.0 : s; }
  double held_back(double s) const { return settings_.warm ? 1.0 - s : 0.0; }

  Vector residual(const Vector& u, double s) const {
    Vector r = system_.residual(u, loads(s));
    if (settings_.warm) r -= held_back(s) * offset_;
    return r;
  }

  double energy(const Vector& u, double s) const {
    double total = system_.energy(u, loads(s));
    if (settings_.warm) total -= held_back(s) * offset_.dot(u);
    return total;
  }

  double free_norm(const Vector& r) const {
    double sum = 0.0;
    for (Eigen::Index i = 0; i < r.size(); ++i)
      sum += is_free_[i] ? r[i] * r[i] : 0.0;
    return std::sqrt(sum);
  }

  double tolerance(const Vector& u, const Vector& r, double s) const {
    const double fixed = std::sqrt(std::max(0.0, r.squaredNorm() - std::pow(free_norm(r), 2)));
    const double external = loads(s) * system_.external(u).norm();
    return settings_.rtol * std::max(external, fixed) + settings_.atol;
  }

  /// What is missing at the fixed dofs from their values at load factor `s` (3n).
  Vector missing(const Vector& u, double s) const {
    Vector d = Vector::Zero(u.size());
    for (Eigen::Index i = 0; i < u.size(); ++i) {
      if (!is_free_[i]) d[i] = start_fixed_[i] + s * (prescribed_[i] - start_fixed_[i]) - u[i];
    }
    return d;
  }

  bool admissible(const Vector& u, double s) {
    if (settings_.refuse_inversion) {
      const VolumeRatio ratio = system_.volume_ratio(u);
      if (ratio.value < result_.worst.value || ratio.value <= 0.0) result_.worst = ratio;
      if (!(ratio.value > 0.0)) return false;
    }
    return !has_energy_ || std::isfinite(energy(u, s));
  }

  void record(double s, int iteration, double norm, double tol, double step, double length) {
    result_.history.push_back({s, iteration, norm, tol, step, length, shift_});
    if (progress_) progress_(result_.history.back());
  }

  /// Factorise K at `u`; an indefinite K is shifted in the guarded manner until it is not.
  Outcome factorise(const Vector& u, double s, Manner manner) {
    system_.assemble_tangent(u, loads(s));
    shift_ = 0.0;
    indefinite_ = false;
    FactorStatus status = system_.factorise();
    if (status.ok()) return Outcome::Converged;
    if (status.cause == FactorStatus::Cause::NotFinite) return Outcome::Inverted;
    if (status.cause == FactorStatus::Cause::Singular) return Outcome::Singular;
    if (manner == Manner::Full) { // on the way an indefinite K is no fault, at the end it is
      indefinite_ = system_.factorise_indefinite().ok();
      return indefinite_ ? Outcome::Converged : Outcome::LimitPoint;
    }
    for (shift_ = 1e-3; shift_ < kLargestShift; shift_ *= 10.0) {
      if (system_.factorise(shift_).ok()) return Outcome::Converged;
    }
    return Outcome::LimitPoint;
  }

  Outcome iterate(Vector& u, double s, Manner manner) {
    result_.worst = {};
    Vector r = residual(u, s);
    const double first = free_norm(r);
    double norm = first, best = std::numeric_limits<double>::infinity();
    double tol = tolerance(u, r, s);
    record(s, 0, norm, tol, 0.0, 1.0);
    Forcing forcing;
    // Steps that lower an energy cannot run away: cutting the load instead would lose their ground.
    const bool descends = manner == Manner::Guarded && minimises_;
    const int limit = descends ? kPatience * settings_.max_iterations : settings_.max_iterations;
    for (int k = 1; k <= limit; ++k) {
      const Outcome factored = factorise(u, s, manner);
      if (factored != Outcome::Converged) return factored;
      Vector d = missing(u, s);
      const bool moves_supports = d.cwiseAbs().maxCoeff() > 0.0;
      Vector rhs = -r;
      if (moves_supports) rhs -= system_.apply(d);
      d += system_.solve(rhs, forcing.next(norm, tol));
      if (!d.allFinite()) return Outcome::Singular;
      const double length = line_search(u, d, r, norm, s, manner, moves_supports);
      if (length == 0.0) return fault();
      u += length * d;
      r = residual(u, s);
      norm = free_norm(r);
      result_.last_residual = r;
      const double step = length * d.cwiseAbs().maxCoeff();
      tol = tolerance(u, r, s);
      record(s, k, norm, tol, step, length);
      if (!std::isfinite(norm)) return Outcome::Inverted;
      if (norm <= tol && length == 1.0 && shift_ == 0.0 && settled(u, r, norm, step, s)) {
        return stable(u, s);
      }
      if (norm <= tol && shift_ > 0.0 && step <= settings_.step_tol * settings_.size) {
        return stable(u, s);
      }
      if (manner == Manner::Full && k >= 6 && norm > std::max(first, best)) break;
      best = std::min(best, norm);
    }
    return fault();
  }

  /// The step is small enough, or one more with the factor at hand is and does no harm.
  bool settled(Vector& u, Vector& r, double norm, double step, double s) {
    const double limit = settings_.step_tol * settings_.size;
    if (step <= limit) return true;
    const Vector d = system_.solve(-r, kSettled);
    const Vector next = u + d;
    const Vector r_next = residual(next, s);
    if (free_norm(r_next) <= norm) {
      u = next;
      r = r_next;
    }
    return d.cwiseAbs().maxCoeff() <= limit;
  }

  /// An equilibrium with an indefinite tangent is not where a body rests.
  Outcome stable(const Vector& u, double s) {
    if (!has_energy_) return Outcome::Converged;
    if (!minimises_) return stable_saddle();
    if (shift_ == 0.0 && !indefinite_) return Outcome::Converged; // K was definite one step ago
    system_.assemble_tangent(u, loads(s));
    if (system_.factorise().ok()) return Outcome::Converged;
    result_.negative = system_.inertia().negative;
    return result_.negative > 0 ? Outcome::Unstable : Outcome::Converged;
  }

  /// Of a mixed form's tangent each scalar gives one negative eigenvalue, and a stable body no
  /// more.
  Outcome stable_saddle() {
    const Inertia inertia = system_.inertia();
    result_.negative = inertia.negative - system_.scalars();
    const bool doubtful = inertia.growth > kDoubtful;
    return result_.negative == 0 || doubtful ? Outcome::Converged : Outcome::Unstable;
  }

  Outcome fault() const {
    return result_.worst.value <= 0.0 ? Outcome::Inverted : Outcome::Stalled;
  }

  /// Largest acceptable share of the step, 0 if there is none.
  double line_search(const Vector& u, const Vector& d, const Vector& r, double norm, double s,
                     Manner manner, bool moves_supports) {
    const bool only_guard = manner == Manner::Full || moves_supports;
    const double before = minimises_ && !only_guard ? energy(u, s) : 0.0;
    const double slope = r.dot(d), rounding = 1e-12 * std::abs(before);
    for (double a = 1.0; a >= kShortest; a *= 0.5) {
      const Vector trial = u + a * d;
      if (!admissible(trial, s)) continue;
      if (only_guard) return a;
      if (minimises_) {
        if (energy(trial, s) <= before + kArmijo * a * slope + rounding) return a;
      } else if (free_norm(residual(trial, s)) <= (1.0 - kArmijo * a) * norm) {
        return a;
      }
    }
    // At the bottom, rounding hides every decrease: a full step that leaves R small is a good one.
    const Vector trial = u + d;
    if (admissible(trial, s)) {
      const Vector r_trial = residual(trial, s);
      if (free_norm(r_trial) <= tolerance(trial, r_trial, s)) return 1.0;
    }
    return 0.0;
  }

  System& system_;
  const Vector& prescribed_;
  const NewtonSettings& settings_;
  const Progress& progress_;
  Mask is_free_;
  Vector start_fixed_, offset_;
  bool has_energy_ = false;
  bool minimises_ = false; // an equilibrium is a minimum of the energy, not a saddle
  double shift_ = 0.0;
  bool indefinite_ = false;
  NewtonResult result_;
};

} // namespace

NewtonResult solve(System& system, const Vector& start, const Vector& prescribed,
                   const NewtonSettings& settings, const Progress& progress) {
  return Path(system, start, prescribed, settings, progress).run();
}

} // namespace supple
