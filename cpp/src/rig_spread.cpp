#include "rig_spread.hpp"

#include <algorithm>
#include <array>
#include <cmath>

namespace supple {

using Vec3 = Eigen::Vector3d;

double robust_sd(std::vector<double> values) {
  if (values.empty()) return 0.0;
  for (double& value : values)
    value = std::abs(value);
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return 1.4826 * *middle;
}

std::vector<double> patch_means(const std::vector<Row>& rows, const Points& vertices, double size) {
  struct Entry {
    std::array<long, 3> cube;
    double weight, residual;
  };
  std::vector<Entry> entries;
  for (const Row& row : rows) {
    const double residual = row.residual(vertices);
    const double weight = row.weight * loss_weight(residual, row.loss);
    const Vec3 cube = (row.target / size).array().floor();
    entries.push_back(
        {{std::lround(cube[0]), std::lround(cube[1]), std::lround(cube[2])}, weight, residual});
  }
  std::stable_sort(entries.begin(), entries.end(),
                   [](const Entry& a, const Entry& b) { return a.cube < b.cube; });
  std::vector<double> means;
  for (std::size_t i = 0; i < entries.size();) {
    double sum = 0.0, weight = 0.0;
    const auto cube = entries[i].cube;
    for (; i < entries.size() && entries[i].cube == cube; ++i) {
      sum += entries[i].weight * entries[i].residual;
      weight += entries[i].weight;
    }
    if (weight > 0.0) means.push_back(sum / weight);
  }
  return means;
}

} // namespace supple
