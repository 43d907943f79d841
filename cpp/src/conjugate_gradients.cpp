#include <algorithm>
#include <cmath>
#include <cstdint>
#include <Eigen/Eigenvalues>
#include <limits>
#include <vector>

#include "supple/error.hpp"
#include "supple/krylov.hpp"

namespace supple {
namespace {

constexpr double kMissed = 1e-4;   // chance that an eigenvalue below 0 goes unseen
constexpr double kFaint = 0.01;    // of the largest: how far below 0 it must be for that
constexpr double kCentre = 0.8;    // above 2/√(2π), the density of a normal number's size at 0
constexpr double kBeyond = 1.1;    // the largest eigenvalue, of the largest Ritz value
constexpr double kNoCurve = 1e-14; // of |p||Ap|: rounding
constexpr int kFewest = 4;         // iterations before Ritz values alone are believed

/// Of the largest Ritz value and of the noise in one direction: what a residual is to fall below.
constexpr double kSilence = kMissed / kCentre * kFaint;

/// Lanczos' tridiagonal matrix of M⁻¹A, from the coefficients of conjugate gradients.
class RitzValues {
 public:
  /// Of one iteration: the step alpha, and beta with which the direction before was kept.
  void add(double alpha, double beta) {
    diagonal_.push_back(1.0 / alpha + (diagonal_.empty() ? 0.0 : beta / last_));
    if (diagonal_.size() > 1) beside_.push_back(std::sqrt(beta) / last_);
    last_ = alpha;
  }

  /// Look at the values so far; the largest of them.
  double judge(CgReport& report) const {
    const auto k = static_cast<Eigen::Index>(diagonal_.size());
    if (k == 0) return 0.0;
    Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver;
    solver.computeFromTridiagonal(Eigen::Map<const Vector>(diagonal_.data(), k),
                                  Eigen::Map<const Vector>(beside_.data(), k - 1),
                                  Eigen::EigenvaluesOnly);
    const double largest = solver.eigenvalues()[k - 1];
    report.spread = solver.eigenvalues()[0] / largest;
    if (!(report.spread > 0.0)) report.definite = Definite::No;
    return largest;
  }
  int count() const { return static_cast<int>(diagonal_.size()); }

 private:
  std::vector<double> diagonal_, beside_;
  double last_ = 1.0;
};

/// Iterations from noise after which Ritz values of this spread leave no eigenvalue below 0 but by
/// the chance kMissed.
double believed_after(double spread, double size) {
  const double digits = std::log(2.0 * 1.648 * std::sqrt(size) / kMissed);
  return std::min(std::max(0.5 * (digits / std::sqrt(spread / kBeyond) + 1.0), 1.0 * kFewest), 1e9);
}

} // namespace

Vector probe_noise(Eigen::Index size) {
  Vector result(size); // splitmix64
  std::uint64_t state = 0;
  for (double& entry : result) {
    std::uint64_t z = (state += 0x9e3779b97f4a7c15u);
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
    entry = ((z ^ (z >> 31)) & 1u) != 0 ? 1.0 : -1.0;
  }
  return result;
}

int probe_iterations(double spread, double size) {
  if (!(spread > 0.0)) return std::numeric_limits<int>::max();
  const double root = std::sqrt(spread), rate = (1.0 - root) / (1.0 + root);
  const double fall = std::log(2.0 * std::sqrt(size) / kSilence);
  const double silent = 2.0 + fall / -std::log(std::max(rate, kNoCurve));
  return static_cast<int>(std::min(silent, 1.0 + believed_after(spread, size)));
}

CgReport conjugate_gradients(const Operator& matrix, const Operator& preconditioner,
                             const Vector& b, Vector& x, const CgSettings& settings) {
  require_size("x", x.size(), b.size(), "give a first guess, such as zeros");
  CgReport report;
  const Eigen::Index n = b.size();
  const double scale = b.norm();
  if (n == 0) return {true, 0, 0.0, Definite::Yes, 1.0};
  Vector r = b, z(n), q(n);
  const double loudness = (scale > 0.0 ? scale : 1.0) / std::sqrt(static_cast<double>(n));
  if (settings.probe) {
    if (settings.echo != nullptr) {
      x += loudness * *settings.echo;
    } else {
      preconditioner(loudness * probe_noise(n), z);
      x += z;
      ++report.iterations;
    }
  }
  if (!x.isZero(0.0)) {
    matrix(x, q);
    r -= q;
  }
  const double goal = settings.tolerance * scale;
  double length = r.norm(), beta = 0.0, before = 0.0;
  Vector p = Vector::Zero(n);
  RitzValues ritz;
  const auto finished = [&] {
    return length <= goal && (!settings.probe || report.definite != Definite::Unknown);
  };
  while (!finished() && length > 0.0 && report.iterations < settings.max_iterations) {
    preconditioner(r, z);
    ++report.iterations;
    const double now = r.dot(z);
    beta = before > 0.0 ? now / before : 0.0;
    p = z + beta * p;
    matrix(p, q);
    const double curvature = p.dot(q);
    if (!(now > 0.0) || !(std::abs(curvature) > kNoCurve * p.norm() * q.norm())) break;
    const double alpha = now / curvature;
    x += alpha * p;
    r -= alpha * q;
    length = r.norm();
    before = now;
    if (!std::isfinite(length)) break;
    if (curvature < 0.0) report.definite = Definite::No;
    ritz.add(alpha, beta);
    if (settings.probe && report.definite == Definite::Unknown) {
      const double largest = ritz.judge(report);
      const bool silent = length <= kSilence * largest * loudness;
      if (report.definite == Definite::Unknown &&
          (silent || ritz.count() >= believed_after(report.spread, static_cast<double>(n))))
        report.definite = Definite::Yes;
    }
  }
  if (report.definite == Definite::Unknown) ritz.judge(report);
  report.residual = scale > 0.0 ? length / scale : 0.0;
  report.converged = length <= goal;
  return report;
}

} // namespace supple
