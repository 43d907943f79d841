/// The skinning of one vertex, for any scalar, and its derivatives; private to the runtime.
#pragma once

#include <cmath>
#include <vector>

#include "supple/rig.hpp"

namespace supple {

template <class T>
Eigen::Matrix<T, 3, 3> skew(const Eigen::Matrix<T, 3, 1>& w) {
  Eigen::Matrix<T, 3, 3> cross;
  cross << T(0), -w[2], w[1], w[2], T(0), -w[0], -w[1], w[0], T(0);
  return cross;
}

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

/// A posed skin and what its derivatives need.
struct SkinState {
  const Rig& rig;
  RigPosture posture;
  LinearBones<double> bones;
  Points shape;                          ///< (n, 3) m, x
  Points points;                         ///< (n, 3) m, v
  std::vector<Eigen::Matrix3d> gradient; ///< ∂v/∂x

  SkinState(const Rig& of, const RigPosture& at)
      : rig(of), posture(at), bones(of, at), shape(of.vertices(), 3), points(of.vertices(), 3),
        gradient(static_cast<std::size_t>(of.vertices())) {
#pragma omp parallel for schedule(static)
    for (int i = 0; i < rig.vertices(); ++i) {
      const Eigen::Vector3d x = shape_at<double>(rig, posture.blend, i);
      shape.row(i) = x.transpose();
      points.row(i) = bones.vertex(rig, i, x).transpose();
      gradient[static_cast<std::size_t>(i)] = bones.gradient(rig, i);
    }
  }

  /// add(column, ∂(d·v_i)/∂unknown) for every unknown that moves vertex i.
  template <class Add>
  void add_row(int i, const Eigen::Vector3d& d, const Add& add) const {
    const Eigen::Vector3d x = shape.row(i).transpose();
    for (const BoneWeight& at : rig.bones_at(i)) {
      const std::size_t k = static_cast<std::size_t>(at.bone);
      const Eigen::Vector3d arm = x - rig.joint(at.bone), push = at.weight * d;
      const Eigen::Vector3d turn = (bones.affine[k] * arm).cross(push);
      const Eigen::Vector3d stretch = (posture.rotations[k].transpose() * push).cwiseProduct(arm);
      for (int c = 0; c < 3; ++c) {
        add(9 * at.bone + c, turn[c]);
        add(9 * at.bone + 3 + c, push[c]);
        add(9 * at.bone + 6 + c, stretch[c]);
      }
    }
    const Eigen::Vector3d pull = gradient[static_cast<std::size_t>(i)].transpose() * d;
    for (const ShapeOffset& shape_of : rig.shapes_at(i))
      add(9 * rig.bones() + shape_of.shape, pull.dot(shape_of.offset));
  }
};

} // namespace supple
