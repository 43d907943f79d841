/// The smooth displacement of a skin along its normals that bones and shapes leave; private to the
/// runtime.
#pragma once

#include <array>
#include <vector>

#include "rig_match.hpp"
#include "supple/linear.hpp"
#include "supple/rig_fit.hpp"

namespace supple {

/// Finds displacements for skins of one template: what depends on its triangles alone (the
/// matrix' pattern, its order of elimination) is made once.
///
/// h (n) m minimises Σ w (B h − r)² + hᵀ Q h, Q = τ² K M⁻¹ K with K = κ² M + G, M the lumped mass,
/// G the stiffness: a Matérn field with ν = 1.
/// Source: Lindgren, Rue, Lindström (2011), J. R. Statist. Soc. B 73, eqs. 2–10.
class OffsetSolver {
 public:
  explicit OffsetSolver(const Rig& rig);

  /// @throws NumericalError if the matrix cannot be factorised.
  RigOffset solve(const Points& skin, const ScanCloud& scan, Matcher& matcher,
                  const RigOffsetSettings& settings);

 private:
  void make_pattern();
  std::int64_t place(int row, int column) const;
  void add_prior(const Points& skin, const RigOffsetSettings& settings, Eigen::VectorXd& values,
                 double& area) const;
  void add_data(const Points& skin, const Points& along, const ScanCloud& scan,
                const std::vector<Landing>& landed, double one, const RigOffsetSettings& settings,
                const Eigen::VectorXd& h, Eigen::VectorXd& values, Eigen::VectorXd& right) const;
  void fill_full(const Eigen::VectorXd& values, RigOffset& result) const;

  const Rig& rig_;
  std::vector<std::vector<int>> around_;         ///< of each vertex: itself and its neighbours
  std::vector<std::array<std::int64_t, 6>> six_; ///< of each triangle: places of its pairs
  CscPattern pattern_;                           ///< lower, of vertices two edges apart
  Factor factor_{Kind::Cholesky};
};

} // namespace supple
