/// Similarities that carry a scan onto a posed template, many candidates at once: a few steps each
/// from anywhere, with partners from a table of nearest vertices.
#pragma once

#include <Eigen/Geometry>
#include <vector>

#include "supple/closest_point.hpp"

namespace supple {

/// Shapes (S of them, of n vertices each) and which of its vertices is nearest to each place.
struct PoseShapes {
  int vertices = 0;        ///< n
  Points points, normals;  ///< (S n, 3) m and unit
  Eigen::VectorXi nearest; ///< (S cells) vertex of the shape, cells with z fastest
  Eigen::Vector3d origin;  ///< m, of the table
  Eigen::Vector3i counts;  ///< its cells along each axis
  double size = 0.03;      ///< m, of a cell
};

/// q = a R x + b from the scan to the template's frame, m; and the shape that it is compared with.
struct Similarity {
  Eigen::Matrix3d R;
  Eigen::Vector3d b;
  double a = 1.0;
  int shape = 0;
  double score = 0.0; ///< m
};

struct PoseRound {
  int steps = 5;
  double reach = 0.12;   ///< m: the residual that counts a quarter
  double size_sd = 0.08; ///< of bodies against the template
};

/// Damped Gauss–Newton steps of turn, shift and size of each candidate, then its score: the mean
/// distance, at most 8 cm a point, where a wrong side costs as much as 6 cm.
///
/// `points` (m, 3) m of the scan, `normals` (m, 3) unit, 0 where unknown, of a sign that means
/// something if `oriented`. Bitwise the same for any number of threads.
/// @throws ShapeError for arrays that do not fit.
/// Source: Chen, Medioni (1992), Image and Vision Computing 10(3), for the steps.
void descend(const PoseShapes& shapes, const Points& points, const Points& normals, bool oriented,
             const PoseRound& round, std::vector<Similarity>& candidates);

} // namespace supple
