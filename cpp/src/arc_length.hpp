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

#include "load_step.hpp"

namespace supple {

/// A point of the path and its unit tangent by arc length.
struct ArcPoint {
  Vector u;        ///< (dofs)
  double s = 0.0;  ///< share of the load
  Vector du;       ///< (dofs)
  double ds = 0.0; ///< < 0 where the load falls along the path
};

class ArcLength {
 public:
  ArcLength(Problem& problem, LoadStep& step) : p_(problem), step_(step) {}

  /// Follow the path from the problem's last equilibrium; its result is the largest load found.
  Outcome run();

 private:
  bool start();
  bool advance();
  bool finish(Outcome& outcome);
  void locate_fold(ArcPoint low, ArcPoint high, double length);
  ArcPoint predict(double length) const;
  bool correct(ArcPoint& point);
  bool factorise(const ArcPoint& point, Vector& w);
  void turn(ArcPoint& point, const Vector& w) const;
  void keep(const ArcPoint& point);
  double dot(const Vector& a, const Vector& b) const { return a.dot(b) / unit_; }
  int budget() const;
  Outcome end() const;

  Problem& p_;
  LoadStep& step_;
  ArcPoint here_, before_;
  double unit_ = 1.0;      // ‖u‖² that weighs as much as the whole load
  double length_ = 0.0;    // of the next step
  double last_ = 0.0;      // of the last one, 0 at the start
  double travelled_ = 0.0; // along the path
  int corrections_ = 0;    // of the last corrector
  int factors_ = 0, factors_at_fold_ = -1;
  bool refused_ = false; // the last step was
};

} // namespace supple
