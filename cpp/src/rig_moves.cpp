#include "rig_moves.hpp"

#include <Eigen/Cholesky>
#include <limits>

#include "rig_energy.hpp"
#include "rig_step.hpp"

namespace supple {
namespace {

using Vec3 = Eigen::Vector3d;

/// Columns: all bones turned about `centre`, shifted, scaled, as one body.
Eigen::MatrixXd as_one_body(const Rig& rig, const RigPosture& posture, const Vec3& centre) {
  Eigen::MatrixXd M = Eigen::MatrixXd::Zero(rig.unknowns(), 7);
  for (int k = 0; k < rig.bones(); ++k) {
    const std::size_t s = static_cast<std::size_t>(k);
    const Vec3 arm = rig.joint(k) + posture.translations[s] - centre;
    M.block<3, 3>(9 * k, 0).setIdentity();
    M.block<3, 3>(9 * k + 3, 0) = -skew<double>(arm);
    M.block<3, 3>(9 * k + 3, 3).setIdentity();
    M.block<3, 1>(9 * k + 3, 6) = arm;
    M.block<3, 1>(9 * k + 6, 6) = posture.scales[s];
  }
  return M;
}

std::vector<char> free_unknowns(const Rig& rig, Moves moves) {
  std::vector<char> free(static_cast<std::size_t>(rig.unknowns()), moves == Moves::All);
  for (int k = 0; k < rig.bones(); ++k)
    for (int c = 0; c < 9; ++c)
      free[static_cast<std::size_t>(9 * k + c)] = c < 6 || moves != Moves::Bones;
  return free;
}

/// What a step may be so that scales and blend stay in their ranges; the start may be outside.
void bounds(const Rig& rig, const RigPosture& posture, const RigPriors& priors,
            Eigen::VectorXd& lower, Eigen::VectorXd& upper) {
  const double inf = std::numeric_limits<double>::infinity();
  lower = Eigen::VectorXd::Constant(rig.unknowns(), -inf);
  upper = Eigen::VectorXd::Constant(rig.unknowns(), inf);
  for (int k = 0; k < rig.bones(); ++k) {
    const Vec3& scale = posture.scales[static_cast<std::size_t>(k)];
    lower.segment<3>(9 * k + 6) = (priors.scale_lower - scale.array()).min(0.0);
    upper.segment<3>(9 * k + 6) = (priors.scale_upper - scale.array()).max(0.0);
  }
  lower.tail(rig.shapes()) = (priors.blend_lower - posture.blend).cwiseMin(0.0);
  upper.tail(rig.shapes()) = (priors.blend_upper - posture.blend).cwiseMax(0.0);
}

} // namespace

bool rigid_step(const Rig& rig, const SkinState& state, const Normal& normal, double damping,
                Eigen::VectorXd& step) {
  const Vec3 centre = state.points.colwise().mean().transpose();
  const Eigen::MatrixXd M = as_one_body(rig, state.posture, centre);
  Eigen::MatrixXd small = M.transpose() * (normal.matrix.selfadjointView<Eigen::Lower>() * M);
  small.diagonal() *= 1.0 + damping;
  const Eigen::LLT<Eigen::MatrixXd> factor(small);
  if (factor.info() != Eigen::Success) return false;
  step = -(M * factor.solve(M.transpose() * normal.gradient));
  return step.allFinite();
}

bool free_step(const Rig& rig, const SkinState& state, const RigPriors& priors, Moves moves,
               const Normal& normal, double damping, Eigen::VectorXd& step) {
  const Conditions hold = conditions(rig, state.posture, priors);
  Eigen::VectorXd lower, upper;
  bounds(rig, state.posture, priors, lower, upper);
  return solve_step({normal.matrix, normal.gradient, hold.matrix, hold.value, lower, upper,
                     free_unknowns(rig, moves), damping},
                    step);
}

} // namespace supple
