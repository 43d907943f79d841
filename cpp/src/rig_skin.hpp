/// The skinning of one vertex, for any scalar, and its derivatives; private to the runtime.
#pragma once

#include <array>
#include <cmath>
#include <optional>
#include <vector>

#include "rig_dual.hpp"

namespace supple {

template <class T>
Eigen::Matrix<T, 3, 3> skew(const Eigen::Matrix<T, 3, 1>& w) {
  Eigen::Matrix<T, 3, 3> cross;
  cross << T(0), -w[2], w[1], w[2], T(0), -w[0], -w[1], w[0], T(0);
  return cross;
}

/// exp(ω): the rotation by |ω| rad about ω; for complex steps too.
template <class T>
Eigen::Matrix<T, 3, 3> rotation_of(const Eigen::Matrix<T, 3, 1>& w) {
  using std::cos, std::sin, std::sqrt, std::abs;
  const T angle2 = w[0] * w[0] + w[1] * w[1] + w[2] * w[2];
  const Eigen::Matrix<T, 3, 3> cross = skew(w);
  T a, b; // sin θ/θ, (1 − cos θ)/θ²
  if (abs(angle2) < 1e-6) {
    a = T(1) - angle2 / T(6) * (T(1) - angle2 / T(20));
    b = T(0.5) - angle2 / T(24) * (T(1) - angle2 / T(30));
  } else {
    const T angle = sqrt(angle2);
    a = sin(angle) / angle;
    b = (T(1) - cos(angle)) / angle2;
  }
  return Eigen::Matrix<T, 3, 3>::Identity() + a * cross + b * cross * cross;
}

/// The blended shape x_i.
template <class T>
Eigen::Matrix<T, 3, 1> shape_at(const Rig& rig, const Eigen::Matrix<T, Eigen::Dynamic, 1>& blend,
                                int i) {
  Eigen::Matrix<T, 3, 1> x = rig.points().row(i).transpose().template cast<T>();
  for (const ShapeOffset& shape : rig.shapes_at(i))
    x += blend[shape.shape] * shape.offset.template cast<T>();
  return x;
}

/// The bones of a posture, in the form that skinning uses.
template <class T>
struct LinearBones {
  using Mat3 = Eigen::Matrix<T, 3, 3>;
  using Vec3 = Eigen::Matrix<T, 3, 1>;
  std::vector<Mat3> affine; ///< R S
  std::vector<Vec3> offset; ///< j + t − R S j

  LinearBones(const Rig& rig, const PostureOf<T>& posture) {
    for (std::size_t k = 0; k < posture.rotations.size(); ++k) {
      const Vec3 joint = rig.joint(static_cast<int>(k)).template cast<T>();
      affine.push_back(posture.rotations[k] * posture.scales[k].asDiagonal());
      offset.push_back(joint + posture.translations[k] - affine.back() * joint);
    }
  }

  /// ∂v_i/∂x_i.
  Mat3 gradient(const Rig& rig, int i) const {
    Mat3 A = Mat3::Zero();
    for (const BoneWeight& at : rig.bones_at(i))
      A += T(at.weight) * affine[static_cast<std::size_t>(at.bone)];
    return A;
  }

  Vec3 vertex(const Rig& rig, int i, const Vec3& x) const {
    Vec3 v = Vec3::Zero();
    for (const BoneWeight& at : rig.bones_at(i)) {
      const std::size_t k = static_cast<std::size_t>(at.bone);
      v += T(at.weight) * (affine[k] * x + offset[k]);
    }
    return v;
  }
};

/// Which unknowns derivatives are taken by.
enum class Unknowns { Bones, All };

/// A posed skin and what its derivatives need.
struct SkinState {
  using Vec3 = Eigen::Vector3d;
  const Rig& rig;
  RigPosture posture;
  LinearBones<double> bones;
  std::optional<DualBones<double>> dual;
  Points shape;                          ///< (n, 3) m, x
  Points points;                         ///< (n, 3) m, v
  std::vector<Eigen::Matrix3d> gradient; ///< ∂v/∂x

  SkinState(const Rig& of, const RigPosture& at)
      : rig(of), posture(at), bones(of, at), shape(of.vertices(), 3), points(of.vertices(), 3),
        gradient(static_cast<std::size_t>(of.vertices())) {
    if (rig.skinning() == Skinning::DualQuaternion) dual.emplace(rig, posture);
#pragma omp parallel for schedule(static)
    for (int i = 0; i < rig.vertices(); ++i) {
      const Vec3 x = shape_at<double>(rig, posture.blend, i);
      shape.row(i) = x.transpose();
      points.row(i) = (dual ? dual->vertex(rig, i, x) : bones.vertex(rig, i, x)).transpose();
      gradient[static_cast<std::size_t>(i)] = dual ? dual_gradient(i) : bones.gradient(rig, i);
    }
  }

  /// add(column, ∂(d·Σ_c share_c v_c)/∂unknown): the corners' bones are mostly the same, whose
  /// columns are linear in Σ share w and Σ share w x.
  template <class Add>
  void add_point(const std::array<int, 3>& vertex, const std::array<double, 3>& share,
                 const Vec3& d, Unknowns of, const Add& add) const {
    if (dual) {
      for (std::size_t c = 0; c < 3; ++c)
        if (share[c] != 0.0) add_row(vertex[c], share[c] * d, add, of);
      return;
    }
    Sums sums;
    for (std::size_t c = 0; c < 3; ++c)
      if (share[c] != 0.0 && !sums.add(rig, vertex[c], share[c], shape.row(vertex[c]).transpose()))
        add_linear(vertex[c], share[c] * d, add);
    for (std::size_t b = 0; b < sums.count; ++b)
      add_sum(sums.bone[b], sums.weight[b], sums.arm[b], d, add);
    for (std::size_t c = 0; c < 3 && of == Unknowns::All; ++c)
      if (share[c] != 0.0) add_shapes(vertex[c], share[c] * d, add);
  }

  /// add(column, ∂(d·v_i)/∂unknown) for every unknown that moves vertex i.
  template <class Add>
  void add_row(int i, const Vec3& d, const Add& add, Unknowns of = Unknowns::All) const {
    if (dual)
      add_dual(i, d, add);
    else
      add_linear(i, d, add);
    if (of == Unknowns::All) add_shapes(i, d, add);
  }

 private:
  /// Of each bone Σ share w, and Σ share w (x − j).
  struct Sums {
    static constexpr std::size_t kMost = 16;
    std::size_t count = 0;
    std::array<int, kMost> bone;
    std::array<double, kMost> weight;
    std::array<Vec3, kMost> arm;

    /// False, and nothing added, if there might be no room.
    bool add(const Rig& rig, int i, double share, const Vec3& x) {
      const Part<BoneWeight> all = rig.bones_at(i);
      if (count + static_cast<std::size_t>(all.end() - all.begin()) > kMost) return false;
      for (const BoneWeight& at : all) {
        std::size_t b = 0;
        while (b < count && bone[b] != at.bone)
          ++b;
        if (b == count) {
          bone[count] = at.bone;
          weight[count] = 0.0;
          arm[count++].setZero();
        }
        weight[b] += share * at.weight;
        arm[b] += share * at.weight * (x - rig.joint(at.bone));
      }
      return true;
    }
  };

  template <class Add>
  void add_sum(int bone, double weight, const Vec3& arm, const Vec3& d, const Add& add) const {
    const std::size_t k = static_cast<std::size_t>(bone);
    const Vec3 lever = bones.affine[k] * arm;
    add_bone(bone, lever.cross(d), weight * d,
             (posture.rotations[k].transpose() * d).cwiseProduct(arm), add);
  }

  template <class Add>
  void add_shapes(int i, const Vec3& d, const Add& add) const {
    const Vec3 pull = gradient[static_cast<std::size_t>(i)].transpose() * d;
    for (const ShapeOffset& at : rig.shapes_at(i))
      add(9 * rig.bones() + at.shape, pull.dot(at.offset));
  }

  template <class Add>
  static void add_bone(int bone, const Vec3& turn, const Vec3& push, const Vec3& stretch,
                       const Add& add) {
    for (int c = 0; c < 3; ++c) {
      add(9 * bone + c, turn[c]);
      add(9 * bone + 3 + c, push[c]);
      add(9 * bone + 6 + c, stretch[c]);
    }
  }

  template <class Add>
  void add_linear(int i, const Vec3& d, const Add& add) const {
    const Vec3 x = shape.row(i).transpose();
    for (const BoneWeight& at : rig.bones_at(i))
      add_sum(at.bone, at.weight, at.weight * (x - rig.joint(at.bone)), d, add);
  }

  template <class Add>
  void add_dual(int i, const Vec3& d, const Add& add) const {
    const Vec3 x = shape.row(i).transpose(), u = dual->scaled(rig, i, x);
    const auto blend = dual->blend(rig, i);
    const Vec3 back = turn_of_blend(blend).transpose() * d;
    Quaternion<double> of_real, of_dual;
    pull_back(blend, u, d, of_real, of_dual);
    const std::size_t heavy = DualBones<double>::heaviest(rig, i);
    for (const BoneWeight& at : rig.bones_at(i)) {
      const std::size_t k = static_cast<std::size_t>(at.bone);
      const Quaternion<double>& q = dual->real[k];
      const Vec3 joint = rig.joint(at.bone), far = posture.rotations[k] * joint;
      const Vec3 shift = joint + posture.translations[k] - far;
      const double weight = at.weight * dual->sign(k, heavy);
      const Vec3 push = 0.5 * weight * pulled(of_dual, q);
      Quaternion<double> through; // (0, shift)ᵀ of_dual
      through[0] = shift.dot(of_dual.tail<3>());
      through.tail<3>() = -of_dual[0] * shift + of_dual.tail<3>().cross(shift);
      const Vec3 turn =
          weight * (0.5 * pulled(of_real, q) + 0.25 * pulled(through, q)) - far.cross(push);
      add_bone(at.bone, turn, push, at.weight * back.cwiseProduct(x - joint), add);
    }
  }

  static Eigen::Matrix3d turn_of_blend(const DualBones<double>::Blend& b) {
    return Eigen::Quaterniond(b.real[0], b.real[1], b.real[2], b.real[3])
        .normalized()
        .toRotationMatrix();
  }

  Eigen::Matrix3d dual_gradient(int i) const {
    Vec3 scale = Vec3::Zero();
    for (const BoneWeight& at : rig.bones_at(i))
      scale += at.weight * posture.scales[static_cast<std::size_t>(at.bone)];
    return turn_of_blend(dual->blend(rig, i)) * scale.asDiagonal();
  }
};

} // namespace supple
