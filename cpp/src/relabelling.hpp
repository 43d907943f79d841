/// The change of variable that makes the inverse tangent look like the direct one.
///
/// With the loaded points x fixed, a change δX of a rest point acts as the displacement −F δX would
/// on the same body: up to terms of the size of the stress, K_inverse = −K_direct F. So the product
/// of K_inverse and −F⁻¹ at the nodes is near to symmetric, and near to the one at any other rest
/// shape: the strain only changes its moduli.
#pragma once

#include <Eigen/Dense>
#include <vector>

#include "supple/sparse.hpp"

namespace supple {

class Relabelling {
 public:
  /// @param points (3n) loaded points, m; `free` (dofs).
  Relabelling(const BlockPattern& pattern, const Mask& free, const Vector& points);

  /// Take −F⁻¹ at the nodes from `u` (dofs), X − x: least squares over each node's neighbours.
  void update(const ConstVector& u);
  /// y = D x: −F⁻¹ at the nodes, on free directions only; scalars as they are. May not alias.
  void apply(const Vector& x, Vector& y) const;
  /// values = K D, both in CSR on the pattern.
  void scale_columns(const Vector& tangent, Vector& values) const;

 private:
  Eigen::Matrix3d fit(Index node, const ConstVector& u) const;

  const BlockPattern* pattern_;
  const Vector* points_;
  Mask free_;
  std::vector<Eigen::Matrix3d> spread_; ///< (nodes) inverse of Σ (x_b − x_a)(x_b − x_a)ᵀ
  std::vector<Eigen::Matrix3d> block_;  ///< (nodes) of D
};

} // namespace supple
