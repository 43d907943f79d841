/// How the nodes of a mesh have turned; private to the runtime.
///
/// A node's rotation is the orthogonal factor of the least-squares motion of its neighbours:
/// Σ (x_b − x̄)(X_b − X̄)ᵀ = R S. Nodes that a support holds in part do not turn.
#pragma once

#include <Eigen/Dense>
#include <vector>

#include "supple/sparse.hpp"

namespace supple {

class NodeRotations {
 public:
  using Rotations = std::vector<Eigen::Matrix3d>; ///< one a node that is free in all directions

  /// @param points (3n) at rest, m; kept by reference, as `pattern` is.
  NodeRotations(const BlockPattern& pattern, const Reduction& reduction, const Vector& points);

  /// Rotations from rest to `u` (dofs).
  Rotations at(const ConstVector& u) const;
  /// y = Q x, Q = `to` `from`ᵀ of each node; or Qᵀ x. (unknowns), y may be x.
  void turn(const Rotations& from, const Rotations& to, const Vector& x, Vector& y) const;

 private:
  struct Node {
    Index node, unknown; ///< its first of three
  };
  Eigen::Matrix3d moments(Index node, const ConstVector& u) const;

  const BlockPattern* pattern_;
  const Vector* points_;
  std::vector<Node> nodes_;
};

} // namespace supple
