#include "supple/pose_search.hpp"

#include <algorithm>
#include <cmath>
#include <Eigen/Cholesky>

#include "supple/error.hpp"

namespace supple {
namespace {

using Vec3 = Eigen::Vector3d;
using Mat3 = Eigen::Matrix3d;
using Vec7 = Eigen::Matrix<double, 7, 1>;
using Mat7 = Eigen::Matrix<double, 7, 7>;
using Index = Eigen::Index;

/// Share of point-to-point: planes alone let a flat or round part slide away.
constexpr double kPointShare = 0.15;
/// m: a size that is one standard deviation off counts as much as this.
constexpr double kSize = 0.02;

/// A point of the scan in the template's frame, and its partner.
struct Partner {
  Vec3 q, offset, normal;
  double cosine; ///< of the two normals
};

class Search {
 public:
  Search(const PoseShapes& shapes, const Points& points, const Points& normals, bool oriented)
      : shapes_(shapes), points_(points), normals_(normals), oriented_(oriented) {}

  void match(const Similarity& pose, std::vector<Partner>& pairs) const {
    pairs.resize(static_cast<std::size_t>(points_.rows()));
    const Index first = static_cast<Index>(pose.shape) * shapes_.vertices;
    for (Index i = 0; i < points_.rows(); ++i) {
      Partner& pair = pairs[static_cast<std::size_t>(i)];
      pair.q = pose.a * (pose.R * points_.row(i).transpose()) + pose.b;
      const Index at = first + nearest(pose.shape, pair.q);
      pair.offset = shapes_.points.row(at).transpose() - pair.q;
      pair.normal = shapes_.normals.row(at).transpose();
      const Vec3 own = normals_.row(i).transpose();
      const double cosine = pair.normal.dot(pose.R * own);
      pair.cosine = own.isZero(0.0) ? 0.7 : oriented_ ? cosine : std::abs(cosine);
    }
  }

  double score(const Similarity& pose, std::vector<Partner>& pairs) const {
    match(pose, pairs);
    double sum = 0.0;
    for (const Partner& pair : pairs) {
      const double turned = 0.03 * (1.0 - std::clamp(pair.cosine, -1.0, 1.0));
      sum += std::min(pair.offset.norm() + turned, 0.08);
    }
    return sum / static_cast<double>(pairs.size()) / std::sqrt(pose.a);
  }

  void step(const PoseRound& round, Similarity& pose, std::vector<Partner>& pairs) const {
    match(pose, pairs);
    std::vector<double> weights;
    const Vec3 middle = weigh(round.reach, pairs, weights);
    Mat7 matrix;
    Vec7 right;
    equations(pairs, weights, middle, matrix, right);
    const double held = (kSize / round.size_sd) * (kSize / round.size_sd);
    matrix(6, 6) += held;
    right[6] -= held * std::log(pose.a);
    matrix.diagonal().array() += 1e-7;
    move(matrix.ldlt().solve(right), middle, pose);
  }

 private:
  Index nearest(int shape, const Vec3& q) const {
    Index cell = 0;
    for (int d = 0; d < 3; ++d) {
      const int most = shapes_.counts[d] - 1;
      const double place = (q[d] - shapes_.origin[d]) / shapes_.size;
      cell = cell * shapes_.counts[d] +
             static_cast<Index>(std::clamp(place, 0.0, static_cast<double>(most)));
    }
    return shapes_.nearest[shape * shapes_.counts.cast<Index>().prod() + cell];
  }

  /// Robust weights, of sum 1, of the pairs; and their middle.
  static Vec3 weigh(double reach, const std::vector<Partner>& pairs, std::vector<double>& weights) {
    double sum = 0.0;
    Vec3 middle = Vec3::Zero();
    for (const Partner& pair : pairs) {
      const double far = 1.0 + pair.offset.squaredNorm() / (reach * reach);
      weights.push_back(std::max(pair.cosine, 0.05) / (far * far));
      sum += weights.back();
      middle += weights.back() * pair.q;
    }
    for (double& weight : weights)
      weight /= sum;
    return middle / sum;
  }

  /// By turn about the middle, shift and logarithm of size: point to plane, and a share of point
  /// to point.
  static void equations(const std::vector<Partner>& pairs, const std::vector<double>& weights,
                        const Vec3& middle, Mat7& matrix, Vec7& right) {
    matrix.setZero();
    right.setZero();
    Mat3 second = Mat3::Zero();
    Vec7 pull = Vec7::Zero();
    for (std::size_t i = 0; i < pairs.size(); ++i) {
      const Partner& pair = pairs[i];
      const Vec3 arm = pair.q - middle, weighted = weights[i] * arm;
      Vec7 row;
      row << arm.cross(pair.normal), pair.normal, arm.dot(pair.normal);
      matrix += (weights[i] * row) * row.transpose();
      right += weights[i] * pair.normal.dot(pair.offset) * row;
      second += weighted * arm.transpose();
      pull.head<3>() += weighted.cross(pair.offset);
      pull.segment<3>(3) += weights[i] * pair.offset;
      pull[6] += weighted.dot(pair.offset);
    }
    matrix.topLeftCorner<3, 3>() += kPointShare * (second.trace() * Mat3::Identity() - second);
    matrix.block<3, 3>(3, 3) += kPointShare * Mat3::Identity();
    matrix(6, 6) += kPointShare * second.trace();
    right += kPointShare * pull;
  }

  static void move(Vec7 motion, const Vec3& middle, Similarity& pose) {
    const double angle = motion.head<3>().norm();
    const Vec3 axis = angle > 1e-12 ? Vec3(motion.head<3>() / angle) : Vec3(Vec3::UnitX());
    const Mat3 turn = Eigen::AngleAxisd(std::min(angle, 0.6), axis).toRotationMatrix();
    const double wanted = pose.a * std::exp(std::clamp(motion[6], -0.1, 0.1));
    const double grow = std::clamp(wanted, 0.7, 1.4) / pose.a;
    pose.b = grow * (turn * (pose.b - middle)) + middle + motion.segment<3>(3);
    pose.R = turn * pose.R;
    pose.a *= grow;
  }

  const PoseShapes& shapes_;
  const Points& points_;
  const Points& normals_;
  bool oriented_;
};

void check(const PoseShapes& shapes, const Points& points, const Points& normals,
           const std::vector<Similarity>& candidates) {
  const Index cells = shapes.counts.cast<Index>().prod();
  const Index count = cells > 0 ? shapes.nearest.size() / cells : 0;
  require_size("the shapes' points", shapes.points.rows(), count * shapes.vertices, "n a shape");
  require_size("the shapes' normals", shapes.normals.rows(), shapes.points.rows(), "one a point");
  require_size("normals", normals.rows(), points.rows(), "give one a point");
  if (points.rows() == 0) throw ShapeError("points must have a row at least, got none");
  for (const Similarity& one : candidates)
    if (one.shape < 0 || one.shape >= count) throw ShapeError("a candidate must name a shape");
}

} // namespace

void descend(const PoseShapes& shapes, const Points& points, const Points& normals, bool oriented,
             const PoseRound& round, std::vector<Similarity>& candidates) {
  check(shapes, points, normals, candidates);
  const Search search(shapes, points, normals, oriented);
#pragma omp parallel
  {
    std::vector<Partner> pairs;
#pragma omp for schedule(dynamic, 1)
    for (std::size_t i = 0; i < candidates.size(); ++i) {
      Similarity& one = candidates[i];
      for (int s = 0; s < round.steps; ++s)
        search.step(round, one, pairs);
      one.score = search.score(one, pairs);
    }
  }
}

} // namespace supple
