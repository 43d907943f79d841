#include "node_rotations.hpp"

#include <cmath>

namespace supple {
namespace {

constexpr int kMostSteps = 20;
constexpr std::ptrdiff_t kWorthThreads = 10'000; // nodes
constexpr double kStraight = 1e-6;               // angle below which an arc is none
constexpr double kNear = 1e-3; // a last step, which leaves its square: enough to precondition with

/// Σ b aᵀ about the means of n vectors, from the sums.
class Mixed {
 public:
  void add(const double* a, const double* b) {
    for (int j = 0; j < 3; ++j) {
      a_[j] += a[j];
      b_[j] += b[j];
      for (int i = 0; i < 3; ++i)
        product_[3 * j + i] += b[i] * a[j];
    }
  }
  Eigen::Matrix3d about_means(Index n) const {
    using Three = Eigen::Map<const Eigen::Vector3d>;
    return Eigen::Map<const Eigen::Matrix3d>(product_) -
           Three(b_) * Three(a_).transpose() / static_cast<double>(n);
  }

 private:
  double product_[9] = {}, a_[3] = {}, b_[3] = {};
};

/// Orthogonal polar factor by Newton's iteration with scaling; the identity where there is none.
/// Source: Higham (1986), SIAM J. Sci. Stat. Comput. 7(4), §3.
Eigen::Matrix3d polar(Eigen::Matrix3d m) {
  for (int step = 0; step < kMostSteps; ++step) {
    const double det = m.determinant();
    if (!(det > 0.0)) break;
    const Eigen::Matrix3d inverse = m.inverse().transpose();
    const double scale = std::sqrt(inverse.norm() / m.norm());
    const Eigen::Matrix3d next = 0.5 * (scale * m + inverse / scale);
    const bool done = (next - m).norm() <= kNear * next.norm();
    m = next;
    if (done) return m;
  }
  return Eigen::Matrix3d::Identity();
}

} // namespace

NodeRotations::NodeRotations(const NodeGraph& graph, const Reduction& reduction,
                             const Vector& points)
    : graph_(&graph), points_(&points) {
  for (Index a = 0; a < graph.nodes; ++a) {
    const auto dof = static_cast<std::size_t>(3 * a);
    const Index first = reduction.unknown[dof];
    if (first >= 0 && reduction.unknown[dof + 1] >= 0 && reduction.unknown[dof + 2] >= 0)
      nodes_.push_back({a, first});
  }
}

NodeRotations::Rotations NodeRotations::at(const ConstVector& u) const {
  const double *const rest = points_->data(), *const way = u.data();
  Rotations result(nodes_.size());
  const auto count = static_cast<std::ptrdiff_t>(nodes_.size());
#pragma omp parallel for if (count > kWorthThreads)
  for (std::ptrdiff_t k = 0; k < count; ++k) {
    const Index node = nodes_[static_cast<std::size_t>(k)].node;
    const double *const a0 = rest + 3 * node, *const d0 = way + 3 * node;
    Mixed sum;
    Index neighbours = 0;
    for (Index e = graph_->node_start[static_cast<std::size_t>(node)];
         e < graph_->node_start[static_cast<std::size_t>(node) + 1]; ++e, ++neighbours) {
      const Index other = graph_->neighbour[static_cast<std::size_t>(e)];
      if (other >= graph_->nodes) break; // scalars come last
      const double *const a1 = rest + 3 * other, *const d1 = way + 3 * other;
      const double a[3] = {a1[0] - a0[0], a1[1] - a0[1], a1[2] - a0[2]};
      const double b[3] = {a[0] + d1[0] - d0[0], a[1] + d1[1] - d0[1], a[2] + d1[2] - d0[2]};
      sum.add(a, b);
    }
    result[static_cast<std::size_t>(k)] = polar(sum.about_means(neighbours));
  }
  return result;
}

/// Velocity's gradient at a node that moves by d: least squares over its neighbours.
Eigen::Matrix3d NodeRotations::gradient(Index node, const Vector& place, const double* way) const {
  const auto first = static_cast<std::size_t>(node);
  const double *const x0 = place.data() + 3 * node, *const d0 = way + 3 * node;
  Mixed mixed, own;
  Index count = 0;
  for (Index e = graph_->node_start[first]; e < graph_->node_start[first + 1]; ++e, ++count) {
    const Index other = graph_->neighbour[static_cast<std::size_t>(e)];
    if (other >= graph_->nodes) break; // scalars come last
    const double *const x1 = place.data() + 3 * other, *const d1 = way + 3 * other;
    const double a[3] = {x1[0] - x0[0], x1[1] - x0[1], x1[2] - x0[2]};
    const double b[3] = {d1[0] - d0[0], d1[1] - d0[1], d1[2] - d0[2]};
    mixed.add(a, b);
    own.add(a, a);
  }
  return mixed.about_means(count) * own.about_means(count).inverse();
}

Vector NodeRotations::along_arcs(const ConstVector& u, const ConstVector& d) const {
  const Vector place = *points_ + u.head(points_->size());
  Vector result = d;
  for (const Node& n : nodes_) {
    const Eigen::Matrix3d slope = gradient(n.node, place, d.data());
    const Eigen::Vector3d curl(slope(2, 1) - slope(1, 2), slope(0, 2) - slope(2, 0),
                               slope(1, 0) - slope(0, 1));
    const double angle = 0.5 * curl.norm();
    if (!(angle > kStraight) || !std::isfinite(angle)) continue;
    const Eigen::Vector3d axis = curl.normalized(), v = d.segment<3>(3 * n.node);
    const Eigen::Vector3d across = axis.cross(v);
    result.segment<3>(3 * n.node) += (1.0 - std::cos(angle)) / angle * across +
                                     (1.0 - std::sin(angle) / angle) * axis.cross(across);
  }
  return result;
}

void NodeRotations::turn(const Rotations& q, Vector& x) const {
  for (std::size_t k = 0; k < nodes_.size(); ++k)
    x.segment<3>(nodes_[k].unknown) = (q[k] * x.segment<3>(nodes_[k].unknown)).eval();
}

void NodeRotations::turn_back(const Rotations& q, const Vector& x, Vector& y) const {
  y = x;
  for (std::size_t k = 0; k < nodes_.size(); ++k)
    y.segment<3>(nodes_[k].unknown) = q[k].transpose() * x.segment<3>(nodes_[k].unknown);
}

} // namespace supple
