#include "arc_length.hpp"

#include <algorithm>
#include <cmath>

namespace supple {

namespace {

constexpr double kFirst = 0.2;     // of the load
constexpr double kSmallest = 1e-3; // step, of the way that lies behind
constexpr double kLoose = 1e-6;    // of the forces, on the way; the end is found to rtol
constexpr double kChord = 0.1;     // fall of the residual with which a factor is kept
constexpr double kFoldTol = 1e-4;  // of the load, on the largest
constexpr double kCollapse = 1e-2; // volume ratio of a cell that is taken for collapsed
constexpr int kCorrections = 8;    // a point
constexpr int kMostFactors = 300;  // before a fold
constexpr int kAfterFold = 10;     // at least, to see whether the path comes back

/// Place of the maximum of the cubic with values a, b and slopes p > 0 > q at 0 and 1.
double cubic_maximum(double a, double b, double p, double q) {
  const double c2 = 3.0 * (b - a) - 2.0 * p - q, c3 = 2.0 * (a - b) + p + q;
  const double root = std::sqrt(std::max(0.0, c2 * c2 - 3.0 * c3 * p));
  const double t = p / (root - c2); // of p + 2 c2 t + 3 c3 t² = 0, where the slope falls
  return std::isfinite(t) ? std::clamp(t, 0.05, 0.95) : 0.5;
}

ArcPoint between(const ArcPoint& a, const ArcPoint& b, double length, double t) {
  const double h = t * t * (3.0 - 2.0 * t), g = t * (1.0 - t) * (1.0 - t) * length;
  const double k = t * t * (t - 1.0) * length;
  return {a.u + h * (b.u - a.u) + g * a.du + k * b.du, a.s + h * (b.s - a.s) + g * a.ds + k * b.ds,
          a.du, a.ds};
}

} // namespace

Outcome ArcLength::run() {
  if (!start()) return Outcome::Singular;
  Outcome outcome = Outcome::Converged;
  while (factors_ < budget()) {
    const bool last = here_.ds > 0.0 && here_.s + length_ * here_.ds >= 1.0;
    if (last && finish(outcome)) return outcome;
    if (last || !advance()) {
      length_ = 0.5 * (last ? std::min(length_, (1.0 - here_.s) / here_.ds) : length_);
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
  if (factors_at_fold_ >= 0) return Outcome::LimitPoint;
  return p_.result.worst.value < kCollapse ? Outcome::Inverted : Outcome::Stalled;
}

/// The tangent at the last equilibrium, scaled so that u and s weigh the same there.
bool ArcLength::start() {
  here_ = {p_.result.u, p_.result.load_factor, {}, 1.0};
  Vector w;
  if (!factorise(here_, w)) return false;
  unit_ = std::max(w.squaredNorm(), 1e-300);
  here_.du = Vector::Zero(w.size());
  turn(here_, w);
  length_ = kFirst / here_.ds;
  return true;
}

bool ArcLength::finish(Outcome& outcome) {
  Vector u = predict((1.0 - here_.s) / here_.ds).u;
  if (!p_.admissible(u, 1.0)) return false;
  outcome = step_.iterate(u, 1.0, Manner::Full);
  if (outcome == Outcome::Converged) {
    p_.result.u = u;
    p_.result.load_factor = 1.0;
  }
  return outcome == Outcome::Converged || outcome == Outcome::Unstable;
}

bool ArcLength::advance() {
  ArcPoint next = predict(length_);
  if (!correct(next)) return false;
  const double length = length_;
  if (here_.ds > 0.0 && next.ds < 0.0) locate_fold(here_, next, length);
  before_ = std::move(here_);
  here_ = std::move(next);
  keep(here_);
  travelled_ += length;
  last_ = length;
  if (corrections_ >= 5)
    length_ *= 0.7;
  else if (!refused_)
    length_ *= corrections_ <= 2 ? 2.0 : corrections_ == 3 ? 1.4 : 1.0;
  refused_ = false;
  return true;
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
    if (!correct(top)) break;
    keep(top);
    known = top.s;
    (top.ds > 0.0 ? low : high) = std::move(top);
    length *= top.ds > 0.0 ? 1.0 - t : t;
  }
  if (factors_at_fold_ < 0) {
    p_.result.fold = known;
    factors_at_fold_ = factors_;
  }
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

/// Bring a predicted point, with the tangent of the last one, onto the path.
bool ArcLength::correct(ArcPoint& point) {
  p_.result.worst = {};
  if (!p_.admissible(point.u, point.s)) return false;
  Vector r = p_.residual(point.u, point.s), w;
  double norm = p_.free_norm(r), before = 0.0;
  p_.record({point.s, 0, norm, kLoose * p_.scale(point.u, r, point.s), 0.0, 1.0, 0.0});
  for (corrections_ = 1; corrections_ <= kCorrections; ++corrections_) {
    const bool fresh = corrections_ == 1 || norm > kChord * before;
    if (fresh && !factorise(point, w)) return false;
    Vector d = p_.system.solve(-r);
    const double ds = -dot(point.du, d) / (point.ds + dot(point.du, w));
    d += ds * w;
    if (!d.allFinite()) return false;
    double a = 1.0;
    while (a > 0.1 && !p_.admissible(point.u + a * d, point.s + a * ds))
      a *= 0.5;
    if (a <= 0.1) return false;
    point.u += a * d;
    point.s += a * ds;
    r = p_.residual(point.u, point.s);
    before = norm;
    norm = p_.free_norm(r);
    p_.result.last_residual = r;
    const double tol = kLoose * p_.scale(point.u, r, point.s) + p_.settings.atol;
    p_.record({point.s, corrections_, norm, tol, a * d.cwiseAbs().maxCoeff(), a, 0.0});
    if (norm <= tol) {
      turn(point, w);
      return true;
    }
    if (!std::isfinite(norm) || (corrections_ > 2 && norm > 0.5 * before)) return false;
  }
  return false;
}

/// Factorise K, and w = du/ds along the path.
bool ArcLength::factorise(const ArcPoint& point, Vector& w) {
  ++factors_;
  p_.assemble_tangent(point.u, point.s);
  const FactorStatus status = p_.system.factorise();
  const bool indefinite = status.cause == FactorStatus::Cause::NotPositiveDefinite;
  if (!status.ok() && !(indefinite && p_.system.factorise_indefinite().ok())) return false;
  Vector pull = p_.pull(point.u);
  if (p_.travel().cwiseAbs().maxCoeff() > 0.0) pull -= p_.system.apply(p_.travel());
  w = p_.system.solve(pull) + p_.travel();
  return w.allFinite();
}

/// The unit tangent from w, pointing on from the tangent that the point brought along.
void ArcLength::turn(ArcPoint& point, const Vector& w) const {
  const double along = dot(point.du, w) + point.ds;
  const double scale = std::copysign(1.0 / std::sqrt(dot(w, w) + 1.0), along);
  point.du = scale * w;
  point.ds = scale;
}

} // namespace supple
