/// What a fit searches in: neighbours, pieces, closest points and poses, against plain loops.
#include <cmath>
#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <random>

#include "check.hpp"
#include "rig_look.hpp"
#include "rig_scan.hpp"
#include "rig_tree.hpp"
#include "supple/error.hpp"
#include "supple/pose_search.hpp"

using namespace supple;

namespace {

using Vec3 = Eigen::Vector3d;
using Eigen::Index;

/// Points of a ball's skin, unevenly.
Points ball(Index count, double radius, const Vec3& centre, unsigned seed) {
  std::mt19937 random(seed);
  std::normal_distribution<double> normal;
  Points points(count, 3);
  for (Index i = 0; i < count; ++i) {
    const Vec3 way(normal(random), normal(random), 0.5 + normal(random));
    points.row(i) = (centre + radius * way.normalized()).transpose();
  }
  return points;
}

/// A bumpy sheet of 2 × 20 × 20 triangles.
void sheet(Points& points, Triangles& triangles) {
  constexpr int side = 21;
  points.resize(side * side, 3);
  triangles.resize(2 * (side - 1) * (side - 1), 3);
  for (int j = 0, t = 0; j < side; ++j)
    for (int i = 0; i < side; ++i) {
      const double x = 0.05 * i, y = 0.05 * j;
      points.row(j * side + i) << x, y, 0.1 * std::sin(7.0 * x) * std::cos(5.0 * y);
      if (i + 1 == side || j + 1 == side) continue;
      const int p = j * side + i;
      triangles.row(t++) << p, p + 1, p + side + 1;
      triangles.row(t++) << p, p + side + 1, p + side;
    }
}

} // namespace

TEST(what_lies_around_a_point_is_what_a_loop_over_all_finds) {
  const Points points = ball(700, 0.3, Vec3(1, 2, 3), 5);
  const Eigen::VectorXd held = (points.col(0) * 100.0).array().sin() + 2.0;
  const PointTree tree(points);
  const double radius = 0.06, gap = 0.03;
  const Around found = look_around(points, held, tree, radius, gap);
  std::size_t links = 0, expected = 0;
  for (const auto& part : found.links)
    links += part.size();
  for (Index i = 0; i < points.rows(); ++i) {
    double all = 0.0;
    int count = 0;
    Vec3 sum = Vec3::Zero(), plain = Vec3::Zero();
    Eigen::Matrix3d second = Eigen::Matrix3d::Zero();
    for (Index j = 0; j < points.rows(); ++j) {
      const Vec3 d = (points.row(j) - points.row(i)).transpose();
      expected += j < i && d.norm() <= gap;
      if (d.norm() > radius) continue;
      all += held[j];
      sum += held[j] * d;
      plain += d;
      second += held[j] * d * d.transpose();
      ++count;
    }
    const double aside = plain.norm() / count / radius;
    CHECK_BELOW(std::abs(found.share[i] -
                         M_PI * radius * radius * std::max(1.0 - 1.18 * aside, 0.3) / count),
                1e-12);
    CHECK((found.border[static_cast<std::size_t>(i)] != 0) == (count < 4 || aside > 0.28));
    if (count < 4) continue;
    const Vec3 mean = sum / all;
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> spread(second / all -
                                                                mean * mean.transpose());
    const Vec3 normal = found.normal.row(i).transpose();
    const double gap_of_values = spread.eigenvalues()[1] - spread.eigenvalues()[0];
    if (gap_of_values > 0.05 * spread.eigenvalues()[2])
      CHECK_BELOW(1.0 - std::abs(normal.dot(spread.eigenvectors().col(0))), 1e-8);
    CHECK_BELOW(std::abs(found.dip[i] - mean.dot(normal)), 1e-12);
  }
  CHECK(links == expected);
}

TEST(a_small_piece_beside_the_body_is_left_out_and_a_large_one_stays) {
  Points points(2260, 3);
  points << ball(2000, 0.3, Vec3::Zero(), 1), ball(200, 0.1, Vec3(1, 0, 0), 2),
      ball(60, 0.05, Vec3(0, 1, 0), 3);
  const GivenTriangles::PlainObject none(0, 3);
  const ScanCloud cloud = prepared(points, none, Points(0, 3), {0.03, true, 0.057});
  int body = 0, second = 0, third = 0;
  for (Index i = 0; i < cloud.points.rows(); ++i) {
    body += cloud.points.row(i).norm() < 0.31;
    second += cloud.points(i, 0) > 0.8;
    third += cloud.points(i, 1) > 0.8;
  }
  CHECK(body > 500);
  CHECK(second > 50);
  CHECK(third == 0);
  CHECK(body + second == cloud.points.rows());
}

TEST(a_landing_is_the_nearest_of_all_triangles_whatever_the_hint) {
  Points points;
  Triangles triangles;
  sheet(points, triangles);
  SkinTree tree(points, triangles);
  points.col(2) *= -1.5; // it moves after it was built
  tree.refit(points);
  const SurfaceTree exact(points, triangles);
  Points queries = 0.7 * Points::Random(300, 3);
  queries.leftCols(2).array() += 0.5;
  const Projection expected = exact.closest(queries);
  int hint = -1;
  for (Index i = 0; i < queries.rows(); ++i) {
    const Landing found = tree.closest(queries.row(i).transpose(), 10.0, hint);
    CHECK_BELOW(std::abs(std::sqrt(found.squared) - expected.distance[i]), 1e-12);
    const Landing near = tree.closest(queries.row(i).transpose(), 0.2, hint);
    CHECK((near.triangle >= 0) == (expected.distance[i] < 0.2));
    hint = found.leaf;
  }
}

TEST(a_turned_shifted_and_grown_shape_is_found_again) {
  PoseShapes shapes;
  shapes.vertices = 900;
  shapes.points = ball(900, 1.0, Vec3::Zero(), 7);
  shapes.points.col(0) *= 0.15; // three lengths, and a lump that tells the ends apart
  shapes.points.col(1) *= 0.25;
  shapes.points.col(2) *= 0.4;
  shapes.normals = shapes.points;
  for (Index i = 0; i < 900; ++i) {
    shapes.normals.row(i).array() /= Eigen::Array3d(0.0225, 0.0625, 0.16).transpose();
    shapes.normals.row(i).normalize();
  }
  shapes.counts = Eigen::Vector3i(20, 25, 40);
  shapes.size = 0.03;
  shapes.origin = Vec3(-0.3, -0.375, -0.6);
  shapes.nearest.resize(shapes.counts.prod());
  for (int x = 0, cell = 0; x < 20; ++x)
    for (int y = 0; y < 25; ++y)
      for (int z = 0; z < 40; ++z, ++cell) {
        const Vec3 at = shapes.origin + shapes.size * (Vec3(x, y, z).array() + 0.5).matrix();
        (shapes.points.rowwise() - at.transpose())
            .rowwise()
            .squaredNorm()
            .minCoeff(&shapes.nearest[cell]);
      }
  const Eigen::Matrix3d turn = Eigen::AngleAxisd(0.3, Vec3(1, 2, -1).normalized()).matrix();
  const Vec3 shift(0.04, -0.03, 0.05);
  const Points scan = (1.06 * shapes.points * turn.transpose()).rowwise() + shift.transpose();
  const Points normals = shapes.normals * turn.transpose();
  std::vector<Similarity> one{{Eigen::Matrix3d::Identity(), Vec3::Zero()}};
  descend(shapes, scan, normals, true, {30, 0.08, 0.5}, one);
  const Points back = (one[0].a * scan * one[0].R.transpose()).rowwise() + one[0].b.transpose();
  CHECK_BELOW((back - shapes.points).rowwise().norm().mean(), 5e-3);
  CHECK_BELOW(std::abs(1.06 * one[0].a - 1.0), 0.02);
  CHECK_BELOW(one[0].score, 0.02);
  one[0].shape = 1;
  CHECK_THROWS(descend(shapes, scan, normals, true, {}, one), ShapeError);
}
