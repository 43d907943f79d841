/// Nearest point of a cloud, by a k-d tree; private to the runtime.
#pragma once

#include <algorithm>
#include <Eigen/Core>
#include <limits>
#include <vector>

#include "supple/closest_point.hpp"

namespace supple {

/// The tree's own order of the points is local in space: neighbours in it are near each other.
class PointTree {
 public:
  PointTree() = default;
  /// `points` (n, 3).
  explicit PointTree(const Points& points) {
    std::vector<Entry> entries;
    entries.reserve(static_cast<std::size_t>(points.rows()));
    for (Eigen::Index i = 0; i < points.rows(); ++i)
      entries.push_back({points.row(i).transpose(), static_cast<int>(i)});
    nodes_.resize(entries.empty() ? 0 : static_cast<std::size_t>(nodes_of(points.rows())));
#pragma omp parallel if (entries.size() > kTask)
#pragma omp single
    if (!entries.empty()) build(entries, 0, static_cast<int>(entries.size()), 0);
    for (const Entry& entry : entries) {
      points_.push_back(entry.at);
      order_.push_back(entry.number);
    }
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

  struct Entry {
    Eigen::Vector3d at;
    int number;
  };
  static constexpr std::size_t kTask = 512; ///< points that are worth a thread of their own

  /// Nodes of a tree of so many points.
  static Eigen::Index nodes_of(Eigen::Index points) {
    return points <= kLeaf ? 1 : 1 + nodes_of(points / 2) + nodes_of(points - points / 2);
  }

  /// The tree of a range, from node `self` on: what halves it does not depend on the threads.
  void build(std::vector<Entry>& entries, int begin, int end, std::size_t self) {
    Node& node = nodes_[self];
    node = {begin, end};
    if (end - begin <= kLeaf) return;
    Eigen::Array3d low = Eigen::Array3d::Constant(std::numeric_limits<double>::infinity());
    Eigen::Array3d high = -low;
    for (int k = begin; k < end; ++k) {
      low = low.min(entries[static_cast<std::size_t>(k)].at.array());
      high = high.max(entries[static_cast<std::size_t>(k)].at.array());
    }
    (high - low).maxCoeff(&node.axis);
    const int middle = begin + (end - begin) / 2, axis = node.axis;
    std::nth_element(entries.begin() + begin, entries.begin() + middle, entries.begin() + end,
                     [axis](const Entry& a, const Entry& b) {
                       return a.at[axis] != b.at[axis] ? a.at[axis] < b.at[axis]
                                                       : a.number < b.number;
                     });
    node.split = entries[static_cast<std::size_t>(middle)].at[axis];
    const std::size_t right = self + 1 + static_cast<std::size_t>(nodes_of(middle - begin));
    node.right = static_cast<int>(right);
#pragma omp task shared(entries) if (static_cast<std::size_t>(end - begin) > kTask)
    build(entries, begin, middle, self + 1);
    build(entries, middle, end, right);
#pragma omp taskwait
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
