/// A step within bounds and under linear conditions; private to the runtime.
#pragma once

#include <Eigen/Core>
#include <vector>

namespace supple {

/// min ½ δᵀ H δ + gᵀ δ  so that  C δ = −c,  lower ≤ δ ≤ upper,  δ = 0 where not free.
struct StepProblem {
  const Eigen::MatrixXd& matrix;   ///< H, lower triangle; positive definite
  const Eigen::VectorXd& gradient; ///< g
  const Eigen::MatrixXd& conditions;
  const Eigen::VectorXd& value;
  const Eigen::VectorXd& lower; ///< ≤ 0
  const Eigen::VectorXd& upper; ///< ≥ 0
  const std::vector<char>& free;
  double damping; ///< H + damping · diag H is what is solved with
};

/// False if the matrix is not positive definite. Bounds by an active set: unknowns that would pass
/// theirs are held there and let go where they pull inwards; conditions by their multipliers.
bool solve_step(const StepProblem& problem, Eigen::VectorXd& step);

} // namespace supple
