#include "rig_scan.hpp"

#include <algorithm>
#include <cstdint>
#include <Eigen/Geometry>
#include <optional>
#include <string>
#include <vector>

#include "rig_look.hpp"
#include "supple/error.hpp"

namespace supple {
namespace {

using Vec3 = Eigen::Vector3d;
using Index = Eigen::Index;

/// The voxels that points lie in, numbered as they are met.
class Voxels {
 public:
  Voxels(const Points& points, double size) : of_(static_cast<std::size_t>(points.rows())) {
    const Vec3 low = points.colwise().minCoeff().transpose();
    const double per_size = 1.0 / size;
    std::uint64_t last = kFree;
    for (std::size_t i = 0; i < of_.size(); ++i) {
      const Vec3 cell = (points.row(static_cast<Index>(i)).transpose() - low) * per_size;
      const std::uint64_t key = static_cast<std::uint64_t>(cell[0]) |
                                static_cast<std::uint64_t>(cell[1]) << 21 |
                                static_cast<std::uint64_t>(cell[2]) << 42;
      of_[i] = key == last ? of_[i - 1] : number_of(key); // scanners go along the surface
      last = key;
    }
  }
  int of(Index point) const { return of_[static_cast<std::size_t>(point)]; }
  int count() const { return count_; }

 private:
  static constexpr std::uint64_t kFree = ~std::uint64_t{0};

  /// Where `key` is, or where it may be put.
  std::size_t slot_of(std::uint64_t key) const {
    std::size_t slot = (key * 0x9E3779B97F4A7C15ull >> 20) & (keys_.size() - 1);
    while (keys_[slot] != key && keys_[slot] != kFree)
      slot = (slot + 1) & (keys_.size() - 1);
    return slot;
  }
  int number_of(std::uint64_t key) {
    std::size_t slot = slot_of(key);
    if (keys_[slot] == key) return numbers_[slot];
    if (2 * static_cast<std::size_t>(count_) >= keys_.size()) {
      grow();
      slot = slot_of(key);
    }
    keys_[slot] = key;
    return numbers_[slot] = count_++;
  }
  void grow() {
    std::vector<std::uint64_t> keys(2 * keys_.size(), kFree);
    std::vector<int> numbers(keys.size());
    keys.swap(keys_);
    numbers.swap(numbers_);
    for (std::size_t i = 0; i < keys.size(); ++i) {
      if (keys[i] == kFree) continue;
      const std::size_t slot = slot_of(keys[i]);
      keys_[slot] = keys[i];
      numbers_[slot] = numbers[i];
    }
  }

  std::vector<int> of_;
  /// A table that stays small enough for the cache: a scan has ten points a voxel.
  std::vector<std::uint64_t> keys_ = std::vector<std::uint64_t>(1 << 14, kFree);
  std::vector<int> numbers_ = std::vector<int>(1 << 14);
  int count_ = 0;
};

/// Normals (m, 3) weighted by area, not of unit length, from the triangles.
Points triangle_normals(const Points& points, const Triangles& triangles) {
  Points normals = Points::Zero(points.rows(), 3);
  for (Index t = 0; t < triangles.rows(); ++t) {
    const Vec3 a = points.row(triangles(t, 0)).transpose();
    const Vec3 b = points.row(triangles(t, 1)).transpose();
    const Vec3 c = points.row(triangles(t, 2)).transpose();
    const Vec3 area = (b - a).cross(c - a);
    for (int k = 0; k < 3; ++k)
      normals.row(triangles(t, k)) += area.transpose();
  }
  return normals;
}

/// One point a voxel: means of points and normals, and how many points each `held`.
ScanCloud merged(const Points& points, const Points& normals, const Voxels& voxels,
                 Eigen::VectorXd& held) {
  const int count = voxels.count();
  ScanCloud cloud;
  cloud.points = Points::Zero(count, 3);
  cloud.normals = Points::Zero(count, 3);
  held.setZero(count);
  for (Index i = 0; i < points.rows(); ++i) {
    const int v = voxels.of(i);
    cloud.points.row(v) += points.row(i);
    if (normals.rows() > 0) cloud.normals.row(v) += normals.row(i);
    held[v] += 1.0;
  }
  cloud.points.array().colwise() /= held.array();
  return cloud;
}

/// `normals` of the neighbours' spread, turned to the side of `sides`, which take their place where
/// there are no neighbours.
void turn_to(const Points& sides, Points& normals) {
  for (Index i = 0; i < normals.rows(); ++i) {
    if (normals.row(i).isZero(0.0)) normals.row(i) = sides.row(i);
    if (normals.row(i).dot(sides.row(i)) < 0.0) normals.row(i) *= -1.0;
  }
}

void unit_normals(Points& normals) {
  for (Index i = 0; i < normals.rows(); ++i) {
    const double length = normals.row(i).norm();
    if (length > 0.0) normals.row(i) /= length;
  }
}

/// Those that stay, in the order of the tree.
ScanCloud ordered(const ScanCloud& cloud, const std::vector<int>& order,
                  const std::vector<char>& stays) {
  const Index count = std::count(stays.begin(), stays.end(), char{1});
  ScanCloud result{Points(count, 3), Points(count, 3), Eigen::VectorXd(count), {}, cloud.oriented};
  result.border.reserve(static_cast<std::size_t>(count));
  Index to = 0;
  for (const int i : order) {
    if (!stays[static_cast<std::size_t>(i)]) continue;
    result.points.row(to) = cloud.points.row(i);
    result.normals.row(to) = cloud.normals.row(i);
    result.area[to++] = cloud.area[i];
    result.border.push_back(cloud.border[static_cast<std::size_t>(i)]);
  }
  return result;
}

void check(const Points& points, const Triangles& triangles, const Points& normals, double size) {
  if (points.rows() == 0)
    throw ShapeError("points must have a row at least, got none; give a scan");
  if (normals.rows() > 0)
    require_size("normals", normals.rows(), points.rows(), "give one a point, or none at all");
  if (triangles.size() > 0 && (triangles.minCoeff() < 0 || triangles.maxCoeff() >= points.rows()))
    throw ShapeError("triangles must name points from 0 to " + std::to_string(points.rows() - 1) +
                     "; renumber the triangles");
  if (!points.allFinite() || !normals.allFinite())
    throw NumericalError("a scan must be finite, got NaN or infinity; repair it");
  const double extent = (points.colwise().maxCoeff() - points.colwise().minCoeff()).maxCoeff();
  if (!(size > 0.0) || extent / size > 2e6)
    throw NumericalError(
        "voxel must be above 0 m and above a millionth of the scan's extent, got " +
        std::to_string(size) + "; take 0.01");
}

} // namespace

ScanCloud prepared(const Points& points, const Triangles& triangles, const Points& normals,
                   const ScanSettings& settings) {
  check(points, triangles, normals, settings.voxel);
  const bool meshed = triangles.rows() > 0, given = normals.rows() > 0;
  std::optional<Voxels> voxels;
  Points found;
#pragma omp parallel sections
  {
#pragma omp section
    if (settings.thin) voxels.emplace(points, settings.voxel);
#pragma omp section
    if (!given && meshed) found = triangle_normals(points, triangles);
  }
  const Points& sides = given ? normals : found;
  ScanCloud cloud;
  Eigen::VectorXd held;
  if (settings.thin) {
    cloud = merged(points, sides, *voxels, held);
  } else {
    held.setOnes(points.rows());
    cloud.points = points;
    cloud.normals = sides.rows() > 0 ? sides : Points::Zero(points.rows(), 3);
  }
  cloud.oriented = given || meshed;
  const PointTree tree(cloud.points);
  const double radius = 2.2 * settings.voxel;
  Around around = look_around(cloud.points, held, tree, radius, std::min(settings.gap, radius));
  if (settings.thin) uncurve(around, settings.voxel, radius, cloud.points);
  const std::vector<char> stays = settings.gap > 0.0 ? main_pieces(around, settings.share)
                                                     : std::vector<char>(tree.order().size(), 1);
  if (!given) {
    if (meshed) turn_to(cloud.normals, around.normal);
    cloud.normals.swap(around.normal);
  }
  cloud.border.swap(around.border);
  unit_normals(cloud.normals);
  cloud.area.swap(around.share);
  return ordered(cloud, tree.order(), stays);
}

} // namespace supple
