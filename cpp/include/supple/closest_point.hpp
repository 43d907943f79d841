/// Closest point on a triangle surface.
#pragma once

#include <cstdint>
#include <Eigen/Core>
#include <memory>

namespace supple {

using Points = Eigen::Matrix<double, Eigen::Dynamic, 3, Eigen::RowMajor>;
using Triangles = Eigen::Matrix<std::int32_t, Eigen::Dynamic, 3, Eigen::RowMajor>;

/// Where each query point lands on a triangle surface; row i answers query i.
struct Projection {
  Points point;             ///< (n, 3) nearest surface points, m
  Eigen::VectorXi triangle; ///< (n) row of `triangles` that holds each point
  Eigen::VectorXd distance; ///< (n) unsigned distance, m
  Eigen::VectorXi feature;  ///< (n) the point is inside 0 a face, 1 an edge, 2 at a vertex
  Points normal;      ///< (n, 3) unit normal of that triangle, right-handed; 0 if it has no area
  Points barycentric; ///< (n, 3) weights of that triangle's vertices, ≥ 0, sum 1
};

/// A triangle surface with its box tree, made once and asked often.
class SurfaceTree {
 public:
  /// `vertices` (v, 3) m and `triangles` (t, 3); cost O(t log t).
  /// @throws ShapeError if t == 0 or a triangle names a vertex outside [0, v);
  ///         NumericalError if a vertex is not finite.
  SurfaceTree(const Points& vertices, const Triangles& triangles);
  SurfaceTree(SurfaceTree&&) noexcept;
  SurfaceTree& operator=(SurfaceTree&&) noexcept;
  ~SurfaceTree();

  /// Project `query` (n, 3) m onto the surface; O(log t) a point, in parallel.
  ///
  /// Ties go to the lowest triangle number, so the answer does not depend on the thread count.
  /// @throws NumericalError if a query is not finite.
  /// Source: Ericson (2005), Real-Time Collision Detection, §5.1.5.
  Projection closest(const Points& query) const;

 private:
  struct Tree;
  std::unique_ptr<Tree> tree_;
};

/// One-off form of SurfaceTree::closest.
Projection closest_points(const Points& query, const Points& vertices, const Triangles& triangles);

} // namespace supple
