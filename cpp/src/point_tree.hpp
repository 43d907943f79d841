/// Nearest point of a cloud, by a k-d tree; private to the runtime.
#pragma once

#include <algorithm>
#include <Eigen/Core>
#include <limits>
#include <numeric>
#include <vector>

#include "supple/closest_point.hpp"

namespace supple {

/// The tree's own order of the points is local in space: neighbours in it are near each other.
class PointTree {
 public:
  PointTree() = default;
  /// `points` (n, 3).
  explicit PointTree(const Points& points) : order_(static_cast<std::size_t>(points.rows())) {
    std::iota(order_.begin(), order_.end(), 0);
    if (!order_.empty()) build(points, 0, static_cast<int>(order_.size()));
    for (const int i : order_)
      points_.push_back(points.row(i).transpose());
  }

  /// Numbers of the points as they stand in the tree.
  const std::vector<int>& order() const { return order_; }

  struct Nearest {
    int point = -1; ///< −1: none within the limit
    double squared = std::numeric_limits<double>::infinity();
  };

  /// The nearest within √limit of q; ties go to the point that the tree comes by first.
  Nearest nearest(const Eigen::Vector3d& q, double limit) const {
    Nearest best{-1, limit};
    if (!nodes_.empty()) visit(0, q, best);
    return best;
  }

  /// use(first, last) for each leaf, whose points stand at first ≤ k < last in `order`.
  template <class Use>
  void each_leaf(const Use& use) const {
    for (const Node& node : nodes_)
      if (node.right < 0) use(node.begin, node.end);
  }

  /// The point that stands at k in `order`.
  const Eigen::Vector3d& at(int k) const { return points_[static_cast<std::size_t>(k)]; }

  /// use(k) for all places k in `order` of leaves that come within `radius` of the box, and so for
  /// all points that do.
  template <class Use>
  void near_box(const Eigen::Vector3d& low, const Eigen::Vector3d& high, double radius,
                const Use& use) const {
    if (!nodes_.empty()) visit_box(0, low, high, radius, use);
  }

  /// use(number of the point, its squared distance) for all within √limit of q.
  template <class Use>
  void within(const Eigen::Vector3d& q, double limit, const Use& use) const {
    if (!nodes_.empty()) visit_within(0, q, limit, use);
  }

 private:
  static constexpr int kLeaf = 8;
  struct Node {
    int begin, end;
    int right = -1; ///< the left child follows its parent; −1 of a leaf
    int axis = 0;
    double split = 0.0;
  };

  void build(const Points& points, int begin, int end) {
    const std::size_t self = nodes_.size();
    nodes_.push_back({begin, end});
    if (end - begin <= kLeaf) return;
    Eigen::Array3d low = Eigen::Array3d::Constant(std::numeric_limits<double>::infinity());
    Eigen::Array3d high = -low;
    for (int k = begin; k < end; ++k) {
      const Eigen::Array3d p = points.row(order_[static_cast<std::size_t>(k)]).transpose().array();
      low = low.min(p);
      high = high.max(p);
    }
    int axis = 0;
    (high - low).maxCoeff(&axis);
    const int middle = begin + (end - begin) / 2;
    std::nth_element(
        order_.begin() + begin, order_.begin() + middle, order_.begin() + end, [&](int i, int j) {
          return points(i, axis) != points(j, axis) ? points(i, axis) < points(j, axis) : i < j;
        });
    const double split = points(order_[static_cast<std::size_t>(middle)], axis);
    build(points, begin, middle);
    nodes_[self].right = static_cast<int>(nodes_.size());
    nodes_[self].axis = axis;
    nodes_[self].split = split;
    build(points, middle, end);
  }

  void visit(int number, const Eigen::Vector3d& q, Nearest& best) const {
    const Node& node = nodes_[static_cast<std::size_t>(number)];
    if (node.right < 0) {
      for (int k = node.begin; k < node.end; ++k) {
        const double squared = (points_[static_cast<std::size_t>(k)] - q).squaredNorm();
        if (squared < best.squared) best = {order_[static_cast<std::size_t>(k)], squared};
      }
      return;
    }
    const double offset = q[node.axis] - node.split;
    visit(offset < 0.0 ? number + 1 : node.right, q, best);
    if (offset * offset < best.squared) visit(offset < 0.0 ? node.right : number + 1, q, best);
  }

  template <class Use>
  void visit_within(int number, const Eigen::Vector3d& q, double limit, const Use& use) const {
    const Node& node = nodes_[static_cast<std::size_t>(number)];
    if (node.right < 0) {
      for (int k = node.begin; k < node.end; ++k) {
        const double squared = (points_[static_cast<std::size_t>(k)] - q).squaredNorm();
        if (squared <= limit) use(order_[static_cast<std::size_t>(k)], squared);
      }
      return;
    }
    const double offset = q[node.axis] - node.split;
    if (offset <= 0.0 || offset * offset <= limit) visit_within(number + 1, q, limit, use);
    if (offset >= 0.0 || offset * offset <= limit) visit_within(node.right, q, limit, use);
  }

  template <class Use>
  void visit_box(int number, const Eigen::Vector3d& low, const Eigen::Vector3d& high, double radius,
                 const Use& use) const {
    const Node& node = nodes_[static_cast<std::size_t>(number)];
    if (node.right < 0) {
      for (int k = node.begin; k < node.end; ++k)
        use(k);
      return;
    }
    if (low[node.axis] - radius <= node.split) visit_box(number + 1, low, high, radius, use);
    if (high[node.axis] + radius >= node.split) visit_box(node.right, low, high, radius, use);
  }

  std::vector<int> order_;
  std::vector<Eigen::Vector3d> points_;
  std::vector<Node> nodes_;
};

} // namespace supple
