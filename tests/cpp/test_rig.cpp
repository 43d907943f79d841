#include "supple/rig.hpp"

#include <cmath>
#include <complex>

#include "check.hpp"
#include "rig_skin.hpp"
#include "supple/error.hpp"
#include "supple/rig_fit.hpp"

using namespace supple;

namespace {

using Complex = std::complex<double>;
using Vec3 = Eigen::Vector3d;

/// Numbers in [−1, 1] that are always the same.
class Numbers {
 public:
  double next() {
    state_ = state_ * 6364136223846793005ull + 1442695040888963407ull;
    return 2.0 * static_cast<double>(state_ >> 11) / 9007199254740992.0 - 1.0;
  }

 private:
  unsigned long long state_ = 42;
};

/// A tube of 12 × 9 points around z with three bones in a row and four blendshapes.
RigArrays tube() {
  constexpr int around = 12, along = 9, bones = 3, shapes = 4;
  Numbers numbers;
  RigArrays a;
  a.points.resize(around * along, 3);
  a.weights = RowMatrix::Zero(around * along, bones);
  a.triangles.resize(2 * around * (along - 1), 3);
  for (int j = 0, t = 0; j < along; ++j)
    for (int i = 0; i < around; ++i) {
      const double angle = 2.0 * M_PI * i / around, z = 0.05 * j;
      const int p = j * around + i, right = j * around + (i + 1) % around;
      a.points.row(p) << 0.15 * std::cos(angle), 0.1 * std::sin(angle), z;
      for (int k = 0; k < bones; ++k)
        a.weights(p, k) = std::exp(-std::pow((z - 0.2 * k) / 0.1, 2));
      a.weights.row(p) /= a.weights.row(p).sum();
      if (j + 1 == along) continue;
      a.triangles.row(t++) << p, right, right + around;
      a.triangles.row(t++) << p, right + around, p + around;
    }
  a.joints.resize(bones, 3);
  a.joints << 0, 0, 0, 0, 0.01, 0.15, 0, 0, 0.3;
  a.parents = Eigen::Vector3i(-1, 0, 1);
  a.blendshapes.resize(shapes, 3 * around * along);
  for (Eigen::Index c = 0; c < a.blendshapes.size(); ++c)
    a.blendshapes.data()[c] = numbers.next() > 0.5 ? 0.01 * numbers.next() : 0.0;
  return a;
}

RigPosture bent(const Rig& rig) {
  Numbers numbers;
  Eigen::VectorXd step(rig.unknowns());
  for (double& value : step)
    value = 0.3 * numbers.next();
  return stepped(rig.rest(), step);
}

/// exp(i h ω) R and so on: the posture after an imaginary step of unknown `c`.
PostureOf<Complex> complex_step(const RigPosture& at, int c, double h) {
  PostureOf<Complex> next;
  for (std::size_t k = 0; k < at.rotations.size(); ++k) {
    next.rotations.push_back(at.rotations[k].cast<Complex>());
    next.translations.push_back(at.translations[k].cast<Complex>());
    next.scales.push_back(at.scales[k].cast<Complex>());
  }
  next.blend = at.blend.cast<Complex>();
  const int bones = static_cast<int>(at.rotations.size());
  if (c >= 9 * bones) {
    next.blend[c - 9 * bones] += Complex(0, h);
    return next;
  }
  const std::size_t k = static_cast<std::size_t>(c / 9);
  Eigen::Matrix<Complex, 3, 1> change = Eigen::Matrix<Complex, 3, 1>::Zero();
  change[c % 3] = Complex(0, h);
  if (c % 9 < 3)
    next.rotations[k] = rotation_of<Complex>(change) * next.rotations[k];
  else if (c % 9 < 6)
    next.translations[k] += change;
  else
    next.scales[k] += change;
  return next;
}

/// Largest difference between the Jacobian and complex steps, which have no rounding of their own.
template <template <class> class Bones>
double jacobian_error(const Rig& rig) {
  constexpr double h = 1e-40;
  const RigPosture at = bent(rig);
  const RowMatrix J = rig.jacobian(at);
  double worst = 0.0;
  for (int c = 0; c < rig.unknowns(); ++c) {
    const PostureOf<Complex> next = complex_step(at, c, h);
    const Bones<Complex> bones(rig, next);
    for (int i = 0; i < rig.vertices(); ++i) {
      const auto x = shape_at<Complex>(rig, next.blend, i);
      const Vec3 slope = bones.vertex(rig, i, x).imag() / h;
      worst = std::max(worst, (slope - J.block<3, 1>(3 * i, c)).cwiseAbs().maxCoeff());
    }
  }
  return worst;
}

/// Largest distance from R x + t when every bone moves so.
double rigid_error(Skinning skinning) {
  const Rig rig(tube(), skinning);
  RigPosture at = rig.rest();
  const Eigen::Matrix3d R = rotation_of<double>(Vec3(0.3, -2.0, 0.9));
  const Vec3 t(0.1, -0.2, 0.3);
  for (int k = 0; k < rig.bones(); ++k) {
    at.rotations[static_cast<std::size_t>(k)] = R;
    at.translations[static_cast<std::size_t>(k)] = R * rig.joint(k) + t - rig.joint(k);
  }
  const Points expected = (rig.points() * R.transpose()).rowwise() + t.transpose();
  return (rig.posed(at) - expected).cwiseAbs().maxCoeff();
}

} // namespace

TEST(a_rigid_motion_of_all_bones_is_one_of_the_skin) {
  CHECK_BELOW(rigid_error(Skinning::Linear), 1e-14);
  CHECK_BELOW(rigid_error(Skinning::DualQuaternion), 1e-14);
}

TEST(the_jacobian_of_linear_blend_skinning_is_that_of_complex_steps) {
  CHECK_BELOW(jacobian_error<LinearBones>(Rig(tube())), 1e-10);
}

TEST(the_jacobian_of_dual_quaternion_skinning_is_that_of_complex_steps) {
  CHECK_BELOW(jacobian_error<DualBones>(Rig(tube(), Skinning::DualQuaternion)), 1e-10);
}

TEST(both_kinds_of_skinning_agree_where_one_bone_holds_a_vertex) {
  RigArrays arrays = tube();
  arrays.weights.setZero();
  for (Eigen::Index i = 0; i < arrays.weights.rows(); ++i)
    arrays.weights(i, i % 3) = 1.0;
  const Rig linear(arrays), dual(arrays, Skinning::DualQuaternion);
  const RigPosture at = bent(linear);
  CHECK_BELOW((linear.posed(at) - dual.posed(at)).cwiseAbs().maxCoeff(), 1e-14);
}

TEST(a_border_is_where_a_triangle_has_no_neighbour) {
  const Rig rig(tube());
  for (int i = 0; i < rig.vertices(); ++i)
    CHECK(rig.at_border(i) == (i < 12 || i >= rig.vertices() - 12));
}

TEST(a_fit_without_a_scan_and_arrays_that_do_not_fit_are_refused) {
  const auto rig = std::make_shared<const Rig>(tube());
  RigLandmarks none;
  none.barycentric = none.target = Points(0, 3);
  CHECK_THROWS(RigFit(rig).run(rig->rest(), {}, {}, {RigStage()}, none), StateError);
  RigArrays wrong = tube();
  wrong.parents[1] = 2;
  CHECK_THROWS(Rig{wrong}, ShapeError);
  RigPosture small = rig->rest();
  small.blend.resize(1);
  CHECK_THROWS(rig->posed(small), ShapeError);
}
