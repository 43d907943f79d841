#include "arc_length.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace supple {

namespace {

constexpr double kFirst = 0.2;     // of the load
constexpr double kSmallest = 1e-3; // step, of the way that lies behind
constexpr double kLoose = 1e-3;    // of the forces, on the way; the end is found to rtol
constexpr double kKinks = 3e-3;    // the same, where a law has kinks
constexpr double kTight = 1e-6;    // of the forces, where the load is largest
constexpr double kFar = 0.1;       // of a step: a correction after which the tangent is made anew
constexpr double kLost = 0.5;      // of a step: a correction that is not trusted
constexpr double kBent = 0.7;      // of a correction, that is left at half of a step on smooth ways
constexpr double kFoldTol = 4e-4;  // of the load, on the largest
constexpr double kCollapse = 1e-2; // volume ratio of a cell that is taken for collapsed
constexpr int kMostFactors = 300;  // before a fold
constexpr int kAfterFold = 3;      // at least, to see whether the path comes back
constexpr int kReturns = 1;        // to where a fault begins: half of the step
constexpr int kReturnsToStart = 6; // the same, where nothing was found yet
constexpr double kNear = 0.05;     // of the load, to the whole of it where that has a fault

/// Place in (0, 1) of the maximum of the cubic with values a, b and slopes p > 0 > q at 0 and 1.
double cubic_maximum(double a, double b, double p, double q) {
  const double c2 = 3.0 * (b - a) - 2.0 * p - q, c3 = 2.0 * (a - b) + p + q;
  const double root = std::sqrt(std::max(0.0, c2 * c2 - 3.0 * c3 * p));
  const double t = p / (root - c2); // of p + 2 c2 t + 3 c3 t² = 0, where the slope falls
  return std::isfinite(t) ? std::clamp(t, 0.05, 0.95) : 0.5;
}

/// The cubic through two points with their tangents; it brings the first one's tangent along.
ArcPoint between(const ArcPoint& a, const ArcPoint& b, double length, double t) {
  const double h = t * t * (3.0 - 2.0 * t), g = t * (1.0 - t) * (1.0 - t) * length;
  const double k = t * t * (t - 1.0) * length;
  return {a.u + h * (b.u - a.u) + g * a.du + k * b.du, a.s + h * (b.s - a.s) + g * a.ds + k * b.ds,
          a.du, a.ds};
}

} // namespace

Outcome ArcLength::run() {
  here_.u = p_.result.u;
  here_.s = p_.result.load_factor;
  if (!corrector_.begin(here_, step_.first())) return Outcome::Singular;
  length_ = kFirst / here_.ds;
  Outcome outcome = Outcome::Converged;
  while (fault_ == Outcome::Converged && corrector_.factors() < budget()) {
    const double whole = length_to_whole();
    const bool last = whole <= length_;
    if (last && at_end_ == Outcome::Converged && finish(whole, outcome)) return outcome;
    if (last && at_end_ != Outcome::Converged && 1.0 - here_.s < kNear) return at_end_;
    if (last || !advance()) {
      length_ = 0.5 * std::min(length_, whole);
      refused_ = true;
    }
    if (length_ < kSmallest * std::max(travelled_, kFirst)) break;
  }
  return end();
}

int ArcLength::budget() const {
  if (factors_at_fold_ < 0) return kMostFactors;
  return factors_at_fold_ + std::max(kAfterFold, factors_at_fold_ / 2);
}

Outcome ArcLength::end() const {
  if (fault_ != Outcome::Converged) return fault_;
  if (factors_at_fold_ >= 0) return Outcome::LimitPoint;
  return p_.result.worst.value < kCollapse ? Outcome::Inverted : Outcome::Stalled;
}

/// Where the predicted path meets the whole load; infinite where it turns back before.
double ArcLength::length_to_whole() const {
  const double missing = 1.0 - here_.s, bend = predict(1.0).s - here_.s - here_.ds;
  const double inside = here_.ds * here_.ds + 4.0 * bend * missing;
  const double length = 2.0 * missing / (here_.ds + std::sqrt(inside)); // NaN: no such root
  return length > 0.0 ? length : std::numeric_limits<double>::infinity();
}

bool ArcLength::finish(double length, Outcome& outcome) {
  Vector u = predict(length).u;
  if (!p_.admissible(u, 1.0)) return false;
  outcome = step_.iterate(u, 1.0, Manner::Full);
  if (outcome == Outcome::Unstable) return true;
  if (outcome != Outcome::Converged) return false;
  at_end_ = p_.judge(u, 1.0); // what is wrong there begins somewhere before: the path goes on
  if (at_end_ != Outcome::Converged) return false;
  p_.result.u = u;
  p_.result.load_factor = 1.0;
  return true;
}

bool ArcLength::advance() {
  ArcPoint next = predict(length_);
  if (!arrive(next) || !passes(next)) return false;
  if (here_.ds > 0.0 && next.ds < 0.0 && factors_at_fold_ < 0) locate_fold(here_, next, length_);
  before_ = std::move(here_);
  here_ = std::move(next);
  keep(here_);
  travelled_ += length_;
  last_ = length_;
  choose_length();
  return true;
}

/// On the path, with a tangent to rely on: that of the last factor is no good from far away.
bool ArcLength::arrive(ArcPoint& next) {
  const Vector u = next.u;
  const double s = next.s;
  if (!corrector_.correct(next, p_.settings.kinks ? kKinks : kLoose)) return false;
  const double moved = std::sqrt(corrector_.square(next.u - u, next.s - s)) / length_;
  if (moved > kLost && !p_.settings.kinks && !kinked(moved)) return false; // another branch?
  lost_ = 0.0;
  const bool far = moved > kFar;
  return !(far || here_.ds * next.ds < 0.0) || corrector_.refresh(next);
}

/// Whether a correction this long, in steps, is a kink's: shorter steps would not make it shorter.
bool ArcLength::kinked(double moved) {
  const bool kink = lost_ > 0.0 && moved > kBent * lost_;
  lost_ = moved;
  return kink;
}

void ArcLength::choose_length() {
  const int steps = corrector_.steps();
  if (steps >= 5) {
    length_ *= 0.7;
  } else if (!refused_) {
    length_ *= steps <= 2 ? 2.0 : steps == 3 ? 1.4 : 1.0;
  }
  refused_ = false;
}

/// Judges a point; where a fault begins is narrowed down by shorter steps, and the path ends there.
bool ArcLength::passes(const ArcPoint& next) {
  if (next.s <= p_.result.load_factor) return true; // on a way back, nothing to be kept
  const Outcome verdict = p_.judge(next.u, next.s);
  const int most = p_.result.load_factor > 0.0 ? kReturns : kReturnsToStart;
  if (verdict != Outcome::Converged && returns_++ >= most) fault_ = verdict;
  return verdict == Outcome::Converged;
}

void ArcLength::keep(const ArcPoint& point) {
  if (point.s <= p_.result.load_factor || point.s > 1.0) return;
  p_.result.u = point.u;
  p_.result.load_factor = point.s;
}

/// Bracket the largest load between two points of the path until it is known to kFoldTol.
void ArcLength::locate_fold(ArcPoint low, ArcPoint high, double length) {
  double known = low.s;
  for (int k = 0; k < 5; ++k) {
    const double t = cubic_maximum(low.s, high.s, length * low.ds, length * high.ds);
    ArcPoint top = between(low, high, length, t);
    if (std::abs(top.s - known) <= kFoldTol * std::abs(known)) break;
    if (!corrector_.correct(top, kTight) || !corrector_.refresh(top)) break;
    keep(top);
    known = top.s;
    const bool rises = top.ds > 0.0;
    length *= rises ? 1.0 - t : t;
    (rises ? low : high) = std::move(top);
  }
  p_.result.fold = known;
  factors_at_fold_ = corrector_.factors();
}

ArcPoint ArcLength::predict(double length) const {
  ArcPoint next = here_;
  next.u += length * here_.du;
  next.s += length * here_.ds;
  if (last_ > 0.0) { // the parabola that passes the point before
    const double bend = length * length / (last_ * last_);
    next.u += bend * (before_.u - here_.u + last_ * here_.du);
    next.s += bend * (before_.s - here_.s + last_ * here_.ds);
  }
  return next;
}

} // namespace supple
