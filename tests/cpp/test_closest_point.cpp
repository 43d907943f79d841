#include "supple/closest_point.hpp"

#include <omp.h>

#include <Eigen/Dense>
#include <limits>
#include <random>

#include "check.hpp"
#include "supple/error.hpp"

using namespace supple;
using Eigen::Vector3d;

namespace {

struct Surface {
  Points vertices;
  Triangles triangles;
};

/// A bumpy n × n grid over the unit square.
Surface bumpy(int n) {
  Surface s{Points((n + 1) * (n + 1), 3), Triangles(2 * n * n, 3)};
  for (int j = 0; j <= n; ++j)
    for (int i = 0; i <= n; ++i) {
      const double x = double(i) / n, y = double(j) / n;
      s.vertices.row(j * (n + 1) + i) << x, y, 0.2 * std::sin(7 * x) * std::cos(5 * y);
    }
  for (int j = 0, t = 0; j < n; ++j)
    for (int i = 0; i < n; ++i) {
      const int a = j * (n + 1) + i;
      s.triangles.row(t++) << a, a + 1, a + n + 2;
      s.triangles.row(t++) << a, a + n + 2, a + n + 1;
    }
  return s;
}

Points random_points(int n, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> uniform(-0.5, 1.5);
  return Points::NullaryExpr(n, 3, [&] { return uniform(random); });
}

double segment_distance(const Vector3d& q, const Vector3d& a, const Vector3d& b) {
  const double length2 = (b - a).squaredNorm();
  const double t = length2 > 0 ? std::clamp((q - a).dot(b - a) / length2, 0.0, 1.0) : 0.0;
  return (q - a - t * (b - a)).norm();
}

/// Distance to a triangle by another way: the plane's if q projects inside, by QR least squares.
double triangle_distance(const Vector3d& q, const Vector3d& a, const Vector3d& b,
                         const Vector3d& c) {
  Eigen::Matrix<double, 3, 2> span;
  span << b - a, c - a;
  const auto qr = span.colPivHouseholderQr();
  double best =
      std::min({segment_distance(q, a, b), segment_distance(q, b, c), segment_distance(q, c, a)});
  if (qr.rank() < 2) return best;
  const Eigen::Vector2d s = qr.solve(q - a);
  if (s.minCoeff() >= 0 && s.sum() <= 1) best = std::min(best, (q - a - span * s).norm());
  return best;
}

Eigen::VectorXd brute_force(const Points& query, const Surface& s) {
  Eigen::VectorXd best =
      Eigen::VectorXd::Constant(query.rows(), std::numeric_limits<double>::infinity());
  const auto vertex = [&](int t, int k) -> Vector3d {
    return s.vertices.row(s.triangles(t, k)).transpose();
  };
  for (Eigen::Index i = 0; i < query.rows(); ++i)
    for (int t = 0; t < s.triangles.rows(); ++t)
      best[i] = std::min(best[i], triangle_distance(query.row(i).transpose(), vertex(t, 0),
                                                    vertex(t, 1), vertex(t, 2)));
  return best;
}

/// The point lies on its triangle, at its weights, at its distance.
void check_consistent(const Projection& p, const Points& query, const Surface& s) {
  for (Eigen::Index i = 0; i < query.rows(); ++i) {
    Eigen::RowVector3d point = Eigen::RowVector3d::Zero();
    for (int k = 0; k < 3; ++k)
      point += p.barycentric(i, k) * s.vertices.row(s.triangles(p.triangle[i], k));
    CHECK_BELOW((point - p.point.row(i)).norm(), 1e-14);
    CHECK_BELOW(std::abs((query.row(i) - p.point.row(i)).norm() - p.distance[i]), 1e-15);
    CHECK(p.barycentric.row(i).minCoeff() >= 0.0);
    CHECK_BELOW(std::abs(p.barycentric.row(i).sum() - 1.0), 1e-15);
    CHECK((p.barycentric.row(i).array() == 0.0).count() == p.feature[i]);
  }
}

} // namespace

TEST(distance_equals_brute_force) {
  const Surface s = bumpy(12);
  const Points query = random_points(400, 1);
  const Projection p = closest_points(query, s.vertices, s.triangles);
  CHECK_BELOW((p.distance - brute_force(query, s)).cwiseAbs().maxCoeff(), 1e-14);
  check_consistent(p, query, s);
  for (int feature : {0, 1, 2})
    CHECK((p.feature.array() == feature).any());
}

/// Points of the surface itself, on its faces, edges and vertices, are at distance zero.
TEST(points_on_the_surface_stay) {
  const Surface s = bumpy(6);
  const Points& v = s.vertices;
  Points query(3 * s.triangles.rows(), 3);
  for (Eigen::Index t = 0; t < s.triangles.rows(); ++t) {
    const int a = s.triangles(t, 0), b = s.triangles(t, 1), c = s.triangles(t, 2);
    query.row(3 * t) = v.row(a);
    query.row(3 * t + 1) = (v.row(a) + v.row(b)) / 2;
    query.row(3 * t + 2) = (v.row(a) + v.row(b) + v.row(c)) / 3;
  }
  const Projection p = closest_points(query, v, s.triangles);
  CHECK_BELOW(p.distance.maxCoeff(), 1e-15);
  for (Eigen::Index t = 0; t < s.triangles.rows(); ++t) {
    CHECK(p.feature[3 * t] == 2 && p.distance[3 * t] == 0.0);
    CHECK(p.feature[3 * t + 2] == 0 && p.triangle[3 * t + 2] == t);
  }
}

/// Random roofs: what lands on the ridge is as near to both sides, to the last bit.
TEST(ties_go_to_the_lowest_triangle) {
  std::mt19937 random(2);
  std::uniform_real_distribution<double> uniform(0.1, 1.0);
  for (int repeat = 0; repeat < 200; ++repeat) {
    Points vertices(4, 3);
    vertices << 0, 0, 0, 0.2 * uniform(random), 1 + uniform(random), 0.2 * uniform(random), //
        -3, 1, -5, 3, 1, -5;
    Triangles triangles(2, 3);
    triangles << 1, 0, 2, 0, 1, 3;
    if (repeat % 2 == 1) triangles.row(0).swap(triangles.row(1));
    Points query(20, 3);
    for (int i = 0; i < 20; ++i)
      query.row(i) = vertices.row(1) * (i / 15.0) + 0.3 * Eigen::RowVector3d(0, 0, 1);
    const Projection p = closest_points(query, vertices, triangles);
    CHECK((p.triangle.array() == 0).all());
    CHECK((p.feature.array() >= 1).all());
  }
}

/// On a vertex all triangles around it are at distance zero; they lie in many boxes of the tree.
TEST(ties_across_the_tree_go_to_the_lowest_triangle) {
  Surface s = bumpy(9);
  for (Eigen::Index t = 0; t < s.triangles.rows(); ++t) // scatter the numbers
    s.triangles.row(t).swap(s.triangles.row((t * 77 + 5) % s.triangles.rows()));
  const Projection p = closest_points(s.vertices, s.vertices, s.triangles);
  for (int v = 0; v < s.vertices.rows(); ++v) {
    int lowest = 0;
    while (!(s.triangles.row(lowest).array() == v).any())
      ++lowest;
    CHECK(p.triangle[v] == lowest && p.distance[v] == 0.0);
  }
}

TEST(known_answers_on_a_right_triangle) {
  Points vertices(3, 3), query(4, 3), expected(4, 3);
  vertices << 0, 0, 0, 1, 0, 0, 0, 1, 0;
  Triangles triangles(1, 3);
  triangles << 0, 1, 2;
  query << 0.25, 0.25, 2, 0.5, -1, 0, 1, 1, 0, -1, -1, 1;
  expected << 0.25, 0.25, 0, 0.5, 0, 0, 0.5, 0.5, 0, 0, 0, 0;
  const Projection p = closest_points(query, vertices, triangles);
  CHECK_BELOW((p.point - expected).cwiseAbs().maxCoeff(), 1e-16);
  CHECK(p.feature == Eigen::Vector4i(0, 1, 1, 2));
  CHECK(p.normal.row(0) == Eigen::RowVector3d(0, 0, 1));
}

/// Triangles that are a segment, a point or a sliver answer as those do, without NaN.
TEST(degenerate_triangles_answer) {
  Surface s{Points(9, 3), Triangles(4, 3)};
  s.vertices << 0, 0, 0, 1, 0, 0, 2, 0, 0, 5, 5, 5, 0, 3, 0, 1, 3, 1e-9, 0.4, 3, 0, 0.3, 0.3, -2, 0,
      3, 1e-15;
  s.triangles << 0, 1, 2, 3, 3, 3, 4, 5, 6, 4, 5, 8;
  const Points query = random_points(300, 3) * 3.0;
  const Projection p = closest_points(query, s.vertices, s.triangles);
  CHECK(p.point.allFinite() && p.normal.allFinite() && p.distance.allFinite());
  CHECK_BELOW((p.distance - brute_force(query, s)).cwiseAbs().maxCoeff(), 1e-12);
  Points corner(1, 3);
  corner << 5, 5, 6;
  const Projection at = closest_points(corner, s.vertices, s.triangles);
  CHECK(at.triangle[0] == 1 && at.distance[0] == 1.0 && at.normal.row(0).isZero(0.0) &&
        at.feature[0] == 2);
}

/// Bit for bit.
TEST(answer_does_not_depend_on_the_thread_count) {
  const Surface s = bumpy(20);
  const SurfaceTree tree(s.vertices, s.triangles);
  const Points query = random_points(1000, 4);
  const int before = omp_get_max_threads();
  omp_set_num_threads(1);
  const Projection one = tree.closest(query);
  omp_set_num_threads(3);
  const Projection three = tree.closest(query);
  omp_set_num_threads(before);
  CHECK(one.point == three.point && one.triangle == three.triangle &&
        one.distance == three.distance);
}

TEST(wrong_arguments_are_refused) {
  const Surface s = bumpy(1);
  CHECK_THROWS(SurfaceTree(s.vertices, Triangles(0, 3)), ShapeError);
  CHECK_THROWS(SurfaceTree(s.vertices.topRows(3), s.triangles), ShapeError);
  Points broken = s.vertices;
  broken(0, 0) = std::numeric_limits<double>::quiet_NaN();
  CHECK_THROWS(SurfaceTree(broken, s.triangles), NumericalError);
  CHECK_THROWS(SurfaceTree(s.vertices, s.triangles).closest(broken), NumericalError);
  CHECK(SurfaceTree(s.vertices, s.triangles).closest(Points(0, 3)).distance.size() == 0);
}
