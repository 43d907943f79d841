#include "node_rotations.hpp"

#include <cmath>

namespace supple {
namespace {

constexpr int kMostSteps = 20;
constexpr double kStraight = 1e-6; // angle below which an arc is none
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

template <class PlaceA, class PlaceB>
NodeRotations::Moments NodeRotations::moments(Index node, PlaceA place_a, PlaceB place_b) const {
  const auto first = static_cast<std::size_t>(node);
  Moments sum{Eigen::Matrix3d::Zero(), Eigen::Matrix3d::Zero()};
  const Eigen::Vector3d a0 = place_a(node), b0 = place_b(node);
  Eigen::Vector3d sum_a = Eigen::Vector3d::Zero(), sum_b = sum_a;
  Index count = 0;
  for (Index k = pattern_->node_start[first]; k < pattern_->node_start[first + 1]; ++k) {
    const Index other = pattern_->neighbour[static_cast<std::size_t>(k)];
    if (other >= pattern_->nodes) break; // scalars come last
    const Eigen::Vector3d a = place_a(other) - a0, b = place_b(other) - b0;
    sum.mixed += b * a.transpose();
    sum.own += a * a.transpose();
    sum_a += a;
    sum_b += b;
    ++count;
  }
  sum.mixed -= sum_b * sum_a.transpose() / static_cast<double>(count);
  sum.own -= sum_a * sum_a.transpose() / static_cast<double>(count);
  return sum;
}

NodeRotations::Rotations NodeRotations::at(const ConstVector& u) const {
  const auto rest = [&](Index a) -> Eigen::Vector3d { return points_->segment<3>(3 * a); };
  const auto moved = [&](Index a) -> Eigen::Vector3d { return rest(a) + u.segment<3>(3 * a); };
  Rotations result;
  result.reserve(nodes_.size());
  for (const Node& n : nodes_)
    result.push_back(polar(moments(n.node, rest, moved).mixed));
  return result;
}

Vector NodeRotations::along_arcs(const ConstVector& u, const ConstVector& d) const {
  const auto place = [&](Index a) -> Eigen::Vector3d {
    return points_->segment<3>(3 * a) + u.segment<3>(3 * a);
  };
  const auto way = [&](Index a) -> Eigen::Vector3d { return d.segment<3>(3 * a); };
  Vector result = d;
  for (const Node& n : nodes_) {
    const Moments sum = moments(n.node, place, way);
    const Eigen::Matrix3d gradient = sum.mixed * sum.own.inverse();
    const Eigen::Vector3d curl(gradient(2, 1) - gradient(1, 2), gradient(0, 2) - gradient(2, 0),
                               gradient(1, 0) - gradient(0, 1));
    const double angle = 0.5 * curl.norm();
    if (!(angle > kStraight) || !std::isfinite(angle)) continue;
    const Eigen::Vector3d axis = curl.normalized(), v = way(n.node), across = axis.cross(v);
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
