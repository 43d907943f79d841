/// Residuals, and the ways to a better answer than a factor's own; private to the runtime.
#pragma once

#include "linear_backend.hpp"

namespace supple {

/// A x = b with a factor at hand; the work space is kept from one solve to the next.
class Refiner {
 public:
  /// Room for the unknowns of `pattern`, which outlives this.
  void analyse(const CscPattern& pattern);
  /// Values of the matrix; they are not copied.
  void take(const Vector& values);

  /// x = A⁻¹ rhs by `factor`, improved by its own corrections.
  SolveReport correct(Backend& factor, MutableVector x, const Refinement& refinement);
  /// The same by conjugate gradients with a factor that is only near: rounded to single precision.
  ///
  /// Flexible, for a rounded factor is no linear map; begun anew from the true residual whenever
  /// the recurrence has gained six digits.
  /// Source: Notay (2000), SIAM J. Sci. Comput. 22(4), algorithm 2.1 with one direction kept.
  SolveReport conjugate(Backend& factor, MutableVector x, const Refinement& refinement);

  Vector rhs; ///< b

 private:
  void subtract_product(const Vector& x, const Vector& b, Vector& r) const;
  void multiply(const Vector& x, Vector& y) const;
  SolveReport measure(const Vector& x, int steps) const;
  int gain(Backend& factor, double goal, int steps);

  const CscPattern* pattern_ = nullptr;
  const Vector* values_ = nullptr;
  Vector residual_, correction_, trial_, direction_, image_, before_;
  double norm_ = 0.0; // ‖A‖∞
};

/// Rounding, or the tolerance that was asked for.
bool good_enough(const SolveReport& report, const Refinement& refinement);
/// What refinement of a usable factor reaches; the rest is the fault of pivots not chosen, or of
/// numbers too short.
bool usable(const SolveReport& report, const Refinement& refinement);

} // namespace supple
