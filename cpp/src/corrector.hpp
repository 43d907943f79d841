/// Keller's bordered system: from a predicted point onto the path, normal to the path's tangent.
#pragma once

#include "problem.hpp"

namespace supple {

/// A point of the path and its unit tangent by arc length.
struct ArcPoint {
  Vector u;        ///< (dofs)
  double s = 0.0;  ///< share of the load
  Vector du;       ///< (dofs)
  double ds = 0.0; ///< < 0 where the load falls along the path
};

class Corrector {
 public:
  explicit Corrector(Problem& problem) : p_(problem) {}

  /// The tangent where the path begins; from then on u and s weigh what they weigh in it.
  /// @param w a guess of du/ds there that saves a factor if it is good enough; may be empty.
  bool begin(ArcPoint& point, const Vector& w);
  /// Bring a predicted point that has the tangent of the last one onto the path, with its own.
  /// @param share of the forces that may be missing.
  bool correct(ArcPoint& point, double share);
  /// The tangent made anew at the point itself.
  bool refresh(ArcPoint& point);

  /// ‖a‖² of a way along the path.
  double square(const Vector& u, double s) const { return dot(u, u) + s * s; }
  int factors() const { return factors_; } ///< made so far
  int steps() const { return steps_; }     ///< of the last correction

 private:
  struct Force {
    Vector r;
    double norm, scale; // N
  };
  Force force(const ArcPoint& point) const;
  bool factorise(const ArcPoint& point);
  bool step(ArcPoint& point, Force& now);
  void turn(ArcPoint& point) const;
  void record(const ArcPoint& point, const Force& now, double step, double length);
  double dot(const Vector& a, const Vector& b) const { return a.dot(b) / unit_; }

  Problem& p_;
  Vector w_;          // du/ds by the last factor
  double unit_ = 1.0; // ‖u‖² that weighs as much as the whole load
  double share_ = 0.0;
  int factors_ = 0, steps_ = 0;
};

} // namespace supple
