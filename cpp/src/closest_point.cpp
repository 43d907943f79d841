#include "supple/closest_point.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <Eigen/Geometry>
#include <limits>
#include <numeric>
#include <string>
#include <utility>
#include <vector>

#include "supple/error.hpp"

namespace supple {
namespace {

using Vec3 = Eigen::Vector3d;
constexpr double kRounding = 4 * std::numeric_limits<double>::epsilon();

/// The nearest point found so far.
struct Hit {
  double squared = std::numeric_limits<double>::infinity();
  Vec3 point = Vec3::Zero();
  Vec3 weights = Vec3::Zero();
  int triangle = -1;
  int feature = 0;

  bool better_than(const Hit& other) const {
    return squared < other.squared || (squared == other.squared && triangle < other.triangle);
  }
};

struct Corner {
  Vec3 point;
  int vertex = 0; ///< its number, which makes an edge the same from both of its triangles
};

/// Nearest point of the edge between corners `i` and `j`, measured from the lower vertex number, so
/// that the triangles on its two sides get the same bits and a tie is a tie.
Hit closest_on_edge(const Vec3& q, const std::array<Corner, 3>& corner, int i, int j) {
  if (corner[static_cast<std::size_t>(j)].vertex < corner[static_cast<std::size_t>(i)].vertex)
    std::swap(i, j);
  const Vec3& a = corner[static_cast<std::size_t>(i)].point;
  const Vec3& b = corner[static_cast<std::size_t>(j)].point;
  const Vec3 ab = b - a;
  const double length2 = ab.squaredNorm();
  double t = length2 > 0.0 ? ab.dot(q - a) / length2 : 0.0;
  if (!(t > kRounding)) t = 0.0;
  if (t > 1.0 - kRounding) t = 1.0;
  Hit hit;
  hit.feature = t == 0.0 || t == 1.0 ? 2 : 1;
  hit.point = t == 0.0 ? a : t == 1.0 ? b : Vec3(a + t * ab);
  hit.weights[i] = 1.0 - t;
  hit.weights[j] = t;
  hit.squared = (q - hit.point).squaredNorm();
  return hit;
}

/// Nearest point of a triangle: inside where q projects inside, else the best of the three edges. A
/// sliver's weights are not to be trusted, so its edges are asked as well.
/// Source: Ericson (2005), Real-Time Collision Detection, §5.1.5.
Hit closest_on_triangle(const Vec3& q, const std::array<Corner, 3>& corner) {
  const Vec3 ab = corner[1].point - corner[0].point;
  const Vec3 ac = corner[2].point - corner[0].point;
  const Vec3 aq = q - corner[0].point;
  const Vec3 normal = ab.cross(ac);
  const double area2 = normal.squaredNorm();
  const double longest2 = std::max({ab.squaredNorm(), ac.squaredNorm(), (ac - ab).squaredNorm()});
  Hit best;
  if (area2 > 1e-26 * longest2 * longest2) {
    const double v = normal.dot(aq.cross(ac)) / area2;
    const double w = normal.dot(ab.cross(aq)) / area2;
    const Vec3 weights(1.0 - v - w, v, w);
    if (weights.minCoeff() > kRounding) {
      best.point = corner[0].point + v * ab + w * ac;
      best.weights = weights;
      best.squared = (q - best.point).squaredNorm();
      if (area2 > 1e-8 * longest2 * longest2) return best;
    }
  }
  for (const auto& [i, j] : {std::pair{0, 1}, std::pair{1, 2}, std::pair{2, 0}}) {
    const Hit hit = closest_on_edge(q, corner, i, j);
    if (hit.squared < best.squared) best = hit;
  }
  return best;
}

/// Axis-aligned box; `grow` adds the rounding of a point that is computed on what it holds.
struct Box {
  Eigen::Array3d low = Eigen::Array3d::Constant(std::numeric_limits<double>::infinity());
  Eigen::Array3d high = -low;

  void add(const Box& other) {
    low = low.min(other.low);
    high = high.max(other.high);
  }
  void add(const Vec3& point) {
    low = low.min(point.array());
    high = high.max(point.array());
  }
  void grow() {
    const double slack = kRounding * std::max(low.abs().maxCoeff(), high.abs().maxCoeff());
    low -= slack;
    high += slack;
  }
  double squared_distance(const Vec3& q) const {
    return (low - q.array()).max(q.array() - high).max(0.0).matrix().squaredNorm();
  }
};

/// A box with two children, or with the triangles order[begin … end) if it is a leaf.
struct Node {
  Box box;
  int begin = 0, end = 0;
  int right = -1; ///< second child; the first one follows its parent; −1 for a leaf
};

} // namespace

struct SurfaceTree::Tree {
  Points vertices;
  Triangles triangles;
  std::vector<int> order;
  std::vector<Node> nodes;

  std::array<Corner, 3> corners(int t) const {
    std::array<Corner, 3> corner;
    for (int k = 0; k < 3; ++k) {
      const int v = triangles(t, k);
      corner[static_cast<std::size_t>(k)] = {vertices.row(v).transpose(), v};
    }
    return corner;
  }

  Box box_of(int t) const {
    Box box;
    for (const Corner& corner : corners(t))
      box.add(corner.point);
    return box;
  }

  /// Append the subtree of order[begin … end): halves at the median of the longest side's
  /// centroids.
  void build(int begin, int end) {
    constexpr int leaf = 4;
    Node node;
    Box centres;
    for (int k = begin; k < end; ++k) {
      const Box box = box_of(order[static_cast<std::size_t>(k)]);
      node.box.add(box);
      centres.add(Vec3((box.low + box.high).matrix() / 2));
    }
    node.box.grow();
    node.begin = begin;
    node.end = end;
    const std::size_t self = nodes.size();
    nodes.push_back(node);
    if (end - begin <= leaf) return;
    const int middle = split(begin, end, centres);
    build(begin, middle);
    nodes[self].right = static_cast<int>(nodes.size());
    build(middle, end);
  }

  int split(int begin, int end, const Box& centres) {
    Eigen::Index axis = 0;
    (centres.high - centres.low).maxCoeff(&axis);
    const auto key = [&](int t) {
      const Box box = box_of(t);
      return std::pair{box.low[axis] + box.high[axis], t};
    };
    const int middle = begin + (end - begin) / 2;
    std::nth_element(order.begin() + begin, order.begin() + middle, order.begin() + end,
                     [&](int s, int t) { return key(s) < key(t); });
    return middle;
  }

  /// Nearer children first; a box as far as the best hit is still opened, for the sake of ties.
  Hit closest(const Vec3& q) const {
    Hit best;
    std::array<std::pair<double, int>, 64> stack; // depth ≤ 32: every split halves
    std::size_t top = 0;
    stack[top++] = {nodes[0].box.squared_distance(q), 0};
    while (top > 0) {
      const auto [distance, number] = stack[--top];
      if (distance > best.squared) continue;
      const Node& node = nodes[static_cast<std::size_t>(number)];
      if (node.right < 0) {
        visit_leaf(q, node, best);
        continue;
      }
      std::pair<double, int> near{child_distance(q, number + 1), number + 1};
      std::pair<double, int> far{child_distance(q, node.right), node.right};
      if (far.first < near.first) std::swap(near, far);
      stack[top++] = far;
      stack[top++] = near;
    }
    return best;
  }

  double child_distance(const Vec3& q, int number) const {
    return nodes[static_cast<std::size_t>(number)].box.squared_distance(q);
  }

  void visit_leaf(const Vec3& q, const Node& node, Hit& best) const {
    for (int k = node.begin; k < node.end; ++k) {
      const int t = order[static_cast<std::size_t>(k)];
      Hit hit = closest_on_triangle(q, corners(t));
      hit.triangle = t;
      if (hit.better_than(best)) best = hit;
    }
  }

  Vec3 normal(int t) const {
    const std::array<Corner, 3> corner = corners(t);
    return (corner[1].point - corner[0].point)
        .cross(corner[2].point - corner[0].point)
        .stableNormalized();
  }
};

namespace {

void check_surface(const Points& vertices, const Triangles& triangles) {
  if (triangles.rows() == 0)
    throw ShapeError(
        "triangles must have at least one row, got none; give a surface with triangles");
  if (triangles.minCoeff() < 0 || triangles.maxCoeff() >= vertices.rows())
    throw ShapeError("triangles must name vertices from 0 to " +
                     std::to_string(vertices.rows() - 1) + ", got " +
                     std::to_string(triangles.minCoeff()) + " to " +
                     std::to_string(triangles.maxCoeff()) + "; renumber the triangles");
  if (!vertices.allFinite())
    throw NumericalError("vertices must be finite, got NaN or infinity; repair the surface");
}

} // namespace

SurfaceTree::SurfaceTree(const Points& vertices, const Triangles& triangles) {
  check_surface(vertices, triangles);
  tree_ = std::make_unique<Tree>();
  tree_->vertices = vertices;
  tree_->triangles = triangles;
  tree_->order.resize(static_cast<std::size_t>(triangles.rows()));
  std::iota(tree_->order.begin(), tree_->order.end(), 0);
  tree_->build(0, static_cast<int>(triangles.rows()));
}
SurfaceTree::SurfaceTree(SurfaceTree&&) noexcept = default;
SurfaceTree& SurfaceTree::operator=(SurfaceTree&&) noexcept = default;
SurfaceTree::~SurfaceTree() = default;

Projection SurfaceTree::closest(const Points& query) const {
  if (!query.allFinite())
    throw NumericalError("query must be finite, got NaN or infinity; look at the points given");
  const Eigen::Index n = query.rows();
  Projection result{Points(n, 3),       Eigen::VectorXi(n), Eigen::VectorXd(n),
                    Eigen::VectorXi(n), Points(n, 3),       Points(n, 3)};
#pragma omp parallel for schedule(dynamic, 64)
  for (Eigen::Index i = 0; i < n; ++i) {
    const Hit hit = tree_->closest(query.row(i).transpose());
    result.point.row(i) = hit.point.transpose();
    result.triangle[i] = hit.triangle;
    result.distance[i] = std::sqrt(hit.squared);
    result.feature[i] = hit.feature;
    result.normal.row(i) = tree_->normal(hit.triangle).transpose();
    result.barycentric.row(i) = hit.weights.transpose();
  }
  return result;
}

Projection closest_points(const Points& query, const Points& vertices, const Triangles& triangles) {
  return SurfaceTree(vertices, triangles).closest(query);
}

} // namespace supple
