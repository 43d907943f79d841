/// Residuals of a fit's data, and their normal equations; private to the runtime.
#pragma once

#include <array>
#include <vector>

#include "rig_skin.hpp"

namespace supple {

/// residual = direction · (Σ_c share_c v_c − target) of up to three vertices.
struct Row {
  std::array<int, 3> vertex{};
  std::array<double, 3> share{}; ///< 0 of a corner that does not count
  Eigen::Vector3d direction;     ///< unit
  Eigen::Vector3d target;        ///< m
  double weight = 0.0;           ///< 1/m²: what ½ residual² is multiplied with, loss aside
  double loss = 0.0;             ///< m: scale of Geman–McClure's loss; 0: quadratic

  double residual(const Points& vertices) const {
    Eigen::Vector3d at = -target;
    for (std::size_t c = 0; c < 3; ++c)
      if (share[c] != 0.0) at += share[c] * vertices.row(vertex[c]).transpose();
    return direction.dot(at);
  }
};

/// Geman–McClure's loss ρ = ½ r² c²/(c² + r²), which is ½ r² near 0 and never above ½ c².
/// Source: Geman, McClure (1987), Bull. Int. Stat. Inst. 52(4).
inline double loss_of(double residual, double scale) {
  const double squared = residual * residual;
  return scale > 0.0 ? 0.5 * squared * scale * scale / (scale * scale + squared) : 0.5 * squared;
}
/// ρ'(r)/r, by which iteratively reweighted least squares weighs a row.
inline double loss_weight(double residual, double scale) {
  if (!(scale > 0.0)) return 1.0;
  const double ratio = scale * scale / (scale * scale + residual * residual);
  return ratio * ratio;
}

/// Σ weight · ρ.
double energy_of(const std::vector<Row>& rows, const Points& vertices);

/// JᵀWJ (lower triangle) and JᵀWr.
struct Normal {
  Eigen::MatrixXd matrix;
  Eigen::VectorXd gradient;
};

/// Adds up normal equations; keeps its memory from one call to the next.
///
/// A chunk of rows that are near each other sees few of the unknowns, so it is gathered into a
/// small dense panel of those alone, whose product goes to its place in the matrix. Chunks go to a
/// fixed number of sums, added in a fixed order, so that the threads' number leaves no trace.
class NormalSum {
 public:
  /// Rows in the order given; neighbours should be near each other on the skin. What only bones
  /// move for, without the shapes' part.
  void add(const std::vector<Row>& rows, const SkinState& state, Normal& normal,
           Unknowns of = Unknowns::All);

 private:
  static constexpr int kSums = 4, kChunk = 96;
  struct Part {
    Eigen::MatrixXd matrix, panel, product;
    Eigen::VectorXd gradient, residual, step;
    std::vector<int> place, columns; ///< of each unknown in the panel; −1 if not there
  };
  static void add_chunk(const Row* first, const Row* last, const SkinState& state, Unknowns of,
                        Part& part);
  std::array<Part, kSums> parts_;
};

} // namespace supple
