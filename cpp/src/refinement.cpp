#include "refinement.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace supple {
namespace {

constexpr double kRounding = std::numeric_limits<double>::epsilon();
constexpr double kGain = 1e-6; ///< of one run of conjugate gradients

/// Call use(row, column, value) for each stored entry.
template <class Use>
void for_entries(const CscPattern& pattern, const Vector& values, Use use) {
  for (std::int64_t c = 0; c < pattern.size; ++c) {
    const auto column = static_cast<std::size_t>(c);
    for (std::int64_t k = pattern.start[column]; k < pattern.start[column + 1]; ++k)
      use(pattern.row[static_cast<std::size_t>(k)], c, values[k]);
  }
}

double ratio(double numerator, double denominator) {
  return numerator == 0.0 ? 0.0 : numerator / denominator;
}

} // namespace

bool good_enough(const SolveReport& report, const Refinement& refinement) {
  return report.backward <= kRounding || report.residual <= refinement.tolerance;
}

bool usable(const SolveReport& report, const Refinement& refinement) {
  return report.backward <= 16 * kRounding ||
         report.residual <= std::max(refinement.tolerance, 1e-12);
}

void Refiner::analyse(const CscPattern& pattern) {
  pattern_ = &pattern;
  for (Vector* work : {&rhs, &residual_, &correction_, &trial_})
    work->resize(pattern.size);
}

void Refiner::take(const Vector& values) {
  values_ = &values;
  residual_.setZero();
  for_entries(*pattern_, values, [&](auto row, auto column, double value) {
    residual_[row] += std::abs(value);
    if (pattern_->lower && row != column) residual_[column] += std::abs(value);
  });
  norm_ = residual_.size() == 0 ? 0.0 : residual_.maxCoeff();
}

/// r = b − A x.
void Refiner::subtract_product(const Vector& x, const Vector& b, Vector& r) const {
  r = b;
  for_entries(*pattern_, *values_, [&](auto row, auto column, double value) {
    r[row] -= value * x[column];
    if (pattern_->lower && row != column) r[column] -= value * x[row];
  });
}

void Refiner::multiply(const Vector& x, Vector& y) const {
  y.setZero();
  for_entries(*pattern_, *values_, [&](auto row, auto column, double value) {
    y[row] += value * x[column];
    if (pattern_->lower && row != column) y[column] += value * x[row];
  });
}

SolveReport Refiner::measure(const Vector& x, int steps) const {
  const double scale = norm_ * x.lpNorm<Eigen::Infinity>() + rhs.lpNorm<Eigen::Infinity>();
  return {ratio(residual_.norm(), rhs.norm()), ratio(residual_.lpNorm<Eigen::Infinity>(), scale),
          steps};
}

SolveReport Refiner::correct(Backend& factor, MutableVector x, const Refinement& refinement) {
  factor.solve(rhs.data(), trial_.data());
  x = trial_;
  subtract_product(trial_, rhs, residual_);
  SolveReport report = measure(trial_, 0);
  while (report.steps < refinement.max_steps && !good_enough(report, refinement)) {
    factor.solve(residual_.data(), correction_.data());
    trial_ += correction_;
    subtract_product(trial_, rhs, residual_);
    const SolveReport next = measure(trial_, report.steps + 1);
    if (!(next.backward < report.backward)) break;
    const bool stalled = next.backward > report.backward / 2;
    x = trial_;
    report = next;
    if (stalled) break;
  }
  return report;
}

SolveReport Refiner::conjugate(Backend& factor, MutableVector x, const Refinement& refinement) {
  for (Vector* work : {&direction_, &image_, &before_})
    work->resize(rhs.size());
  trial_.setZero();
  residual_ = rhs;
  x.setZero();
  SolveReport report = measure(trial_, 0);
  while (report.steps < refinement.max_steps && !good_enough(report, refinement)) {
    const double goal = std::max(kGain, 0.5 * refinement.tolerance / report.residual);
    const int steps = gain(factor, goal, refinement.max_steps - report.steps);
    subtract_product(trial_, rhs, residual_);
    const SolveReport next = measure(trial_, report.steps + steps);
    if (!(next.residual < report.residual)) break;
    const bool stalled = next.residual > report.residual / 2;
    x = trial_;
    report = next;
    if (stalled) break;
  }
  return report;
}

/// trial += what at most `steps` conjugate gradients find for the residual; how many were made.
int Refiner::gain(Backend& factor, double goal, int steps) {
  const double begin = residual_.norm();
  double rho = 0.0;
  for (int step = 0; step < steps; ++step) {
    factor.solve(residual_.data(), correction_.data());
    const double fresh = residual_.dot(correction_);
    if (!(fresh > 0.0)) return step; // no longer positive definite to this precision
    if (step == 0)
      direction_ = correction_;
    else
      direction_ = correction_ + (fresh - before_.dot(correction_)) / rho * direction_;
    rho = fresh;
    multiply(direction_, image_);
    const double curvature = direction_.dot(image_);
    if (!(curvature > 0.0)) return step;
    const double length = residual_.dot(direction_) / curvature;
    trial_ += length * direction_;
    before_ = residual_;
    residual_ -= length * image_;
    if (residual_.norm() <= goal * begin) return step + 1;
  }
  return steps;
}

} // namespace supple
