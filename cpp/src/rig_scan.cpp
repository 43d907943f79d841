#include "rig_scan.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <Eigen/Geometry>
#include <limits>
#include <string>
#include <vector>

#include "rig_look.hpp"
#include "supple/error.hpp"

namespace supple {
namespace {

using Vec3 = Eigen::Vector3d;
using Index = Eigen::Index;

/// The box around points, m.
struct Extent {
  Vec3 low, high;
  double most() const { return (high - low).maxCoeff(); }
};

/// The voxels that points lie in, numbered as they are met.
class Voxels {
 public:
  Voxels(const GivenPoints& points, const Extent& extent, double size)
      : of_(static_cast<std::size_t>(points.rows())) {
    const Vec3 low = extent.low;
    const double per_size = 1.0 / size;
    const auto across = ((extent.high - low) * per_size).cast<std::uint64_t>().eval();
    const std::uint64_t x = across[0] + 1, y = across[1] + 1, z = across[2] + 1;
    if (x * y > kCells || x * y * z > kCells) {
      find(points, low, per_size);
      return;
    }
    const Index count = points.rows(); // few enough for a table of all
#pragma omp parallel for schedule(static)
    for (Index i = 0; i < count; ++i) {
      const double* const p = points.data() + 3 * i;
      const auto along = [&](int d) { return static_cast<int>((p[d] - low[d]) * per_size); };
      of_[static_cast<std::size_t>(i)] =
          along(0) + static_cast<int>(x) * (along(1) + static_cast<int>(y) * along(2));
    }
    std::vector<int> numbers(x * y * z, -1);
    for (int& cell : of_) {
      int& number = numbers[static_cast<std::size_t>(cell)];
      if (number < 0) number = count_++;
      cell = number;
    }
  }
  int of(Index point) const { return of_[static_cast<std::size_t>(point)]; }
  int count() const { return count_; }

 private:
  static constexpr std::uint64_t kFree = ~std::uint64_t{0}, kCells = 1 << 20;

  void find(const GivenPoints& points, const Vec3& low, double per_size) {
    keys_.assign(1 << 14, kFree);
    numbers_.resize(1 << 14);
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
  std::vector<std::uint64_t> keys_;
  std::vector<int> numbers_;
  int count_ = 0;
};

/// Adds up by voxels over points or triangles, in a fixed number of parts, so that the threads'
/// number leaves no trace: add(i, into (v, columns)).
template <class Add>
RowMatrix sums_of(Index count, Index voxels, Index columns, const Add& add) {
  constexpr Index parts = 4;
  std::array<RowMatrix, parts> sums;
#pragma omp parallel for schedule(static, 1)
  for (Index s = 0; s < parts; ++s) {
    RowMatrix& sum = sums[static_cast<std::size_t>(s)];
    sum.setZero(voxels, columns);
    for (Index i = s * count / parts; i < (s + 1) * count / parts; ++i)
      add(i, sum);
  }
  for (std::size_t s = 1; s < parts; ++s)
    sums[0] += sums[s];
  return sums[0];
}

/// Normals (v, 3) weighted by area, not of unit length, from the triangles: of each voxel, those
/// of its points, added up. `of` (point): its voxel.
template <class Of>
Points triangle_normals(const GivenPoints& points, const GivenTriangles& triangles, Index voxels,
                        const Of& of) {
  return sums_of(triangles.rows(), voxels, 3, [&](Index t, RowMatrix& sum) {
    const auto at = [&](int c) -> Vec3 { return points.row(triangles(t, c)).transpose(); };
    const Vec3 a = at(0), area = (at(1) - a).cross(at(2) - a);
    for (int c = 0; c < 3; ++c)
      for (int d = 0; d < 3; ++d)
        sum(of(triangles(t, c)), d) += area[d];
  });
}

/// One point a voxel: means of points and normals, and how many points each `held`.
ScanCloud merged(const GivenPoints& points, const GivenPoints& normals, const Voxels& voxels,
                 Eigen::VectorXd& held) {
  const int count = voxels.count();
  const RowMatrix sums = sums_of(points.rows(), count, 4, [&](Index i, RowMatrix& sum) {
    double* const to = &sum(voxels.of(i), 0);
    for (int d = 0; d < 3; ++d)
      to[d] += points(i, d);
    to[3] += 1.0;
  });
  held = sums.col(3);
  ScanCloud cloud;
  cloud.points = sums.leftCols<3>().array().colwise() / held.array();
  cloud.normals = Points::Zero(count, 3);
  for (Index i = 0; i < normals.rows(); ++i)
    cloud.normals.row(voxels.of(i)) += normals.row(i);
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

/// Of all coordinates, eight points at a time; not finite if one of them is not.
Extent extent_of(const GivenPoints& points) {
  constexpr Index lanes = 24;
  const Index all = 3 * points.rows(), whole = all / lanes * lanes;
  const double* const x = points.data();
  std::array<double, lanes> low, high, wrong{};
  low.fill(std::numeric_limits<double>::infinity());
  high.fill(-std::numeric_limits<double>::infinity());
  const auto take = [&](Index i, Index count) {
    for (Index k = 0; k < count; ++k) {
      const std::size_t s = static_cast<std::size_t>(k);
      const double value = x[i + k];
      low[s] = value < low[s] ? value : low[s];
      high[s] = value > high[s] ? value : high[s];
      wrong[s] += 0.0 * value; // NaN from then on
    }
  };
  for (Index i = 0; i < whole; i += lanes)
    take(i, lanes);
  take(whole, all - whole);
  Extent found{Vec3(low[0], low[1], low[2]), Vec3(high[0], high[1], high[2])};
  for (std::size_t s = 0; s < lanes; ++s) {
    const Index d = static_cast<Index>(s) % 3;
    found.low[d] = std::min(found.low[d], low[s]);
    found.high[d] = std::max(found.high[d], high[s]);
    if (!(wrong[s] == wrong[s])) found.low.setConstant(-std::numeric_limits<double>::infinity());
  }
  return found;
}

Extent checked(const GivenPoints& points, const GivenTriangles& triangles,
               const GivenPoints& normals, double size) {
  if (points.rows() == 0)
    throw ShapeError("points must have a row at least, got none; give a scan");
  if (normals.rows() > 0)
    require_size("normals", normals.rows(), points.rows(), "give one a point, or none at all");
  if (triangles.size() > 0 && (triangles.minCoeff() < 0 || triangles.maxCoeff() >= points.rows()))
    throw ShapeError("triangles must name points from 0 to " + std::to_string(points.rows() - 1) +
                     "; renumber the triangles");
  const Extent extent = extent_of(points);
  if (!std::isfinite(extent.most()) || !normals.allFinite())
    throw NumericalError("a scan must be finite, got NaN or infinity; repair it");
  if (!(size > 0.0) || extent.most() / size > 2e6)
    throw NumericalError(
        "voxel must be above 0 m and above a millionth of the scan's extent, got " +
        std::to_string(size) + "; take 0.01");
  return extent;
}

} // namespace

ScanCloud prepared(const GivenPoints& points, const GivenTriangles& triangles,
                   const GivenPoints& normals, const ScanSettings& settings) {
  const Extent extent = checked(points, triangles, normals, settings.voxel);
  const bool meshed = triangles.rows() > 0, given = normals.rows() > 0;
  ScanCloud cloud;
  Eigen::VectorXd held;
  if (settings.thin) {
    const Voxels voxels(points, extent, settings.voxel);
    cloud = merged(points, normals, voxels, held);
    if (!given && meshed)
      cloud.normals = triangle_normals(points, triangles, voxels.count(),
                                       [&](Index point) { return voxels.of(point); });
  } else {
    held.setOnes(points.rows());
    cloud.points = points;
    cloud.normals = given    ? Points(normals)
                    : meshed ? triangle_normals(points, triangles, points.rows(),
                                                [](Index point) { return point; })
                             : Points::Zero(points.rows(), 3).eval();
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
