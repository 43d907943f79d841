/// A skin on bones: where its vertices are for a posture, and how they move with it.
///
///     x_i = X_i + Σ_a α_a b_ia                                      blendshapes, before skinning
///     v_i = Σ_k w_ik (R_k S_k (x_i − j_k) + j_k + t_k)              linear blend skinning
///
/// Unknowns, in the order of every Jacobian and matrix: of each bone ω (exp(ω) R), shift, scale;
/// then the blend: 9 K + A. Source: Mazier (2022), eqs. 23–25.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <vector>

#include "supple/closest_point.hpp"

namespace supple {

using RowMatrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

/// How the bones at a vertex are blended.
///
/// DualQuaternion: x_i is scaled first, u_i = Σ_k w_ik (S_k (x_i − j_k) + j_k), then moved by the
/// blend Σ_k w_ik ±q_k, normalised, of the dual quaternions of x → R_k (x − j_k) + j_k + t_k.
/// Source: Kavan, Collins, Žára, O'Sullivan (2007), Skinning with dual quaternions, §3.
enum class Skinning { Linear, DualQuaternion };

/// Rotation, shift (m), scale of each bone, and the coefficients of the blendshapes.
template <class T>
struct PostureOf {
  std::vector<Eigen::Matrix<T, 3, 3>> rotations;
  std::vector<Eigen::Matrix<T, 3, 1>> translations, scales;
  Eigen::Matrix<T, Eigen::Dynamic, 1> blend;
};
using RigPosture = PostureOf<double>;

/// The template, as arrays.
struct RigArrays {
  Points points;           ///< (n, 3) m
  Triangles triangles;     ///< (t, 3), counter-clockwise seen from outside
  Points joints;           ///< (K, 3) m
  Eigen::VectorXi parents; ///< (K) an earlier bone; −1 of the root, the first
  RowMatrix weights;       ///< (n, K) rows sum to 1
  RowMatrix blendshapes;   ///< (A, 3n) m
};

struct BoneWeight {
  int bone;
  double weight;
};
struct ShapeOffset {
  int shape;
  Eigen::Vector3d offset; ///< m
};

/// A contiguous part of an array.
template <class T>
struct Part {
  const T* first;
  const T* last;
  const T* begin() const { return first; }
  const T* end() const { return last; }
};

/// A template ready for evaluation; never changes, so any number of threads may use it.
class Rig {
 public:
  /// @throws ShapeError for arrays that do not fit each other, NumericalError for NaN.
  explicit Rig(const RigArrays& arrays, Skinning skinning = Skinning::Linear);

  int vertices() const { return static_cast<int>(points_.rows()); }
  int bones() const { return static_cast<int>(joints_.size()); }
  int shapes() const { return shapes_; }
  int unknowns() const { return 9 * bones() + shapes_; }
  Skinning skinning() const { return skinning_; }
  const Points& points() const { return points_; }
  const Triangles& triangles() const { return triangles_; }
  const Eigen::Vector3d& joint(int k) const { return joints_[static_cast<std::size_t>(k)]; }
  int parent(int k) const { return parents_[k]; }
  /// Bones of weight ≠ 0 at vertex i.
  Part<BoneWeight> bones_at(int i) const { return part(weights_, weight_start_, i); }
  /// Blendshapes that move vertex i.
  Part<ShapeOffset> shapes_at(int i) const { return part(offsets_, offset_start_, i); }
  /// Whether vertex i is at an edge of one triangle alone.
  bool at_border(int i) const { return border_[static_cast<std::size_t>(i)] != 0; }
  RigPosture rest() const;
  /// @throws ShapeError unless it has this rig's numbers of bones and shapes.
  void check(const RigPosture& posture) const;

  /// (n, 3) m.
  Points posed(const RigPosture& posture) const;
  /// (3n, 9K + A): rows x, y, z of each vertex. Dense, for tests; a fit never forms it.
  RowMatrix jacobian(const RigPosture& posture) const;
  /// (v) sd of each of the vertices `of` (v), √ of the trace of its covariance / 3, for the
  /// covariance of the unknowns `covariance` (9K + A, 9K + A).
  Eigen::VectorXd vertex_sd(const RigPosture& posture,
                            const Eigen::Ref<const Eigen::MatrixXd>& covariance,
                            const Eigen::VectorXi& of) const;

 private:
  template <class T>
  static Part<T> part(const std::vector<T>& all, const std::vector<int>& start, int i) {
    const std::size_t s = static_cast<std::size_t>(i);
    return {all.data() + start[s], all.data() + start[s + 1]};
  }
  void find_border();

  Points points_;
  Triangles triangles_;
  std::vector<Eigen::Vector3d> joints_;
  Eigen::VectorXi parents_;
  int shapes_ = 0;
  Skinning skinning_;
  std::vector<BoneWeight> weights_;
  std::vector<ShapeOffset> offsets_;
  std::vector<int> weight_start_, offset_start_;
  std::vector<char> border_;
};

/// After a step (9K + A): exp(ω) R, shift, scale, blend.
RigPosture stepped(const RigPosture& posture, const Eigen::VectorXd& step);

} // namespace supple
