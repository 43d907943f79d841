#include "supple/rig_uncertainty.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <Eigen/Cholesky>

#include "supple/error.hpp"

namespace supple {

using Index = Eigen::Index;

namespace {

constexpr Index kSums = 4, kBlock = 48;

/// L⁻¹, a block of columns at a time: it is 0 above the diagonal too.
Eigen::MatrixXd inverse_of_lower(const Eigen::MatrixXd& lower) {
  const Index n = lower.rows(), blocks = (n + kBlock - 1) / kBlock;
  Eigen::MatrixXd inverse = Eigen::MatrixXd::Identity(n, n);
#pragma omp parallel for schedule(dynamic, 1)
  for (Index b = 0; b < blocks; ++b) {
    const Index first = b * kBlock, below = n - first;
    auto columns = inverse.block(first, first, below, std::min(kBlock, below));
    lower.bottomRightCorner(below, below).triangularView<Eigen::Lower>().solveInPlace(columns);
  }
  return inverse;
}

} // namespace

ResidualRings residual_rings(const Points& points, const Eigen::VectorXd& residuals,
                             const Eigen::VectorXi& anchors, double width, int rings) {
  require_size("residuals", residuals.size(), points.rows(), "give one a point");
  if (anchors.size() > 0 && (anchors.minCoeff() < 0 || anchors.maxCoeff() >= points.rows()))
    throw ShapeError("anchors must name points; renumber them");
  const double far = width * rings, squared_far = far * far;
  const Eigen::VectorXd x = points.col(0), y = points.col(1), z = points.col(2);
  std::array<ResidualRings, kSums> sums;
#pragma omp parallel for schedule(static, 1)
  for (Index s = 0; s < kSums; ++s) {
    ResidualRings& sum = sums[static_cast<std::size_t>(s)];
    sum = {Eigen::VectorXd::Zero(rings), Eigen::VectorXd::Zero(rings)};
    Eigen::VectorXd squared(points.rows());
    for (Index k = s; k < anchors.size(); k += kSums) {
      const int a = anchors[k];
      squared =
          (x.array() - x[a]).square() + (y.array() - y[a]).square() + (z.array() - z[a]).square();
      for (Index i = 0; i < squared.size(); ++i) {
        if (squared[i] >= squared_far || i == a) continue;
        const Index ring = static_cast<Index>(std::sqrt(squared[i]) / width);
        if (ring >= rings) continue;
        sum.count[ring] += 1.0;
        sum.sum[ring] += residuals[a] * residuals[i];
      }
    }
  }
  for (std::size_t s = 1; s < kSums; ++s) {
    sums[0].count += sums[s].count;
    sums[0].sum += sums[s].sum;
  }
  return sums[0];
}

Eigen::MatrixXd inverse_sum(const SquareRef& data, const SquareRef& prior) {
  Eigen::MatrixXd whole = data + prior;
  const Eigen::VectorXd scale = whole.diagonal().cwiseMax(1e-300).cwiseSqrt().cwiseInverse();
  whole.array().colwise() *= scale.array();
  whole.array().rowwise() *= scale.transpose().array();
  const Eigen::LLT<Eigen::MatrixXd> factor(whole);
  if (factor.info() != Eigen::Success) return {};
  const Eigen::MatrixXd root = inverse_of_lower(factor.matrixLLT());
  const Index n = whole.rows(), blocks = (n + kBlock - 1) / kBlock;
#pragma omp parallel for schedule(dynamic, 1)
  for (Index b = 0; b < blocks; ++b) { // rootᵀ root, whose rows above a block's are 0 there
    const Index first = b * kBlock, width = std::min(kBlock, n - first);
    for (Index r = first; r < n; r += kBlock) {
      const Index height = std::min(kBlock, n - r);
      whole.block(r, first, height, width).noalias() =
          root.block(r, r, n - r, height).transpose() * root.block(r, first, n - r, width);
    }
  }
  whole.array().colwise() *= scale.array();
  whole.array().rowwise() *= scale.transpose().array();
  return whole.selfadjointView<Eigen::Lower>();
}

Eigen::MatrixXd inflated(const SquareRef& inverse, const SquareRef& prior, double inflation) {
  const Index n = inverse.rows();
  Eigen::MatrixXd pulled = Eigen::MatrixXd::Zero(n, n); // (1 − f) X P
  for (Index c = 0; c < n; ++c)
    for (Index r = 0; r < n; ++r)
      if (prior(r, c) != 0.0) pulled.col(c) += (1.0 - inflation) * prior(r, c) * inverse.col(r);
  Eigen::MatrixXd result = inflation * inverse;
  const Index blocks = (n + kBlock - 1) / kBlock;
#pragma omp parallel for schedule(dynamic, 1)
  for (Index b = 0; b < blocks; ++b) {
    const Index first = b * kBlock, width = std::min(kBlock, n - first);
    result.block(first, first, n - first, width).noalias() +=
        pulled.bottomRows(n - first) * inverse.middleCols(first, width);
  }
  return result.selfadjointView<Eigen::Lower>();
}

} // namespace supple
