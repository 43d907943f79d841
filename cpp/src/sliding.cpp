#include "supple/sliding.hpp"

#include "lanes.hpp"
#include "supple/error.hpp"

namespace supple {

namespace {

enum Feature { kFace = 0, kEdge = 1 };

} // namespace

Sliding::Sliding(std::shared_ptr<const Vector> points, std::vector<Index> nodes, Vector stiffness,
                 const Points& vertices, const Triangles& triangles, bool inverse)
    : points_(std::move(points)), nodes_(std::move(nodes)), stiffness_(std::move(stiffness)),
      vertices_(vertices), triangles_(triangles), surface_(vertices, triangles), inverse_(inverse),
      cells_(static_cast<Eigen::Index>(nodes_.size()), 1) {
  require_size("stiffness", stiffness_.size(), cells_.rows(), "one value for each node");
  for (std::size_t i = 0; i < nodes_.size(); ++i) {
    if (nodes_[i] < 0 || 3 * nodes_[i] >= points_->size()) {
      throw ShapeError("nodes must lie in [0, " + std::to_string(points_->size() / 3) + "), got " +
                       std::to_string(nodes_[i]));
    }
    cells_(static_cast<Eigen::Index>(i), 0) = nodes_[i];
  }
  if (inverse_) {
    Points moved;
    loaded_normal_ = land(Vector::Zero(points_->size()), moved).normal;
  }
}

Projection Sliding::land(const ConstVector& u, Points& moved) const {
  moved.resize(cells_.rows(), 3);
  for (Eigen::Index i = 0; i < cells_.rows(); ++i) {
    moved.row(i) = points_->segment<3>(3 * cells_(i, 0)) + u.segment<3>(3 * cells_(i, 0));
  }
  return surface_.closest(moved);
}

double Sliding::energy(const ConstVector& u) const {
  Points moved;
  const Projection at = land(u, moved);
  return 0.5 * stiffness_.dot(at.distance.cwiseAbs2());
}

void Sliding::residual(const ConstVector& u, double scale, MutableVector r) const {
  Points moved;
  const Projection at = land(u, moved);
  for (Eigen::Index i = 0; i < cells_.rows(); ++i) {
    Eigen::Vector3d pull = moved.row(i) - at.point.row(i);
    if (inverse_) pull = loaded_normal_.row(i) * at.normal.row(i).dot(pull);
    r.segment<3>(3 * cells_(i, 0)) += scale * stiffness_[i] * pull;
  }
}

Eigen::Matrix3d Sliding::stiffness_block(const Projection& at, Eigen::Index i) const {
  const Eigen::Vector3d normal = at.normal.row(i);
  if (inverse_) return loaded_normal_.row(i).transpose() * normal.transpose();
  if (at.feature[i] == kFace) return normal * normal.transpose();
  if (at.feature[i] != kEdge) return Eigen::Matrix3d::Identity();
  Eigen::Index opposite = 0; // the closest point has no weight there: the edge joins the other two
  at.barycentric.row(i).minCoeff(&opposite);
  const Eigen::Index t = at.triangle[i];
  const Eigen::Vector3d edge = vertices_.row(triangles_(t, (opposite + 2) % 3)) -
                               vertices_.row(triangles_(t, (opposite + 1) % 3));
  return Eigen::Matrix3d::Identity() - edge * edge.transpose() / edge.squaredNorm();
}

template <class Use>
void Sliding::each_block(const ConstVector& u, double scale, Use use) const {
  Points moved;
  const Projection at = land(u, moved);
  for (Eigen::Index i = 0; i < cells_.rows(); ++i) {
    const Eigen::Matrix<double, 3, 3, Eigen::RowMajor> block =
        scale * stiffness_[i] * stiffness_block(at, i);
    use(static_cast<Index>(i), block.data());
  }
}

void Sliding::tangent(const ConstVector& u, double scale, const Scatter& map,
                      MutableVector values) const {
  each_block(u, scale,
             [&](Index i, const double* block) { scatter_add(map, i, block, values.data()); });
}

void Sliding::tangent(const ConstVector& u, double scale, const LowerScatter& map,
                      MutableVector values) const {
  each_block(u, scale, [&](Index i, const double* block) {
    add_lower<1>({cells_.data() + i, 1, 1, 0}, map, i, block, values.data());
  });
}

} // namespace supple
