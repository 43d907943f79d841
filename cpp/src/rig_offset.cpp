#include "rig_offset.hpp"

#include <algorithm>
#include <cmath>
#include <Eigen/Geometry>

#include "supple/error.hpp"

namespace supple {
namespace {

using Vec3 = Eigen::Vector3d;
constexpr double kPi = 3.14159265358979323846;
/// Corners of the six pairs of a triangle.
constexpr int kPairs[6][2] = {{0, 0}, {1, 1}, {2, 2}, {0, 1}, {1, 2}, {2, 0}};

std::size_t at(Eigen::Index i) {
  return static_cast<std::size_t>(i);
}

Points unit_normals(const Points& points, const Triangles& triangles) {
  Points normals = Points::Zero(points.rows(), 3);
  for (Eigen::Index t = 0; t < triangles.rows(); ++t) {
    const Vec3 a = points.row(triangles(t, 0)).transpose();
    const Vec3 b = points.row(triangles(t, 1)).transpose();
    const Vec3 c = points.row(triangles(t, 2)).transpose();
    const Vec3 cross = (b - a).cross(c - a);
    for (int k = 0; k < 3; ++k)
      normals.row(triangles(t, k)) += cross.transpose();
  }
  normals.rowwise().normalize();
  return normals;
}

} // namespace

OffsetSolver::OffsetSolver(const Rig& rig) : rig_(rig) {
  around_.resize(at(rig.vertices()));
  for (int v = 0; v < rig.vertices(); ++v)
    around_[at(v)].push_back(v);
  for (Eigen::Index t = 0; t < rig.triangles().rows(); ++t)
    for (int c = 0; c < 3; ++c)
      for (int d = 1; d < 3; ++d)
        around_[at(rig.triangles()(t, c))].push_back(rig.triangles()(t, (c + d) % 3));
  for (std::vector<int>& near : around_) {
    std::sort(near.begin(), near.end());
    near.erase(std::unique(near.begin(), near.end()), near.end());
  }
  make_pattern();
  factor_.analyse(pattern_);
  for (Eigen::Index t = 0; t < rig.triangles().rows(); ++t) {
    std::array<std::int64_t, 6> six;
    for (std::size_t p = 0; p < 6; ++p)
      six[p] = place(rig.triangles()(t, kPairs[p][0]), rig.triangles()(t, kPairs[p][1]));
    six_.push_back(six);
  }
}

void OffsetSolver::make_pattern() {
  pattern_.size = rig_.vertices();
  pattern_.lower = true;
  pattern_.start.push_back(0);
  std::vector<int> rows;
  for (int v = 0; v < rig_.vertices(); ++v) {
    rows.clear();
    for (const int k : around_[at(v)])
      for (const int i : around_[at(k)])
        if (i >= v) rows.push_back(i);
    std::sort(rows.begin(), rows.end());
    rows.erase(std::unique(rows.begin(), rows.end()), rows.end());
    pattern_.row.insert(pattern_.row.end(), rows.begin(), rows.end());
    pattern_.start.push_back(pattern_.nonzeros());
  }
}

std::int64_t OffsetSolver::place(int row, int column) const {
  if (row < column) std::swap(row, column);
  const auto begin = pattern_.row.begin() + pattern_.start[at(column)];
  const auto end = pattern_.row.begin() + pattern_.start[at(column) + 1];
  return std::lower_bound(begin, end, row) - pattern_.row.begin();
}

/// Q; and the skin's area, m².
void OffsetSolver::add_prior(const Points& skin, const RigOffsetSettings& settings,
                             Eigen::VectorXd& values, double& area) const {
  const Eigen::Index n = skin.rows();
  const double kappa2 = 8.0 / (settings.length * settings.length);
  Eigen::VectorXd mass = Eigen::VectorXd::Zero(n);
  std::vector<std::vector<double>> K(at(n)); // in the order of around_
  for (Eigen::Index v = 0; v < n; ++v)
    K[at(v)].assign(around_[at(v)].size(), 0.0);
  const auto entry = [&](int row, int column) -> double& {
    const std::vector<int>& near = around_[at(row)];
    return K[at(row)][at(std::lower_bound(near.begin(), near.end(), column) - near.begin())];
  };
  area = 0.0;
  for (Eigen::Index t = 0; t < rig_.triangles().rows(); ++t) {
    const auto v = rig_.triangles().row(t);
    Vec3 edge[3]; // opposite to each corner
    for (int c = 0; c < 3; ++c)
      edge[c] = (skin.row(v[(c + 2) % 3]) - skin.row(v[(c + 1) % 3])).transpose();
    const double twice = edge[0].cross(edge[1]).norm();
    area += 0.5 * twice;
    for (int a = 0; a < 3; ++a) {
      mass[v[a]] += twice / 6.0;
      for (int b = 0; b < 3; ++b)
        entry(v[a], v[b]) += edge[a].dot(edge[b]) / (2.0 * std::max(twice, 1e-12));
    }
  }
  mass = mass.cwiseMax(1e-3 * mass.mean());
  for (Eigen::Index i = 0; i < n; ++i)
    entry(static_cast<int>(i), static_cast<int>(i)) += kappa2 * mass[i];
  const double tau2 = 1.0 / (4.0 * kPi * kappa2 * settings.prior * settings.prior);
  for (Eigen::Index k = 0; k < n; ++k) {
    const std::vector<int>& near = around_[at(k)];
    const std::vector<double>& row = K[at(k)];
    for (std::size_t b = 0; b < near.size(); ++b) {
      std::int64_t to = pattern_.start[at(near[b])];
      const double scaled = tau2 / mass[k] * row[b];
      for (std::size_t a = b; a < near.size(); ++a) { // rows ascend, in `near` as in the pattern
        while (pattern_.row[at(to)] != near[a])
          ++to;
        values[to] += scaled * row[a];
      }
    }
  }
}

/// Bᵀ W B and Bᵀ W r of the scan's points that land near, and face what they land on.
void OffsetSolver::add_data(const Points& skin, const Points& along, const ScanCloud& scan,
                            const std::vector<Landing>& landed, double one,
                            const RigOffsetSettings& settings, const Eigen::VectorXd& h,
                            Eigen::VectorXd& values, Eigen::VectorXd& right) const {
  const double loss = std::max(4.0 * settings.prior, 4e-3);
  for (Eigen::Index i = 0; i < scan.points.rows(); ++i) {
    const Landing& hit = landed[at(i)];
    if (hit.triangle < 0) continue;
    const auto v = rig_.triangles().row(hit.triangle);
    Vec3 normal = Vec3::Zero(), on = Vec3::Zero();
    double before = 0.0;
    for (int c = 0; c < 3; ++c) {
      const double share = hit.barycentric[c];
      normal += share * along.row(v[c]).transpose();
      on += share * (skin.row(v[c]) + h[v[c]] * along.row(v[c])).transpose();
      before += share * h[v[c]];
    }
    const Vec3 facing = scan.normals.row(i).transpose();
    const double cosine = normal.dot(facing);
    const bool known = !facing.isZero(0.0);
    if (known && (scan.oriented ? cosine : std::abs(cosine)) <= 0.5) continue;
    const double away = normal.dot(scan.points.row(i).transpose() - on);
    if (hit.squared - away * away >= settings.aside * settings.aside) continue;
    const double ratio = 1.0 / (1.0 + away * away / (loss * loss));
    const double weight = ratio * ratio;
    if (weight <= 1e-3) continue;
    const std::array<std::int64_t, 6>& six = six_[at(hit.triangle)];
    for (std::size_t p = 0; p < 6; ++p)
      values[six[p]] +=
          one * weight * hit.barycentric[kPairs[p][0]] * hit.barycentric[kPairs[p][1]];
    for (int c = 0; c < 3; ++c)
      right[v[c]] += one * weight * hit.barycentric[c] * (before + away);
  }
}

/// Both triangles of the matrix, by columns.
void OffsetSolver::fill_full(const Eigen::VectorXd& values, RigOffset& result) const {
  const Eigen::Index n = static_cast<Eigen::Index>(pattern_.size);
  result.start = Eigen::VectorXi::Zero(n + 1);
  const auto each = [&](const auto& use) {
    for (Eigen::Index c = 0; c < n; ++c)
      for (std::int64_t k = pattern_.start[at(c)]; k < pattern_.start[at(c) + 1]; ++k)
        use(static_cast<int>(pattern_.row[at(k)]), static_cast<int>(c), values[k]);
  };
  each([&](int row, int column, double) {
    ++result.start[column + 1];
    if (row != column) ++result.start[row + 1];
  });
  for (Eigen::Index c = 0; c < n; ++c)
    result.start[c + 1] += result.start[c];
  Eigen::VectorXi next = result.start.head(n);
  result.row.resize(result.start[n]);
  result.values.resize(result.start[n]);
  const auto put = [&](int row, int column, double value) {
    result.row[next[column]] = row;
    result.values[next[column]++] = value;
  };
  each([&](int row, int column, double value) { // rows left of the diagonal come first: ascending
    put(row, column, value);
    if (row != column) put(column, row, value);
  });
}

RigOffset OffsetSolver::solve(const Points& skin, const ScanCloud& scan, Matcher& matcher,
                              const RigOffsetSettings& settings) {
  const Eigen::Index n = skin.rows();
  RigOffset result;
  result.along = unit_normals(skin, rig_.triangles());
  result.height = Eigen::VectorXd::Zero(n);
  Eigen::VectorXd prior = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(pattern_.nonzeros()));
  double area = 0.0;
  add_prior(skin, settings, prior, area);
  Eigen::VectorXd values = prior, right(n);
  for (int round = 0; round < settings.rounds; ++round) {
    const Points moved = skin + (result.along.array().colwise() * result.height.array()).matrix();
    const std::vector<Landing> landed = matcher.land_scan(moved, settings.reach);
    values = prior;
    right.setZero();
    add_data(skin, result.along, scan, landed, area * settings.per_area, settings, result.height,
             values, right);
    if (!factor_.factorise(values).ok())
      throw NumericalError("an offset's prior must bound it, got a matrix that is not positive "
                           "definite; give a larger least sd");
    Eigen::VectorXd height(n);
    factor_.solve(right, height, {1e-10, 2});
    result.height = height;
  }
  fill_full(values, result);
  return result;
}

} // namespace supple
