/// The terms of a fit's energy that are not data; private to the runtime.
#pragma once

#include "rig_rows.hpp"
#include "supple/rig_fit.hpp"

namespace supple {

/// Fills what was left empty, and checks the rest.
RigPriors complete(const Rig& rig, RigPriors priors);

/// ½ Σ (residual/sd)² of scales, blend, joints and rotations, times their weights.
RigTerms prior_terms(const Rig& rig, const RigPosture& posture, const RigWeights& weights,
                     const RigPriors& priors);
/// Their derivatives, added to `normal` (lower triangle); Gauss–Newton, exact gradient.
void add_priors(const Rig& rig, const RigPosture& posture, const RigWeights& weights,
                const RigPriors& priors, Normal& normal);

/// C δ = −c holds the joints, and Σ α = 1, after a linearised step δ.
struct Conditions {
  Eigen::MatrixXd matrix; ///< C
  Eigen::VectorXd value;  ///< c
};
Conditions conditions(const Rig& rig, const RigPosture& posture, const RigPriors& priors);

/// The rows of landmarks, three each.
std::vector<Row> landmark_rows(const Rig& rig, const RigLandmarks& landmarks, double weight);

/// The rotation vector of R, |ω| ≤ π.
Eigen::Vector3d turn_of(const Eigen::Matrix3d& R);

} // namespace supple
