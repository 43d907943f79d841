#include "relabelling.hpp"

#include <cmath>

namespace supple {
namespace {

constexpr double kFlat = 1e-6; // det / norm³ of a 3 × 3 block below which it is no map of a volume

bool regular(const Eigen::Matrix3d& m) {
  return m.determinant() > kFlat * std::pow(m.norm(), 3);
}

} // namespace

Relabelling::Relabelling(const BlockPattern& pattern, const Mask& free, const Vector& points)
    : pattern_(&pattern), points_(&points), free_(free) {
  const auto nodes = static_cast<std::size_t>(pattern.nodes);
  spread_.assign(nodes, Eigen::Matrix3d::Zero());
  block_.resize(nodes);
  for (Index a = 0; a < pattern.nodes; ++a) {
    const auto node = static_cast<std::size_t>(a);
    Eigen::Matrix3d sum = Eigen::Matrix3d::Zero();
    for (Index k = pattern.node_start[node]; k < pattern.node_start[node + 1]; ++k) {
      const Index b = pattern.neighbour[static_cast<std::size_t>(k)];
      if (b >= pattern.nodes) break; // scalars come last
      const Eigen::Vector3d d = points.segment<3>(3 * b) - points.segment<3>(3 * a);
      sum += d * d.transpose();
    }
    if (regular(sum)) spread_[node] = sum.inverse();
  }
  update(Vector::Zero(pattern.dofs()));
}

Eigen::Matrix3d Relabelling::fit(Index a, const ConstVector& u) const {
  const auto node = static_cast<std::size_t>(a);
  Eigen::Matrix3d sum = Eigen::Matrix3d::Zero(); // Σ (u_b − u_a)(x_b − x_a)ᵀ
  for (Index k = pattern_->node_start[node]; k < pattern_->node_start[node + 1]; ++k) {
    const Index b = pattern_->neighbour[static_cast<std::size_t>(k)];
    if (b >= pattern_->nodes) break;
    const Eigen::Vector3d d = points_->segment<3>(3 * b) - points_->segment<3>(3 * a);
    sum += (u.segment<3>(3 * b) - u.segment<3>(3 * a)) * d.transpose();
  }
  return Eigen::Matrix3d::Identity() + sum * spread_[node];
}

void Relabelling::update(const ConstVector& u) {
  for (Index a = 0; a < pattern_->nodes; ++a) {
    Eigen::Matrix3d d = fit(a, u), held = Eigen::Matrix3d::Zero();
    for (int i = 0; i < 3; ++i) {
      if (free_[3 * a + i]) continue;
      d.row(i).setZero();
      d.col(i).setZero();
      d(i, i) = held(i, i) = 1.0;
    }
    if (!regular(d)) d.setIdentity();
    block_[static_cast<std::size_t>(a)] = held - d;
  }
}

void Relabelling::apply(const Vector& x, Vector& y) const {
  y = x;
  for (Index a = 0; a < pattern_->nodes; ++a)
    y.segment<3>(3 * a) = block_[static_cast<std::size_t>(a)] * x.segment<3>(3 * a);
}

void Relabelling::scale_columns(const Vector& tangent, Vector& values) const {
  values = tangent;
  const BlockPattern& p = *pattern_;
  for (Index row = 0; row < p.dofs(); ++row) {
    const auto r = static_cast<std::size_t>(row);
    for (Index k = p.row_start[r]; k < p.row_start[r + 1]; k += 3) {
      const Index column = p.column[static_cast<std::size_t>(k)];
      if (column >= 3 * p.nodes) break;
      values.segment<3>(k) =
          block_[static_cast<std::size_t>(column / 3)].transpose() * tangent.segment<3>(k);
    }
  }
}

} // namespace supple
