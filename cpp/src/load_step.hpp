/// Newton's iteration under one load, with its guards; the load steps and the arc end with it.
#pragma once

#include "problem.hpp"

namespace supple {

/// How one load step is attacked: full Newton steps, or steps that must lower the energy.
enum class Manner { Full, Guarded };

class LoadStep {
 public:
  explicit LoadStep(Problem& problem) : p_(problem) {}

  /// Equilibrium at `s` from `u`, which is the last iterate if there is none.
  Outcome iterate(Vector& u, double s, Manner manner);

  /// The first Newton step that was made (dofs), which is the way that the path sets out; or empty.
  const Vector& first() const { return first_; }

 private:
  Outcome factorise(const Vector& u, double s, Manner manner);
  double line_search(const Vector& u, const Vector& d, const Vector& r, double norm, double s,
                     Manner manner, bool moves_supports);
  void bend(const Vector& u, Vector& d, double s);
  bool settled(Vector& u, Vector& r, double norm, double step, double s);
  Outcome stable(const Vector& u);
  Outcome fault() const;

  Problem& p_;
  Vector first_;
  Vector ahead_; // residual where the step at hand ends, if it was looked at
  double shift_ = 0.0;
};

} // namespace supple
