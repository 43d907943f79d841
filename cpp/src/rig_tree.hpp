/// Closest point on a skin that moves from one query to the next; private to the runtime.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "supple/closest_point.hpp"

namespace supple {

/// Where a point lands; triangle −1: nothing is within reach.
struct Landing {
  int triangle = -1;
  Eigen::Vector3d barycentric = Eigen::Vector3d::Zero(); ///< exactly 0 of corners that do not count
  double squared = 0.0;                                  ///< m², of the distance
  int leaf = -1;                                         ///< a hint for the next time
};

/// A box tree that keeps its shape when its vertices move: eight triangles a leaf, which are
/// measured at once. `SurfaceTree` is the one for surfaces at rest, with exact ties.
class SkinTree {
 public:
  /// `points` (n, 3) m, `triangles` (t, 3), t > 0.
  SkinTree(const Points& points, const Triangles& triangles);

  /// The same triangles with their vertices at `points`; O(t).
  void refit(const Points& points);

  /// Nearest within `reach` m of q; `hint` is a leaf that is probably near, −1 if none is known.
  Landing closest(const Eigen::Vector3d& q, double reach, int hint) const;

 private:
  static constexpr int kLanes = 8;
  using Lanes = double __attribute__((vector_size(8 * kLanes)));
  struct Leaf {
    Lanes a[3], ab[3], ac[3];        ///< corner and edges
    Lanes bb, bc, cc;                ///< products of ab, ac
    Lanes inverse;                   ///< 1/(bb cc − bc²), 0 of a triangle without area
    Lanes of_bb, of_cc, of_opposite; ///< 1/|edge|²
    int triangle[kLanes];
  };
  struct Box {
    double low[3], high[3];
  };
  struct Node {
    Box box;
    int right = -1; ///< the left child follows its parent
    int leaf = -1;
  };
  /// Three levels of nodes in one, whose boxes are measured at once; lanes that are left are empty.
  struct Wide {
    Lanes low[3], high[3];
    int node[kLanes];  ///< whose box a lane has, −1
    int child[kLanes]; ///< a wide node, or ~leaf
    void measure(const Eigen::Vector3d& q, Lanes& squared) const;
  };

  void build(const Points& points, int begin, int end);
  int widen(int node);
  void refit_leaf(const Points& points, Node& node);
  void fill(const Points& points, Leaf& leaf) const;
  void fill(Wide& wide) const;
  void visit(const Eigen::Vector3d& q, int leaf, Landing& best) const;

  Triangles triangles_;
  std::vector<int> order_;
  std::vector<Node> nodes_;
  std::vector<Wide> wide_;
  std::vector<Leaf> leaves_;
};

} // namespace supple
