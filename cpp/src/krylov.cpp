#include "supple/krylov.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include "supple/error.hpp"

namespace supple {
namespace {

constexpr int kTrial = 8;         // iterations that show the rate
constexpr double kPatience = 2.0; // predicted iterations over the limit at which it gives up
constexpr double kLost = 1e-14;   // of a vector: what is left of it is rounding

/// The least squares problem min ‖β e₁ − H y‖ by Givens rotations, one column at a time.
class HessenbergLeastSquares {
 public:
  explicit HessenbergLeastSquares(double beta) : rhs_{beta} {}

  /// Add the column h (k + 2) of the k-th iteration, of a vector of length `size`; false if the
  /// matrix is singular there.
  bool add(std::vector<double> h, double size) {
    const std::size_t k = columns_.size();
    const double rounding = kLost * size;
    if (h[k + 1] <= rounding) h[k + 1] = 0.0;
    for (std::size_t i = 0; i < k; ++i) {
      const double upper = cosine_[i] * h[i] + sine_[i] * h[i + 1];
      h[i + 1] = cosine_[i] * h[i + 1] - sine_[i] * h[i];
      h[i] = upper;
    }
    const double pivot = std::hypot(h[k], h[k + 1]);
    if (pivot <= rounding) return false;
    cosine_.push_back(h[k] / pivot);
    sine_.push_back(h[k + 1] / pivot);
    h[k] = pivot;
    rhs_.push_back(-sine_[k] * rhs_[k]);
    rhs_[k] *= cosine_[k];
    columns_.push_back(std::move(h));
    return true;
  }

  double residual() const { return std::abs(rhs_.back()); }

  /// Coefficients of the basis vectors.
  std::vector<double> solution() const {
    std::vector<double> y(rhs_.begin(), rhs_.end() - 1);
    for (std::size_t k = y.size(); k-- > 0;) {
      y[k] /= columns_[k][k];
      for (std::size_t i = 0; i < k; ++i)
        y[i] -= columns_[k][i] * y[k];
    }
    return y;
  }

 private:
  std::vector<std::vector<double>> columns_;
  std::vector<double> cosine_, sine_, rhs_;
};

/// Make w orthogonal to the basis, twice (once loses digits); its column of H, with ‖w‖ at the end.
std::vector<double> orthogonalise(const std::vector<Vector>& basis, Vector& w) {
  std::vector<double> h(basis.size() + 1, 0.0);
  for (int pass = 0; pass < 2; ++pass) {
    for (std::size_t i = 0; i < basis.size(); ++i) {
      const double part = basis[i].dot(w);
      h[i] += part;
      w -= part * basis[i];
    }
  }
  h.back() = w.norm();
  return h;
}

/// At the mean rate so far the limit is far off.
bool hopeless(int iteration, double residual, const GmresSettings& settings) {
  if (iteration < kTrial) return false;
  const double needed = iteration * std::log(settings.tolerance) / std::log(residual);
  return !(residual < 1.0) || needed > kPatience * settings.max_iterations;
}

} // namespace

GmresReport gmres(const Operator& matrix, const Operator& preconditioner, const Vector& b,
                  Vector& x, const GmresSettings& settings) {
  require_size("x", x.size(), b.size(), "give a first guess, such as zeros");
  const double scale = b.norm();
  GmresReport report;
  if (scale == 0.0) {
    x.setZero();
    report.converged = true;
    return report;
  }
  Vector w = b, z(b.size());
  if (!x.isZero(0.0)) {
    matrix(x, w);
    w = b - w;
  }
  const double beta = w.norm();
  report.residual = beta / scale;
  HessenbergLeastSquares small(beta);
  std::vector<Vector> basis, moves;
  double length = beta;
  while (report.residual > settings.tolerance && report.iterations < settings.max_iterations &&
         length > 0.0 && !hopeless(report.iterations, report.residual, settings)) {
    basis.push_back(w / length);
    preconditioner(basis.back(), z);
    matrix(z, w);
    moves.push_back(z);
    const double size = w.norm();
    std::vector<double> column = orthogonalise(basis, w);
    length = column.back();
    ++report.iterations;
    if (!std::isfinite(length) || !small.add(std::move(column), size)) break;
    report.residual = small.residual() / scale;
  }
  const std::vector<double> y = small.solution();
  for (std::size_t k = 0; k < y.size(); ++k)
    x += y[k] * moves[k];
  report.converged = report.residual <= settings.tolerance;
  return report;
}

double Forcing::next(double norm, double tolerance) {
  double eta = loosest_;
  if (before_ > 0.0) {
    eta = 0.9 * std::pow(norm / before_, alpha_);
    const double memory = 0.9 * std::pow(last_, alpha_);
    if (memory > 0.1) eta = std::max(eta, memory);
    eta = std::min(eta, loosest_);
  }
  before_ = norm;
  last_ = std::min(loosest_, std::max(eta, 0.5 * tolerance / norm));
  return last_;
}

} // namespace supple
