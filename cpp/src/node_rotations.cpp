#include "node_rotations.hpp"

namespace supple {
namespace {

constexpr int kMostSteps = 20;
constexpr double kNear = 1e-6; // more is not needed of a preconditioner, it only must stay regular

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

NodeRotations::NodeRotations(const BlockPattern& pattern, const Reduction& reduction,
                             const Vector& points)
    : pattern_(&pattern), points_(&points) {
  for (Index a = 0; a < pattern.nodes; ++a) {
    const auto dof = static_cast<std::size_t>(3 * a);
    const Index first = reduction.unknown[dof];
    if (first >= 0 && reduction.unknown[dof + 1] >= 0 && reduction.unknown[dof + 2] >= 0)
      nodes_.push_back({a, first});
  }
}

Eigen::Matrix3d NodeRotations::moments(Index node, const ConstVector& u) const {
  const auto a = static_cast<std::size_t>(node);
  Eigen::Matrix3d sum = Eigen::Matrix3d::Zero();
  Eigen::Vector3d rest = Eigen::Vector3d::Zero(), moved = rest;
  Index count = 0;
  for (Index k = pattern_->node_start[a]; k < pattern_->node_start[a + 1]; ++k) {
    const Index b = pattern_->neighbour[static_cast<std::size_t>(k)];
    if (b >= pattern_->nodes) break; // scalars come last
    const Eigen::Vector3d from = points_->segment<3>(3 * b) - points_->segment<3>(3 * node);
    const Eigen::Vector3d to = from + u.segment<3>(3 * b) - u.segment<3>(3 * node);
    sum += to * from.transpose();
    rest += from;
    moved += to;
    ++count;
  }
  return sum - moved * rest.transpose() / static_cast<double>(count);
}

NodeRotations::Rotations NodeRotations::at(const ConstVector& u) const {
  Rotations result;
  result.reserve(nodes_.size());
  for (const Node& n : nodes_)
    result.push_back(polar(moments(n.node, u)));
  return result;
}

void NodeRotations::turn(const Rotations& from, const Rotations& to, const Vector& x,
                         Vector& y) const {
  if (&x != &y) y = x;
  for (std::size_t k = 0; k < nodes_.size(); ++k) {
    const Eigen::Vector3d v = from[k].transpose() * x.segment<3>(nodes_[k].unknown);
    y.segment<3>(nodes_[k].unknown) = to[k] * v;
  }
}

} // namespace supple
