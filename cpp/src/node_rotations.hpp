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

  /// @param points (3n) at rest, m; kept by reference, as `graph` is.
  NodeRotations(const NodeGraph& graph, const Reduction& reduction, const Vector& points);

  /// Rotations from rest to `u` (dofs).
  Rotations at(const ConstVector& u) const;
  /// x := Q x, block by block (unknowns).
  void turn(const Rotations& q, Vector& x) const;
  /// y = Qᵀ x, both (unknowns) and not the same.
  void turn_back(const Rotations& q, const Vector& x, Vector& y) const;

  /// The way d (dofs) from `u` with the turn that it makes: each node goes on along an arc, its
  /// velocity turning with the curl of d there, instead of straight on, which stretches what turns.
  /// For a short way it differs from d by its square.
  /// Source: Choi and Ko (2005), IEEE TVCG 11(1), eq. 22.
  Vector along_arcs(const ConstVector& u, const ConstVector& d) const;

 private:
  struct Node {
    Index node, unknown; ///< its first of three
  };
  Eigen::Matrix3d gradient(Index node, const Vector& place, const double* way) const;

  const NodeGraph* graph_;
  const Vector* points_;
  std::vector<Node> nodes_;
};

} // namespace supple
