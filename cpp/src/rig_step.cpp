#include "rig_step.hpp"

#include <Eigen/Cholesky>

namespace supple {
namespace {

using Index = Eigen::Index;
enum class Hold : char { No, Lower, Upper, Fixed };

/// The problem with some unknowns held at `step`; the others and the multipliers are solved for.
class Reduced {
 public:
  Reduced(const StepProblem& problem, const Eigen::MatrixXd& whole) : p_(problem), whole_(whole) {}

  bool solve(const std::vector<Hold>& hold, Eigen::VectorXd& step) {
    columns_.clear();
    for (std::size_t i = 0; i < hold.size(); ++i)
      if (hold[i] == Hold::No) columns_.push_back(static_cast<Index>(i));
    for (const Index i : columns_)
      step[i] = 0.0;
    const Eigen::VectorXd held = whole_.selfadjointView<Eigen::Lower>() * step + p_.gradient;
    const Index n = static_cast<Index>(columns_.size()), m = p_.conditions.rows();
    Eigen::MatrixXd H(n, n);
    Eigen::VectorXd g(n);
    for (Index b = 0; b < n; ++b) {
      g[b] = held[columns_[static_cast<std::size_t>(b)]];
      for (Index a = b; a < n; ++a)
        H(a, b) =
            whole_(columns_[static_cast<std::size_t>(a)], columns_[static_cast<std::size_t>(b)]);
    }
    const Eigen::LLT<Eigen::MatrixXd, Eigen::Lower> factor(H);
    if (factor.info() != Eigen::Success) return false;
    Eigen::VectorXd free = -factor.solve(g);
    multipliers = Eigen::VectorXd::Zero(m);
    if (m > 0) meet_conditions(factor, step, free);
    for (Index a = 0; a < n; ++a)
      step[columns_[static_cast<std::size_t>(a)]] = free[a];
    return step.allFinite();
  }

  Eigen::VectorXd multipliers;

 private:
  /// δ = −H⁻¹ (g + Cᵀ μ) with C δ = −c − C held.
  void meet_conditions(const Eigen::LLT<Eigen::MatrixXd, Eigen::Lower>& factor,
                       const Eigen::VectorXd& step, Eigen::VectorXd& free) {
    Eigen::MatrixXd C(p_.conditions.rows(), free.size());
    for (Index a = 0; a < free.size(); ++a)
      C.col(a) = p_.conditions.col(columns_[static_cast<std::size_t>(a)]);
    const Eigen::VectorXd missing = C * free + p_.value + p_.conditions * step;
    const Eigen::MatrixXd lifted = factor.solve(C.transpose());
    multipliers = (C * lifted).ldlt().solve(missing);
    free -= lifted * multipliers;
  }

  const StepProblem& p_;
  const Eigen::MatrixXd& whole_;
  std::vector<Index> columns_;
};

/// Holds what passes its bound. True if anything did.
bool hold_outside(const StepProblem& p, std::vector<Hold>& hold, Eigen::VectorXd& step) {
  bool found = false;
  for (std::size_t i = 0; i < hold.size(); ++i) {
    const Index k = static_cast<Index>(i);
    if (hold[i] != Hold::No || (step[k] >= p.lower[k] && step[k] <= p.upper[k])) continue;
    hold[i] = step[k] < p.lower[k] ? Hold::Lower : Hold::Upper;
    step[k] = step[k] < p.lower[k] ? p.lower[k] : p.upper[k];
    found = true;
  }
  return found;
}

/// Lets go what pulls away from its bound. True if anything does.
bool release(const StepProblem& p, const Eigen::MatrixXd& whole, const Eigen::VectorXd& multipliers,
             const Eigen::VectorXd& step, std::vector<Hold>& hold) {
  Eigen::VectorXd slope = whole.selfadjointView<Eigen::Lower>() * step + p.gradient;
  if (multipliers.size() > 0) slope += p.conditions.transpose() * multipliers;
  bool found = false;
  for (std::size_t i = 0; i < hold.size(); ++i) {
    const Index k = static_cast<Index>(i);
    const bool inwards =
        (hold[i] == Hold::Lower && slope[k] < 0.0) || (hold[i] == Hold::Upper && slope[k] > 0.0);
    if (!inwards || p.lower[k] == p.upper[k]) continue;
    hold[i] = Hold::No;
    found = true;
  }
  return found;
}

} // namespace

bool solve_step(const StepProblem& p, Eigen::VectorXd& step) {
  constexpr int rounds = 30, releases = 8;
  Eigen::MatrixXd whole = p.matrix;
  whole.diagonal() *= 1.0 + p.damping;
  std::vector<Hold> hold(p.free.size());
  for (std::size_t i = 0; i < hold.size(); ++i)
    hold[i] = p.free[i] ? Hold::No : Hold::Fixed;
  step = Eigen::VectorXd::Zero(p.gradient.size());
  Reduced reduced(p, whole);
  for (int round = 0; round < rounds; ++round) {
    if (!reduced.solve(hold, step)) return false;
    if (hold_outside(p, hold, step)) continue;
    if (round >= releases || !release(p, whole, reduced.multipliers, step, hold)) break;
  }
  step = step.cwiseMax(p.lower).cwiseMin(p.upper);
  return step.allFinite();
}

} // namespace supple
