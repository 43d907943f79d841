#include "rig_scan.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <numeric>
#include <optional>
#include <string>
#include <vector>

#include "point_tree.hpp"
#include "supple/error.hpp"

namespace supple {
namespace {

using Vec3 = Eigen::Vector3d;
using Index = Eigen::Index;
constexpr double kPi = 3.14159265358979323846;

/// The voxels that points lie in, numbered as they are met.
class Voxels {
 public:
  Voxels(const Points& points, double size) : of_(static_cast<std::size_t>(points.rows())) {
    const Vec3 low = points.colwise().minCoeff().transpose();
    std::size_t slots = 1024;
    while (slots < 2 * of_.size())
      slots *= 2;
    std::vector<std::uint64_t> keys(slots, kFree);
    std::vector<int> numbers(slots);
    for (std::size_t i = 0; i < of_.size(); ++i) {
      const Vec3 cell = (points.row(static_cast<Index>(i)).transpose() - low) / size;
      const std::uint64_t key = static_cast<std::uint64_t>(cell[0]) |
                                static_cast<std::uint64_t>(cell[1]) << 21 |
                                static_cast<std::uint64_t>(cell[2]) << 42;
      std::size_t slot = (key * 0x9E3779B97F4A7C15ull >> 20) & (slots - 1);
      while (keys[slot] != key && keys[slot] != kFree)
        slot = (slot + 1) & (slots - 1);
      if (keys[slot] == kFree) {
        keys[slot] = key;
        numbers[slot] = count_++;
      }
      of_[i] = numbers[slot];
    }
  }
  int of(Index point) const { return of_[static_cast<std::size_t>(point)]; }
  int count() const { return count_; }

 private:
  static constexpr std::uint64_t kFree = ~std::uint64_t{0};
  std::vector<int> of_;
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

/// Points at an edge of one triangle alone: the edges opposite to them do not close a ring.
std::vector<char> triangle_borders(Index points, const Triangles& triangles) {
  const auto label = [](std::int32_t v) {
    return (static_cast<std::uint64_t>(v) + 1) * 0x9E3779B97F4A7C15ull;
  };
  std::vector<std::uint64_t> sum(static_cast<std::size_t>(points), 0);
  for (Index t = 0; t < triangles.rows(); ++t) {
    const std::uint64_t a = label(triangles(t, 0)), b = label(triangles(t, 1)),
                        c = label(triangles(t, 2));
    sum[static_cast<std::size_t>(triangles(t, 0))] += b - c;
    sum[static_cast<std::size_t>(triangles(t, 1))] += c - a;
    sum[static_cast<std::size_t>(triangles(t, 2))] += a - b;
  }
  std::vector<char> border(sum.size());
  for (std::size_t i = 0; i < sum.size(); ++i)
    border[i] = sum[i] != 0;
  return border;
}

/// One point a voxel: means of points and normals; at a border if one in eight of its points is.
ScanCloud merged(const Points& points, const Points& normals, const std::vector<char>& border,
                 const Voxels& voxels, Eigen::VectorXd& held) {
  const int count = voxels.count();
  ScanCloud cloud;
  cloud.points = Points::Zero(count, 3);
  cloud.normals = Points::Zero(count, 3);
  held.setZero(count);
  std::vector<int> edge(static_cast<std::size_t>(count), 0);
  for (Index i = 0; i < points.rows(); ++i) {
    const int v = voxels.of(i);
    cloud.points.row(v) += points.row(i);
    if (normals.rows() > 0) cloud.normals.row(v) += normals.row(i);
    held[v] += 1.0;
    if (!border.empty()) edge[static_cast<std::size_t>(v)] += border[static_cast<std::size_t>(i)];
  }
  cloud.points.array().colwise() /= held.array();
  cloud.border.resize(static_cast<std::size_t>(count));
  for (int v = 0; v < count; ++v)
    cloud.border[static_cast<std::size_t>(v)] = 8 * edge[static_cast<std::size_t>(v)] > held[v];
  return cloud;
}

/// Which points belong to large pieces; points closer than `gap` are of one.
/// Source: Tarjan (1975), J. ACM 22(2), union by number and path halving.
std::vector<char> main_pieces(const Points& points, double gap, double share) {
  const PointTree tree(points);
  const std::size_t n = static_cast<std::size_t>(points.rows());
  std::vector<int> parent(n), count(n, 0);
  std::iota(parent.begin(), parent.end(), 0);
  const auto root = [&](int i) {
    int* p = &parent[static_cast<std::size_t>(i)];
    while (*p != i) {
      *p = parent[static_cast<std::size_t>(*p)];
      i = *p;
      p = &parent[static_cast<std::size_t>(i)];
    }
    return i;
  };
  for (std::size_t i = 0; i < n; ++i)
    tree.within(points.row(static_cast<Index>(i)).transpose(), gap * gap, [&](int j, double) {
      const int a = root(static_cast<int>(i)), b = root(j);
      parent[static_cast<std::size_t>(std::max(a, b))] = std::min(a, b);
    });
  for (std::size_t i = 0; i < n; ++i)
    ++count[static_cast<std::size_t>(root(static_cast<int>(i)))];
  const double most = *std::max_element(count.begin(), count.end());
  const double least = std::min(share * static_cast<double>(n), most);
  std::vector<char> stays(n);
  for (std::size_t i = 0; i < n; ++i)
    stays[i] = count[static_cast<std::size_t>(root(static_cast<int>(i)))] >= least;
  return stays;
}

/// What the points within `radius` of each say of it.
struct Around {
  Points normal;         ///< along their least spread; 0 of fewer than four
  Eigen::VectorXd share; ///< m² of the surface: the disc over what its points hold, times its own
  std::vector<char> border; ///< they lie to one side
  Eigen::VectorXd dip;      ///< m, along the normal: their mean against the point
};

/// `held`: scan points that each of the cloud's stands for. The mean of a half disc is 0.42 of its
/// radius from its centre: that tells a border, and how much of the disc is there.
Around look_around(const Points& points, const Eigen::VectorXd& held, const PointTree& tree,
                   double radius) {
  const Index n = points.rows();
  Around found{Points::Zero(n, 3), Eigen::VectorXd(n),
               std::vector<char>(static_cast<std::size_t>(n)), Eigen::VectorXd::Zero(n)};
#pragma omp parallel for schedule(static)
  for (Index i = 0; i < n; ++i) {
    const Vec3 centre = points.row(i).transpose();
    Vec3 sum = Vec3::Zero();
    Eigen::Matrix3d moment = Eigen::Matrix3d::Zero();
    double all = 0.0;
    int count = 0;
    tree.within(centre, radius * radius, [&](int j, double) {
      const Vec3 offset = points.row(j).transpose() - centre;
      sum += held[j] * offset;
      moment += held[j] * offset * offset.transpose();
      all += held[j];
      ++count;
    });
    const Vec3 mean = sum / all;
    if (count >= 4) {
      Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> spread;
      spread.computeDirect(moment / all - mean * mean.transpose());
      found.normal.row(i) = spread.eigenvectors().col(0).transpose();
      found.dip[i] = mean.dot(spread.eigenvectors().col(0));
    }
    const double aside = mean.norm() / radius;
    found.share[i] = kPi * radius * radius * std::max(1.0 - 1.18 * aside, 0.3) * held[i] / all;
    found.border[static_cast<std::size_t>(i)] = count < 4 || aside > 0.28;
  }
  return found;
}

/// Puts means back on a curved surface. The mean of a square of side h is h²/12 · H off it, H the
/// mean curvature; that of a disc of radius r, r²/4 · H: the difference is what `dip` measures.
void uncurve(Around& around, double size, double radius, Points& points) {
  const double square = size * size / 12.0, disc = radius * radius / 4.0;
  for (Index i = 0; i < points.rows(); ++i)
    if (!around.border[static_cast<std::size_t>(i)])
      points.row(i) -= square / (disc - square) * around.dip[i] * around.normal.row(i);
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

/// In the order of the tree.
ScanCloud ordered(const ScanCloud& cloud, const std::vector<int>& order) {
  ScanCloud result = cloud;
  for (std::size_t k = 0; k < order.size(); ++k) {
    const Index to = static_cast<Index>(k);
    result.points.row(to) = cloud.points.row(order[k]);
    result.normals.row(to) = cloud.normals.row(order[k]);
    result.area[to] = cloud.area[order[k]];
    result.border[k] = cloud.border[static_cast<std::size_t>(order[k])];
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

/// Its large pieces alone, looked at again without the others.
ScanCloud without_clutter(const ScanCloud& whole, const ScanSettings& settings) {
  const std::vector<char> stays = main_pieces(whole.points, settings.gap, settings.share);
  const Index count = std::count(stays.begin(), stays.end(), char{1});
  if (count == whole.points.rows()) return whole;
  Points points(count, 3), normals(count, 3);
  Index to = 0;
  for (std::size_t i = 0; i < stays.size(); ++i) {
    if (!stays[i]) continue;
    points.row(to) = whole.points.row(static_cast<Index>(i));
    normals.row(to++) = whole.normals.row(static_cast<Index>(i));
  }
  ScanSettings again{settings.voxel, false};
  return prepared(points, Triangles(0, 3), whole.oriented ? normals : Points(0, 3), again);
}

} // namespace

ScanCloud prepared(const Points& points, const Triangles& triangles, const Points& normals,
                   const ScanSettings& settings) {
  check(points, triangles, normals, settings.voxel);
  const bool meshed = triangles.rows() > 0, given = normals.rows() > 0;
  std::optional<Voxels> voxels;
  Points found;
  std::vector<char> border;
#pragma omp parallel sections
  {
#pragma omp section
    voxels.emplace(points, settings.voxel);
#pragma omp section
    if (given)
      found = normals;
    else if (meshed)
      found = triangle_normals(points, triangles);
#pragma omp section
    if (meshed) border = triangle_borders(points.rows(), triangles);
  }
  ScanCloud cloud;
  Eigen::VectorXd held;
  if (settings.thin) {
    cloud = merged(points, found, border, *voxels, held);
  } else {
    held.setOnes(points.rows());
    cloud.points = points;
    cloud.normals = given || meshed ? found : Points::Zero(points.rows(), 3);
    cloud.border = border;
  }
  cloud.oriented = given || meshed;
  const PointTree tree(cloud.points);
  Around around = look_around(cloud.points, held, tree, 2.2 * settings.voxel);
  if (settings.thin) uncurve(around, settings.voxel, 2.2 * settings.voxel, cloud.points);
  if (!given) {
    if (meshed) turn_to(cloud.normals, around.normal);
    cloud.normals.swap(around.normal);
  }
  if (!meshed) cloud.border.swap(around.border);
  unit_normals(cloud.normals);
  cloud.area = around.share;
  const ScanCloud whole = ordered(cloud, tree.order());
  return settings.gap > 0.0 ? without_clutter(whole, settings) : whole;
}

} // namespace supple
