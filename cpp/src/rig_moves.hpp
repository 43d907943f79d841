/// The step that a stage of a fit may take; private to the runtime.
#pragma once

#include "rig_rows.hpp"
#include "supple/rig_fit.hpp"

namespace supple {

/// All bones turned about the middle, shifted and scaled, as one body: the best of those steps for
/// the damped normal equations. False if there is none.
bool rigid_step(const Rig& rig, const SkinState& state, const Normal& normal, double damping,
                Eigen::VectorXd& step);

/// The best step of what `moves` lets go, within bounds and under the priors' conditions.
bool free_step(const Rig& rig, const SkinState& state, const RigPriors& priors, Moves moves,
               const Normal& normal, double damping, Eigen::VectorXd& step);

} // namespace supple
