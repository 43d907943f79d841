#include "supple/rig_uncertainty.hpp"

#include <cmath>
#include <Eigen/Cholesky>

#include "supple/error.hpp"

namespace supple {

using Index = Eigen::Index;

ResidualRings residual_rings(const Points& points, const Eigen::VectorXd& residuals,
                             const Eigen::VectorXi& anchors, double width, int rings) {
  require_size("residuals", residuals.size(), points.rows(), "give one a point");
  if (anchors.size() > 0 && (anchors.minCoeff() < 0 || anchors.maxCoeff() >= points.rows()))
    throw ShapeError("anchors must name points; renumber them");
  ResidualRings found{Eigen::VectorXd::Zero(rings), Eigen::VectorXd::Zero(rings)};
  const double far = width * rings, squared_far = far * far;
  const Eigen::VectorXd x = points.col(0), y = points.col(1), z = points.col(2);
  Eigen::VectorXd squared(points.rows());
  for (const int a : anchors) {
    squared =
        (x.array() - x[a]).square() + (y.array() - y[a]).square() + (z.array() - z[a]).square();
    for (Index i = 0; i < squared.size(); ++i) {
      if (squared[i] >= squared_far || i == a) continue;
      const Index ring = static_cast<Index>(std::sqrt(squared[i]) / width);
      if (ring >= rings) continue;
      found.count[ring] += 1.0;
      found.sum[ring] += residuals[a] * residuals[i];
    }
  }
  return found;
}

Eigen::MatrixXd inverse_sum(const Eigen::MatrixXd& data, const Eigen::MatrixXd& prior) {
  Eigen::MatrixXd whole = data + prior;
  const Eigen::VectorXd scale = whole.diagonal().cwiseMax(1e-300).cwiseSqrt().cwiseInverse();
  whole.array().colwise() *= scale.array();
  whole.array().rowwise() *= scale.transpose().array();
  const Eigen::LLT<Eigen::MatrixXd> factor(whole);
  if (factor.info() != Eigen::Success) return {};
  Eigen::MatrixXd root = Eigen::MatrixXd::Identity(whole.rows(), whole.cols());
  factor.matrixL().solveInPlace(root);
  whole.setZero();
  whole.selfadjointView<Eigen::Lower>().rankUpdate(root.transpose());
  whole.array().colwise() *= scale.array();
  whole.array().rowwise() *= scale.transpose().array();
  return whole.selfadjointView<Eigen::Lower>();
}

Eigen::MatrixXd inflated(const Eigen::MatrixXd& inverse, const Eigen::MatrixXd& prior,
                         double inflation) {
  const Index n = inverse.rows();
  Eigen::MatrixXd pulled = Eigen::MatrixXd::Zero(n, n); // (1 − f) X P
  for (Index c = 0; c < n; ++c)
    for (Index r = 0; r < n; ++r)
      if (prior(r, c) != 0.0) pulled.col(c) += (1.0 - inflation) * prior(r, c) * inverse.col(r);
  Eigen::MatrixXd result = inflation * inverse;
  result.triangularView<Eigen::Lower>() += pulled * inverse;
  return result.selfadjointView<Eigen::Lower>();
}

} // namespace supple
