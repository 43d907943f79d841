/// Pseudo-arc-length continuation: the path of equilibria (u, s) followed past its limit points.
///
///     tangent w = K⁻¹ (−∂R/∂s)  →  predictor, a parabola through the last two points
///         → corrector on the plane normal to the tangent (Keller's bordered system)
///         → step length by the corrector's work          until s = 1, the path ends, or it folds
///
/// The bordered system is solved by two solves with the factor of K, which is made once a point
/// and kept while the residual falls tenfold. At a fold K is singular and (u, s) is not; the
/// largest s lies where a cubic through two points and their tangents has its maximum.
/// Sources: Riks (1979), Int. J. Solids Structures 15; Crisfield (1981), Comput. Struct. 13;
/// Keller (1977), Numerical solution of bifurcation and nonlinear eigenvalue problems.
#pragma once

#include "corrector.hpp"
#include "load_step.hpp"

namespace supple {

class ArcLength {
 public:
  /// @param verdict what is wrong with the equilibrium under the whole load, if one is known.
  ArcLength(Problem& problem, LoadStep& step, Outcome verdict)
      : p_(problem), step_(step), corrector_(problem), at_end_(verdict) {}

  /// Follow the path from the problem's last equilibrium; its result is the largest load found.
  Outcome run();

 private:
  bool advance();
  double length_to_whole() const;
  bool finish(double length, Outcome& outcome);
  bool passes(const ArcPoint& next);
  bool arrive(ArcPoint& next);
  bool kinked(double moved);
  void choose_length();
  void locate_fold(ArcPoint low, ArcPoint high, double length);
  ArcPoint predict(double length) const;
  void keep(const ArcPoint& point);
  int budget() const;
  Outcome end() const;

  Problem& p_;
  LoadStep& step_;
  Corrector corrector_;
  ArcPoint here_, before_;
  double length_ = 0.0;    // of the next step
  double last_ = 0.0;      // of the last one, 0 at the start
  double lost_ = 0.0;      // correction, in steps, for which the last one was refused
  double travelled_ = 0.0; // along the path
  int factors_at_fold_ = -1;
  Outcome at_end_; // what is wrong with the equilibrium under the whole load, if it was found
  Outcome fault_ = Outcome::Converged; // with which the path ends, by its judge
  int returns_ = 0;                    // to where the fault begins
  bool refused_ = false;               // the last step was
};

} // namespace supple
