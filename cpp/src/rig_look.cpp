#include "rig_look.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <Eigen/Eigenvalues>
#include <numeric>

#include "lane_bits.hpp"

namespace supple {
namespace {

using Vec3 = Eigen::Vector3d;
using Index = Eigen::Index;
constexpr double kPi = 3.14159265358979323846;
/// Leaves of the tree whose links are kept together.
constexpr std::size_t kPart = 32;
constexpr std::size_t kLanes = 8;
using Lanes = double __attribute__((vector_size(8 * kLanes)));

double total(const Lanes& lanes) {
  double sum = 0.0;
  for (std::size_t k = 0; k < kLanes; ++k)
    sum += lanes[k];
  return sum;
}

/// The points around the few of a leaf, eight at a time.
class Near {
 public:
  /// Room for all points of a tree.
  explicit Near(const PointTree& tree) : number_(tree.order().size() + kLanes) {
    for (auto& axis : at_)
      axis.resize(number_.size());
    held_.resize(number_.size());
  }

  void gather(const PointTree& tree, const Eigen::VectorXd& held, int first, int last,
              double radius) {
    Vec3 low = tree.at(first), high = low;
    for (int k = first + 1; k < last; ++k) {
      low = low.cwiseMin(tree.at(k));
      high = high.cwiseMax(tree.at(k));
    }
    std::size_t count = 0;
    tree.near_box(low, high, radius, [&](int k) { // one that is too far is written over
      const Vec3& p = tree.at(k);
      for (std::size_t c = 0; c < 3; ++c)
        at_[c][count] = p[static_cast<Index>(c)];
      number_[count] = tree.order()[static_cast<std::size_t>(k)];
      held_[count] = held[number_[count]];
      const double far = (low - p).cwiseMax(p - high).cwiseMax(0.0).squaredNorm();
      count += far <= radius * radius ? 1 : 0;
    });
    lanes_ = (count + kLanes - 1) / kLanes;
    std::fill(at_[0].begin() + static_cast<std::ptrdiff_t>(count),
              at_[0].begin() + static_cast<std::ptrdiff_t>(lanes_ * kLanes), 1e9); // far away
  }

  /// Moments of those within `radius` of `centre`, about it.
  struct Moments {
    double all = 0.0, count = 0.0;
    Vec3 sum, plain; ///< by what they hold, and each alike
    Eigen::Matrix3d second;
  };
  /// link(number) of those within `gap` that are numbered below `self`.
  template <class Link>
  Moments moments(const Vec3& centre, double radius, double gap, int self, const Link& link) const {
    Lanes all{}, count{}, sum[3]{}, plain[3]{}, second[6]{};
    for (std::size_t i = 0; i < lanes_ * kLanes; i += kLanes) {
      Lanes d[3], held;
      for (std::size_t c = 0; c < 3; ++c) {
        std::memcpy(&d[c], &at_[c][i], sizeof(Lanes));
        d[c] -= centre[static_cast<Index>(c)];
      }
      std::memcpy(&held, &held_[i], sizeof(Lanes));
      const Lanes squared = d[0] * d[0] + d[1] * d[1] + d[2] * d[2];
      const auto within = squared <= radius * radius;
      const Lanes weight = within ? held : Lanes{}, one = within ? Lanes{} + 1.0 : Lanes{};
      all += weight;
      count += one;
      std::size_t to = 0;
      for (std::size_t c = 0; c < 3; ++c) {
        const Lanes weighted = weight * d[c];
        sum[c] += weighted;
        plain[c] += one * d[c];
        for (std::size_t e = c; e < 3; ++e)
          second[to++] += weighted * d[e];
      }
      Numbers numbers;
      for (std::size_t k = 0; k < kLanes; ++k)
        numbers[k] = number_[i + k];
      const auto linked = (squared <= gap * gap) & (numbers < self);
      each_bit(bits_of(linked), [&](std::size_t k) { link(number_[i + k]); });
    }
    Moments m{total(all), total(count), Vec3::Zero(), Vec3::Zero(), Eigen::Matrix3d::Zero()};
    std::size_t from = 0;
    for (int c = 0; c < 3; ++c) {
      m.sum[c] = total(sum[c]);
      m.plain[c] = total(plain[c]);
      for (int e = c; e < 3; ++e)
        m.second(c, e) = m.second(e, c) = total(second[from++]);
    }
    return m;
  }

 private:
  using Numbers = long long __attribute__((vector_size(8 * kLanes)));

  std::array<std::vector<double>, 3> at_;
  std::vector<double> held_;
  std::vector<int> number_;
  std::size_t lanes_ = 0;
};

void describe(const Near::Moments& m, double radius, Index i, Around& found) {
  const Vec3 mean = m.sum / m.all;
  if (m.count >= 4.0) {
    Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> spread;
    spread.computeDirect(m.second / m.all - mean * mean.transpose());
    found.normal.row(i) = spread.eigenvectors().col(0).transpose();
    found.dip[i] = mean.dot(spread.eigenvectors().col(0));
  }
  const double aside = m.plain.norm() / m.count / radius;
  found.share[i] = kPi * radius * radius * std::max(1.0 - 1.18 * aside, 0.3) / m.count;
  found.border[static_cast<std::size_t>(i)] = m.count < 4.0 || aside > 0.28;
}

} // namespace

Around look_around(const Points& points, const Eigen::VectorXd& held, const PointTree& tree,
                   double radius, double gap) {
  const Index n = points.rows();
  std::vector<std::array<int, 2>> leaves;
  tree.each_leaf([&](int first, int last) { leaves.push_back({first, last}); });
  const std::size_t parts = (leaves.size() + kPart - 1) / kPart;
  Around found{Points::Zero(n, 3), Eigen::VectorXd(n),
               std::vector<char>(static_cast<std::size_t>(n)), Eigen::VectorXd::Zero(n),
               std::vector<std::vector<std::array<int, 2>>>(parts)};
#pragma omp parallel
  {
    Near near(tree);
#pragma omp for schedule(dynamic, 1)
    for (std::size_t part = 0; part < parts; ++part)
      for (std::size_t l = part * kPart; l < std::min(leaves.size(), (part + 1) * kPart); ++l) {
        near.gather(tree, held, leaves[l][0], leaves[l][1], radius);
        for (int k = leaves[l][0]; k < leaves[l][1]; ++k) {
          const int i = tree.order()[static_cast<std::size_t>(k)];
          const auto link = [&](int j) { found.links[part].push_back({i, j}); };
          describe(near.moments(tree.at(k), radius, gap, i, link), radius, i, found);
        }
      }
  }
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
