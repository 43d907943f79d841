#include "rig_look.hpp"

#include <cmath>
#include <Eigen/Eigenvalues>

namespace supple {
namespace {

using Vec3 = Eigen::Vector3d;
using Index = Eigen::Index;
constexpr double kPi = 3.14159265358979323846;
/// Points whose links are kept together.
constexpr Index kPart = 256;

/// Moments of the points around one, about it.
struct Moments {
  double all = 0.0;
  int count = 0;
  Vec3 sum = Vec3::Zero(), plain = Vec3::Zero(); ///< by what they hold, and each alike
  double xx = 0.0, xy = 0.0, xz = 0.0, yy = 0.0, yz = 0.0, zz = 0.0;

  void add(const Vec3& offset, double held) {
    const Vec3 weighted = held * offset;
    sum += weighted;
    plain += offset;
    xx += weighted[0] * offset[0];
    xy += weighted[0] * offset[1];
    xz += weighted[0] * offset[2];
    yy += weighted[1] * offset[1];
    yz += weighted[1] * offset[2];
    zz += weighted[2] * offset[2];
    all += held;
    ++count;
  }
  Eigen::Matrix3d covariance(const Vec3& mean) const {
    Eigen::Matrix3d second;
    second << xx, xy, xz, xy, yy, yz, xz, yz, zz;
    return second / all - mean * mean.transpose();
  }
};

} // namespace

Around look_around(const Points& points, const Eigen::VectorXd& held, const PointTree& tree,
                   double radius, double gap) {
  const Index n = points.rows(), parts = (n + kPart - 1) / kPart;
  Around found{Points::Zero(n, 3), Eigen::VectorXd(n),
               std::vector<char>(static_cast<std::size_t>(n)), Eigen::VectorXd::Zero(n),
               std::vector<std::vector<std::array<int, 2>>>(static_cast<std::size_t>(parts))};
  const auto look = [&](Index i, std::vector<std::array<int, 2>>& links) {
    const Vec3 centre = points.row(i).transpose();
    Moments moments;
    tree.within(centre, radius * radius, [&](int j, double squared) {
      moments.add(points.row(j).transpose() - centre, held[j]);
      if (j < i && squared <= gap * gap) links.push_back({static_cast<int>(i), j});
    });
    const Vec3 mean = moments.sum / moments.all;
    if (moments.count >= 4) {
      Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> spread;
      spread.computeDirect(moments.covariance(mean));
      found.normal.row(i) = spread.eigenvectors().col(0).transpose();
      found.dip[i] = mean.dot(spread.eigenvectors().col(0));
    }
    const double aside = moments.plain.norm() / moments.count / radius;
    found.share[i] = kPi * radius * radius * std::max(1.0 - 1.18 * aside, 0.3) / moments.count;
    found.border[static_cast<std::size_t>(i)] = moments.count < 4 || aside > 0.28;
  };
#pragma omp parallel for schedule(dynamic, 1)
  for (Index part = 0; part < parts; ++part)
    for (Index k = part * kPart; k < std::min(n, (part + 1) * kPart); ++k)
      look(tree.order()[static_cast<std::size_t>(k)], // neighbours one after the other
           found.links[static_cast<std::size_t>(part)]);
  return found;
}

std::vector<char> main_pieces(const Around& around, double share) {
  const std::size_t n = around.border.size();
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
  for (const auto& links : around.links)
    for (const auto& [i, j] : links) {
      const int a = root(i), b = root(j);
      parent[static_cast<std::size_t>(std::max(a, b))] = std::min(a, b);
    }
  for (std::size_t i = 0; i < n; ++i)
    ++count[static_cast<std::size_t>(root(static_cast<int>(i)))];
  const double most = *std::max_element(count.begin(), count.end());
  const double least = std::min(share * static_cast<double>(n), most);
  std::vector<char> stays(n);
  for (std::size_t i = 0; i < n; ++i)
    stays[i] = count[static_cast<std::size_t>(root(static_cast<int>(i)))] >= least;
  return stays;
}

void uncurve(const Around& around, double size, double radius, Points& points) {
  const double square = size * size / 12.0, disc = radius * radius / 4.0;
  for (Index i = 0; i < points.rows(); ++i)
    if (!around.border[static_cast<std::size_t>(i)])
      points.row(i) -= square / (disc - square) * around.dip[i] * around.normal.row(i);
}

} // namespace supple
