#include "cell_order.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <utility>

namespace supple {
namespace {

constexpr int kBits = 21; // a coordinate; three make a key

/// Bits of `x` three apart.
std::uint64_t spread(std::uint64_t x) {
  x &= (std::uint64_t{1} << kBits) - 1;
  x = (x | x << 32) & 0x1f00000000ffff;
  x = (x | x << 16) & 0x1f0000ff0000ff;
  x = (x | x << 8) & 0x100f00f00f00f00f;
  x = (x | x << 4) & 0x10c30c30c30c30c3;
  return (x | x << 2) & 0x1249249249249249;
}

Eigen::Vector3d centre(const Vector& points, const Connectivity& cells, Eigen::Index c, Index m) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (Index a = 0; a < m; ++a)
    sum += points.segment<3>(3 * Eigen::Index{cells(c, a)});
  return sum / m;
}

} // namespace

std::vector<Index> order_cells(const Vector& points, const Connectivity& cells, Index m) {
  const Eigen::Map<const Eigen::Matrix3Xd> all(points.data(), 3, points.size() / 3);
  Eigen::Vector3d low = Eigen::Vector3d::Zero();
  double scale = 0.0;
  if (all.cols() > 0) {
    low = all.rowwise().minCoeff();
    scale = (all.rowwise().maxCoeff() - low).maxCoeff();
    scale = scale > 0.0 ? std::ldexp(1.0, kBits - 1) / scale : 0.0;
  }
  std::vector<std::pair<std::uint64_t, Index>> keys(static_cast<std::size_t>(cells.rows()));
  for (Eigen::Index c = 0; c < cells.rows(); ++c) {
    const Eigen::Vector3d place = (centre(points, cells, c, m) - low) * scale;
    std::uint64_t key = 0;
    for (int i = 0; i < 3; ++i)
      key |= spread(static_cast<std::uint64_t>(std::fmax(place[i], 0.0))) << i;
    keys[static_cast<std::size_t>(c)] = {key, static_cast<Index>(c)};
  }
  std::sort(keys.begin(), keys.end());
  std::vector<Index> order(keys.size());
  for (std::size_t k = 0; k < keys.size(); ++k)
    order[k] = keys[k].second;
  return order;
}

} // namespace supple
