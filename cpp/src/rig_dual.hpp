/// Skinning by blended dual quaternions and its derivatives; private to the runtime.
///
///     u_i = Σ_k w_ik (S_k (x_i − j_k) + j_k),   b_i = Σ_k w_ik ±(q_k + ε e_k),   e_k = ½ (0, d_k)
///     q_k v_i = u_i + 2 [r×(r×u + w u) + w e − e_w r + r×e] / |(w, r)|²     of b_i = (w, r) + ε
///     (e_w, e)
///
/// d_k = j_k + t_k − R_k j_k; the sign is that of the heaviest bone at the vertex.
/// Source: Kavan, Collins, Žára, O'Sullivan (2007), Skinning with dual quaternions, §3.
#pragma once

#include <complex>
#include <vector>

#include "supple/rig.hpp"

namespace supple {

/// Scalar part first.
template <class T>
using Quaternion = Eigen::Matrix<T, 4, 1>;

/// a × b without the conjugation that Eigen's has for complex numbers.
template <class T>
Eigen::Matrix<T, 3, 1> crossed(const Eigen::Matrix<T, 3, 1>& a, const Eigen::Matrix<T, 3, 1>& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}

/// (0, a) q.
template <class T>
Quaternion<T> turned(const Eigen::Matrix<T, 3, 1>& a, const Quaternion<T>& q) {
  const Eigen::Matrix<T, 3, 1> r = q.template tail<3>();
  Quaternion<T> result;
  result[0] = -(a[0] * r[0] + a[1] * r[1] + a[2] * r[2]);
  result.template tail<3>() = q[0] * a + crossed<T>(a, r);
  return result;
}

/// ∂(g · (0, a) q)/∂a.
inline Eigen::Vector3d pulled(const Quaternion<double>& g, const Quaternion<double>& q) {
  return -g[0] * q.tail<3>() + q[0] * g.tail<3>() + q.tail<3>().cross(g.tail<3>());
}

/// The unit quaternion of a rotation matrix, from its largest component. For complex steps too.
/// Source: Shepperd (1978), J. Guidance and Control 1(3).
template <class T>
Quaternion<T> quaternion_of(const Eigen::Matrix<T, 3, 3>& R) {
  using std::real, std::sqrt;
  const T squares[4] = {R(0, 0) + R(1, 1) + R(2, 2), R(0, 0) - R(1, 1) - R(2, 2),
                        R(1, 1) - R(2, 2) - R(0, 0), R(2, 2) - R(0, 0) - R(1, 1)};
  int best = 0;
  for (int i = 1; i < 4; ++i)
    if (real(squares[i]) > real(squares[best])) best = i;
  Quaternion<T> q;
  q[best] = sqrt(squares[best] + T(1)) / T(2);
  const T over = T(1) / (T(4) * q[best]);
  for (int i = 0; i < 3; ++i) {
    const int j = (i + 1) % 3, k = (i + 2) % 3;
    const T odd = R(k, j) - R(j, k), even = R(j, i) + R(i, j);
    if (best == 0) q[1 + i] = over * odd;
    if (best == 1 + i) q[0] = over * odd;
    if (best == 1 + i) q[1 + j] = over * even;
    if (best == 1 + j) q[1 + i] = over * even;
  }
  return q;
}

template <class T>
struct DualBones {
  using Vec3 = Eigen::Matrix<T, 3, 1>;
  std::vector<Quaternion<T>> real, dual;
  std::vector<Vec3> scale;

  DualBones(const Rig& rig, const PostureOf<T>& posture) : scale(posture.scales) {
    for (std::size_t k = 0; k < posture.rotations.size(); ++k) {
      const Vec3 joint = rig.joint(static_cast<int>(k)).template cast<T>();
      const Vec3 shift = joint + posture.translations[k] - posture.rotations[k] * joint;
      real.push_back(quaternion_of<T>(posture.rotations[k]));
      dual.push_back(T(0.5) * turned<T>(shift, real.back()));
    }
  }

  /// The blend at a vertex, and the sign of each of its bones.
  struct Blend {
    Quaternion<T> real = Quaternion<T>::Zero(), dual = Quaternion<T>::Zero();
    T norm2{}; ///< of the real part, without conjugation
  };
  Blend blend(const Rig& rig, int i) const {
    Blend b;
    const std::size_t heavy = heaviest(rig, i);
    for (const BoneWeight& at : rig.bones_at(i)) {
      const std::size_t k = static_cast<std::size_t>(at.bone);
      const T weight(at.weight * sign(k, heavy));
      b.real += weight * real[k];
      b.dual += weight * dual[k];
    }
    for (int c = 0; c < 4; ++c)
      b.norm2 += b.real[c] * b.real[c];
    return b;
  }

  static std::size_t heaviest(const Rig& rig, int i) {
    const BoneWeight* best = rig.bones_at(i).begin();
    for (const BoneWeight& at : rig.bones_at(i))
      if (at.weight > best->weight) best = &at;
    return static_cast<std::size_t>(best->bone);
  }

  /// Of q and −q, which are the same turn, the one on the heaviest bone's side.
  double sign(std::size_t k, std::size_t heavy) const {
    using std::real;
    double dot = 0.0;
    for (int c = 0; c < 4; ++c)
      dot += real(this->real[k][c]) * real(this->real[heavy][c]);
    return dot < 0.0 ? -1.0 : 1.0;
  }

  Vec3 scaled(const Rig& rig, int i, const Vec3& x) const {
    Vec3 u = Vec3::Zero();
    for (const BoneWeight& at : rig.bones_at(i)) {
      const Vec3 joint = rig.joint(at.bone).template cast<T>();
      u += T(at.weight) *
           (scale[static_cast<std::size_t>(at.bone)].cwiseProduct(Vec3(x - joint)) + joint);
    }
    return u;
  }

  static Vec3 moved(const Blend& b, const Vec3& u) {
    const Vec3 r = b.real.template tail<3>(), e = b.dual.template tail<3>();
    const Vec3 inner = crossed<T>(r, u) + b.real[0] * u;
    return u + (T(2) / b.norm2) *
                   (crossed<T>(r, inner) + b.real[0] * e - b.dual[0] * r + crossed<T>(r, e));
  }

  Vec3 vertex(const Rig& rig, int i, const Vec3& x) const {
    return moved(blend(rig, i), scaled(rig, i, x));
  }
};

/// ∂(d · v)/∂(b's real part, b's dual part) at v(b, u).
inline void pull_back(const DualBones<double>::Blend& b, const Eigen::Vector3d& u,
                      const Eigen::Vector3d& d, Quaternion<double>& of_real,
                      Quaternion<double>& of_dual) {
  const Eigen::Vector3d r = b.real.tail<3>(), e = b.dual.tail<3>();
  const double w = b.real[0];
  const Eigen::Vector3d offset = DualBones<double>::moved(b, u) - u;
  of_real[0] = d.dot(r.cross(u) + e);
  of_real.tail<3>() =
      (r.cross(u)).cross(d) + u.cross(d.cross(r)) + w * u.cross(d) - b.dual[0] * d + e.cross(d);
  of_real -= d.dot(offset) * b.real;
  of_dual[0] = -d.dot(r);
  of_dual.tail<3>() = w * d + d.cross(r);
  of_real *= 2.0 / b.norm2;
  of_dual *= 2.0 / b.norm2;
}

} // namespace supple
