/// Nodes that slide without friction on a rigid triangle surface, held to it by springs.
#pragma once

#include <memory>
#include <vector>

#include "supple/closest_point.hpp"
#include "supple/term.hpp"

namespace supple {

/// Direct: energy Σ k d²/2, d the distance of x = X + u to the surface; the force points along the
/// normal. Its Hessian is k n⊗n over a face, k (I − t⊗t) at an edge, k I at a vertex, all exact.
///
/// Inverse: the mesh is the loaded shape x, the unknown is X = x + u'. The reaction acts along the
/// normal n(x) at the loaded point, and its size k g(X) holds the rest point on the surface too.
class Sliding final : public Term {
 public:
  /// @param points (3n) mesh coordinates, m. @param stiffness (nodes) N/m, > 0.
  /// @throws ShapeError on sizes or node numbers.
  Sliding(std::shared_ptr<const Vector> points, std::vector<Index> nodes, Vector stiffness,
          const Points& vertices, const Triangles& triangles, bool inverse);

  const Connectivity& cells() const override { return cells_; }
  bool has_energy() const override { return !inverse_; }
  bool symmetric() const override { return !inverse_; }
  double energy(const ConstVector& u) const override;
  void residual(const ConstVector& u, double scale, MutableVector r) const override;
  void tangent(const ConstVector& u, double scale, const Scatter& map,
               MutableVector values) const override;
  void tangent(const ConstVector& u, double scale, const LowerScatter& map,
               MutableVector values) const override;
  VolumeRatio volume_ratio(const ConstVector&) const override { return {}; }

 private:
  /// Where the moved nodes land.
  Projection land(const ConstVector& u, Points& moved) const;
  /// Tangent of node i over its stiffness.
  Eigen::Matrix3d stiffness_block(const Projection& at, Eigen::Index i) const;
  /// Call use(i, scale · tangent of node i, row-major) for each node.
  template <class Use>
  void each_block(const ConstVector& u, double scale, Use use) const;

  std::shared_ptr<const Vector> points_;
  std::vector<Index> nodes_;
  Vector stiffness_;
  Points vertices_;
  Triangles triangles_;
  SurfaceTree surface_;
  bool inverse_;
  Connectivity cells_; // one node each
  Points loaded_normal_;
};

} // namespace supple
