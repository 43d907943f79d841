/// How sure a fit is: what its residuals share with their neighbours', and the spread of its
/// unknowns. Bitwise the same for any number of threads.
#pragma once

#include <Eigen/Core>

#include "supple/closest_point.hpp"

namespace supple {

/// Products of residuals by distance, in rings of one width.
struct ResidualRings {
  Eigen::VectorXd count; ///< (rings) pairs
  Eigen::VectorXd sum;   ///< (rings) m², of their products
};

/// Pairs of each of `anchors` (a) with all of `points` (c, 3) m but itself, whose `residuals` (c)
/// are in m. @throws ShapeError if sizes do not fit or an anchor names no point.
ResidualRings residual_rings(const Points& points, const Eigen::VectorXd& residuals,
                             const Eigen::VectorXi& anchors, double width, int rings);

/// A matrix of all unknowns, which is large: read where it is.
using SquareRef = Eigen::Ref<const Eigen::MatrixXd>;

/// (D + P)⁻¹, its unknowns scaled to a unit diagonal first; 0 × 0 where it is not positive
/// definite.
Eigen::MatrixXd inverse_sum(const SquareRef& data, const SquareRef& prior);

/// f X + (1 − f) X P X, X = (D + P)⁻¹: the covariance X (f D + P) X. P may be sparse.
Eigen::MatrixXd inflated(const SquareRef& inverse, const SquareRef& prior, double inflation);

} // namespace supple
