#include "rig_match.hpp"

#include <cmath>
#include <Eigen/Geometry>
#include <limits>

namespace supple {
namespace {

using Vec3 = Eigen::Vector3d;
using Index = Eigen::Index;
constexpr double kDegree = 0.017453292519943295;
/// Of so many vertices, one is held against sliding for all.
constexpr std::size_t kSlide = 4;
/// Points that follow each other, of which each helps the next to land.
constexpr std::size_t kRun = 64;

/// Mean of the two normals, so that the residual vanishes for any two points of one sphere: the
/// curvature of a surface is no residual. Zero where the normals contradict each other.
/// Source: Rusinkiewicz (2019), A symmetric objective function for ICP, ACM TOG 38(4).
Vec3 direction_of(const Vec3& skin, Vec3 scan, bool oriented, double cosine) {
  if (scan.isZero(0.0)) return skin;
  double along = skin.dot(scan);
  if (!oriented && along < 0.0) {
    along = -along;
    scan = -scan;
  }
  return along < cosine ? Vec3(Vec3::Zero()) : Vec3((skin + scan).normalized());
}

} // namespace

Matcher::Matcher(const Rig& rig)
    : rig_(rig), skin_(rig.points(), rig.triangles()),
      vertex_order_(PointTree(rig.points()).order()) {}

void Matcher::set_scan(const ScanCloud& scan) {
  scan_ = &scan;
  tree_ = PointTree(scan.points);
  hint_.assign(static_cast<std::size_t>(scan.points.rows()), -1);
  landed_at_.resize(0, 3);
}

void Matcher::turn_normals(const Points& points) {
  normals_.setZero(points.rows(), 3);
  areas_.setZero(points.rows());
  for (Index t = 0; t < rig_.triangles().rows(); ++t) {
    const auto v = rig_.triangles().row(t);
    const Vec3 a = points.row(v[0]).transpose();
    const Vec3 cross =
        (Vec3(points.row(v[1]).transpose()) - a).cross(Vec3(points.row(v[2]).transpose()) - a);
    const double third = cross.norm() / 6.0;
    for (int c = 0; c < 3; ++c) {
      normals_.row(v[c]) += cross.transpose();
      areas_[v[c]] += third;
    }
  }
  normals_.rowwise().normalize();
}

void Matcher::match(const SkinState& state, const RigStage& stage, const RigWeights& weights,
                    const RigPriors& priors, Pairs& pairs) {
  skin_.refit(state.points);
  turn_normals(state.points);
  pairs.rows.clear();
  pairs.area = 0.0;
  const double patch = priors.patch * priors.noise;
  const double weight = weights.data / (patch * patch);
  from_scan(state.points, stage, weight * (1.0 - stage.template_share), pairs);
  from_template(state, stage, weight * stage.template_share, pairs);
}

std::vector<Landing> Matcher::land(const Points& vertices, const Points& points) {
  skin_.refit(vertices);
  std::vector<Landing> landed(static_cast<std::size_t>(points.rows()));
  const double far = std::numeric_limits<double>::max();
#pragma omp parallel
  {
    int hint = -1;
#pragma omp for schedule(static)
    for (std::size_t i = 0; i < landed.size(); ++i) {
      landed[i] = skin_.closest(points.row(static_cast<Index>(i)).transpose(), far, hint);
      hint = landed[i].leaf;
    }
  }
  return landed;
}

std::vector<Landing> Matcher::land_scan(const Points& vertices, double reach) {
  const bool known = landed_at_.rows() == vertices.rows() && landed_at_ == vertices;
  if (!known || landed_reach_ < reach) {
    skin_.refit(vertices);
    land_each(reach, 1);
    landed_at_ = vertices;
  }
  std::vector<Landing> landed = landed_;
  for (Landing& one : landed)
    if (one.squared >= reach * reach) one.triangle = -1;
  return landed;
}

/// Every so many of the scan's points on the skin, as it was refitted.
void Matcher::land_each(double reach, std::size_t every) {
  landed_.resize((hint_.size() + every - 1) / every);
  landed_reach_ = reach;
  const std::size_t runs = (landed_.size() + kRun - 1) / kRun;
#pragma omp parallel for schedule(static)
  for (std::size_t run = 0; run < runs; ++run) {
    int near = -1; // where the point before landed, which is not far
    for (std::size_t i = run * kRun; i < std::min(landed_.size(), (run + 1) * kRun); ++i) {
      int& hint = hint_[i * every];
      landed_[i] = skin_.closest(scan_->points.row(static_cast<Index>(i * every)).transpose(),
                                 reach, hint < 0 ? near : hint);
      if (landed_[i].leaf >= 0) hint = near = landed_[i].leaf;
    }
  }
}

void Matcher::from_scan(const Points& vertices, const RigStage& stage, double weight,
                        Pairs& pairs) {
  const Index all = scan_->points.rows(), every = std::max(1, stage.every_point);
  pairs.triangle.setConstant(all, -1);
  pairs.barycentric.setZero(all, 3);
  pairs.distance.setConstant(all, std::numeric_limits<double>::quiet_NaN());
  pairs.row_of.assign(static_cast<std::size_t>(all), -1);
  land_each(stage.reach, static_cast<std::size_t>(every));
  landed_at_.resize(0, 3);
  if (every == 1) landed_at_ = vertices;
  const Index count = static_cast<Index>(landed_.size());
  std::vector<Row> rows(landed_.size());
#pragma omp parallel for schedule(static)
  for (Index i = 0; i < count; ++i) {
    const std::size_t k = static_cast<std::size_t>(i);
    if (landed_[k].triangle >= 0)
      rows[k] = row_at(stage, weight * static_cast<double>(every), i * every, landed_[k]);
  }
  pairs.rows.reserve(rows.size() + static_cast<std::size_t>(rig_.vertices()));
  for (Index i = 0; i < count; ++i) {
    const std::size_t k = static_cast<std::size_t>(i);
    if (landed_[k].triangle >= 0 && !rows[k].direction.isZero(0.0))
      add_landing(i * every, landed_[k], rows[k], pairs);
  }
}

/// Its direction is 0 if the point lands at the template's border or sees its other side.
Row Matcher::row_at(const RigStage& stage, double weight, Index p, const Landing& at) const {
  Row row;
  row.direction.setZero();
  Vec3 skin = Vec3::Zero();
  bool inside = at.barycentric.minCoeff() > 0.0;
  for (int c = 0; c < 3; ++c) {
    const int v = rig_.triangles()(at.triangle, c);
    row.vertex[static_cast<std::size_t>(c)] = v;
    row.share[static_cast<std::size_t>(c)] = at.barycentric[c];
    if (at.barycentric[c] == 0.0) continue;
    skin += at.barycentric[c] * normals_.row(v).transpose();
    inside = inside || !rig_.at_border(v);
  }
  if (!inside) return row;
  row.direction = direction_of(skin.normalized(), scan_->normals.row(p).transpose(),
                               scan_->oriented, std::cos(stage.angle * kDegree));
  row.target = scan_->points.row(p).transpose();
  row.weight = weight * scan_->area[p];
  row.loss = stage.loss;
  return row;
}

void Matcher::add_landing(Index p, const Landing& at, const Row& row, Pairs& pairs) const {
  pairs.triangle[p] = at.triangle;
  pairs.barycentric.row(p) = at.barycentric.transpose();
  pairs.distance[p] = std::sqrt(at.squared);
  pairs.area += scan_->area[p];
  if (!(row.weight > 0.0)) return;
  pairs.row_of[static_cast<std::size_t>(p)] = static_cast<int>(pairs.rows.size());
  pairs.rows.push_back(row);
}

void Matcher::from_template(const SkinState& state, const RigStage& stage, double weight,
                            Pairs& pairs) {
  pairs.vertex_row.assign(static_cast<std::size_t>(rig_.vertices()), -1);
  if (!(weight > 0.0)) return;
  const std::size_t every = static_cast<std::size_t>(std::max(1, stage.every_vertex));
  const std::size_t count = (vertex_order_.size() + every - 1) / every;
  std::vector<int> nearest(count);
#pragma omp parallel for schedule(static)
  for (std::size_t i = 0; i < count; ++i)
    nearest[i] = tree_
                     .nearest(state.points.row(vertex_order_[i * every]).transpose(),
                              stage.reach * stage.reach)
                     .point;
  const double cosine = std::cos(stage.angle * kDegree);
  for (std::size_t i = 0; i < count; ++i) {
    if (nearest[i] < 0) continue;
    const int v = vertex_order_[i * every];
    const Index p = nearest[i];
    const Vec3 normal = scan_->normals.row(p).transpose();
    const Vec3 offset = (state.points.row(v) - scan_->points.row(p)).transpose();
    Row row;
    row.direction = direction_of(normals_.row(v).transpose(), normal, scan_->oriented, cosine);
    if (row.direction.isZero(0.0)) continue;
    const double beside = (offset - offset.dot(row.direction) * row.direction).squaredNorm();
    const double spacing2 = scan_->area[p]; // a point's share of the surface
    if (beside > (scan_->border[static_cast<std::size_t>(p)] ? 0.5 : 4.0) * spacing2) continue;
    row.vertex = {v, v, v};
    row.share = {1.0, 0.0, 0.0};
    row.target = scan_->points.row(p).transpose();
    row.weight = weight * areas_[v] * static_cast<double>(every);
    row.loss = stage.loss;
    pairs.vertex_row[static_cast<std::size_t>(v)] = static_cast<int>(pairs.rows.size());
    pairs.rows.push_back(row);
    if (!(stage.point_share > 0.0) || i % kSlide != 0) continue;
    const Vec3 tangent = row.direction.unitOrthogonal();
    row.weight *= stage.point_share * kSlide;
    for (const Vec3& along : {tangent, Vec3(row.direction.cross(tangent))}) {
      row.direction = along;
      pairs.rows.push_back(row);
    }
  }
}

} // namespace supple
