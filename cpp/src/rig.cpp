#include "supple/rig.hpp"

#include <algorithm>
#include <array>
#include <Eigen/Cholesky>
#include <string>

#include "rig_skin.hpp"
#include "supple/error.hpp"

namespace supple {
namespace {

using Vec3 = Eigen::Vector3d;

void check_arrays(const RigArrays& a) {
  const Eigen::Index n = a.points.rows(), bones = a.joints.rows();
  if (n == 0 || bones == 0)
    throw ShapeError("points and joints must have a row at least, got " + std::to_string(n) +
                     " and " + std::to_string(bones) + "; give a template with bones");
  require_size("parents", a.parents.size(), bones, "give one parent a joint");
  require_size("weights' rows", a.weights.rows(), n, "give one row a point");
  require_size("weights' columns", a.weights.cols(), bones, "give one column a bone");
  if (a.blendshapes.rows() > 0)
    require_size("blendshapes' columns", a.blendshapes.cols(), 3 * n, "give x, y, z a point");
  if (a.triangles.size() > 0 && (a.triangles.minCoeff() < 0 || a.triangles.maxCoeff() >= n))
    throw ShapeError("triangles must name points from 0 to " + std::to_string(n - 1) +
                     "; renumber the triangles");
  for (Eigen::Index k = 0; k < bones; ++k)
    if (a.parents[k] >= k || (a.parents[k] < 0) != (k == 0))
      throw ShapeError("parents must name an earlier bone, -1 for the first alone, got " +
                       std::to_string(a.parents[k]) + " at " + std::to_string(k) +
                       "; sort the bones");
  if (!a.points.allFinite() || !a.joints.allFinite() || !a.weights.allFinite() ||
      !a.blendshapes.allFinite())
    throw NumericalError("a template must be finite, got NaN or infinity; repair it");
}

} // namespace

Rig::Rig(const RigArrays& arrays, Skinning skinning) : skinning_(skinning) {
  check_arrays(arrays);
  points_ = arrays.points;
  triangles_ = arrays.triangles;
  parents_ = arrays.parents;
  shapes_ = static_cast<int>(arrays.blendshapes.rows());
  for (Eigen::Index k = 0; k < arrays.joints.rows(); ++k)
    joints_.push_back(arrays.joints.row(k).transpose());
  weight_start_.push_back(0);
  offset_start_.push_back(0);
  for (int i = 0; i < vertices(); ++i) {
    for (int k = 0; k < bones(); ++k)
      if (arrays.weights(i, k) != 0.0) weights_.push_back({k, arrays.weights(i, k)});
    for (int a = 0; a < shapes_; ++a) {
      const Vec3 offset = arrays.blendshapes.row(a).segment<3>(3 * i).transpose();
      if (!offset.isZero(0.0)) offsets_.push_back({a, offset});
    }
    weight_start_.push_back(static_cast<int>(weights_.size()));
    offset_start_.push_back(static_cast<int>(offsets_.size()));
  }
  find_border();
}

/// A vertex is inside where the edges opposite to it close a ring: they then begin where they end,
/// counted by numbers that are all different.
void Rig::find_border() {
  const auto label = [](std::int32_t v) {
    return (static_cast<std::uint64_t>(v) + 1) * 0x9E3779B97F4A7C15ull;
  };
  std::vector<std::uint64_t> sum(static_cast<std::size_t>(vertices()), 0);
  for (Eigen::Index t = 0; t < triangles_.rows(); ++t)
    for (int c = 0; c < 3; ++c)
      sum[static_cast<std::size_t>(triangles_(t, c))] +=
          label(triangles_(t, (c + 1) % 3)) - label(triangles_(t, (c + 2) % 3));
  border_.resize(sum.size());
  for (std::size_t i = 0; i < sum.size(); ++i)
    border_[i] = sum[i] != 0;
}

RigPosture Rig::rest() const {
  const std::size_t bones = joints_.size();
  return {std::vector<Eigen::Matrix3d>(bones, Eigen::Matrix3d::Identity()),
          std::vector<Vec3>(bones, Vec3::Zero()), std::vector<Vec3>(bones, Vec3::Ones()),
          Eigen::VectorXd::Zero(shapes_)};
}

void Rig::check(const RigPosture& posture) const {
  const char* const remedy = "give the posture of this template";
  require_size("rotations", static_cast<long long>(posture.rotations.size()), bones(), remedy);
  require_size("translations", static_cast<long long>(posture.translations.size()), bones(),
               remedy);
  require_size("scales", static_cast<long long>(posture.scales.size()), bones(), remedy);
  require_size("blend", posture.blend.size(), shapes_, remedy);
}

Points Rig::posed(const RigPosture& posture) const {
  check(posture);
  const SkinState state(*this, posture);
  return state.points;
}

RowMatrix Rig::jacobian(const RigPosture& posture) const {
  check(posture);
  const SkinState state(*this, posture);
  RowMatrix J = RowMatrix::Zero(3 * vertices(), unknowns());
  for (int i = 0; i < vertices(); ++i)
    for (int d = 0; d < 3; ++d)
      state.add_row(i, Vec3::Unit(d),
                    [&, row = 3 * i + d](int column, double value) { J(row, column) += value; });
  return J;
}

Eigen::VectorXd Rig::vertex_sd(const RigPosture& posture,
                               const Eigen::Ref<const Eigen::MatrixXd>& covariance,
                               const Eigen::VectorXi& of) const {
  check(posture);
  require_size("covariance's rows", covariance.rows(), unknowns(), "one row an unknown");
  require_size("covariance's columns", covariance.cols(), unknowns(), "one column an unknown");
  const SkinState state(*this, posture);
  if (of.size() > 0 && (of.minCoeff() < 0 || of.maxCoeff() >= vertices()))
    throw ShapeError("of must name vertices of the template; renumber them");
  Eigen::VectorXd sd(of.size());
#pragma omp parallel for schedule(static)
  for (Eigen::Index k = 0; k < of.size(); ++k) {
    const int i = of[k];
    std::vector<int> columns;
    std::vector<std::array<double, 3>> values; // of the three axes, whose columns are the same
    for (int d = 0; d < 3; ++d) {
      std::size_t to = 0;
      state.add_row(i, Vec3::Unit(d), [&](int column, double value) {
        if (d == 0) {
          columns.push_back(column);
          values.emplace_back();
        }
        values[to++][static_cast<std::size_t>(d)] = value;
      });
    }
    double trace = 0.0;
    for (std::size_t a = 0; a < columns.size(); ++a) {
      const double* const column = &covariance.coeffRef(0, columns[a]);
      const auto& x = values[a];
      std::array<double, 3> sum{};
      for (std::size_t b = 0; b < a; ++b)
        for (std::size_t d = 0; d < 3; ++d)
          sum[d] += column[columns[b]] * values[b][d];
      for (std::size_t d = 0; d < 3; ++d)
        trace += x[d] * (2.0 * sum[d] + column[columns[a]] * x[d]);
    }
    sd[k] = std::sqrt(std::max(trace, 0.0) / 3.0);
  }
  return sd;
}

RigPosture stepped(const RigPosture& posture, const Eigen::VectorXd& step) {
  RigPosture next = posture;
  for (std::size_t k = 0; k < posture.rotations.size(); ++k) {
    const Eigen::Index c = 9 * static_cast<Eigen::Index>(k);
    const Vec3 turn = step.segment<3>(c);
    next.rotations[k] = rotation_of<double>(turn) * posture.rotations[k];
    next.translations[k] += step.segment<3>(c + 3);
    next.scales[k] += step.segment<3>(c + 6);
  }
  next.blend += step.tail(posture.blend.size());
  return next;
}

} // namespace supple
