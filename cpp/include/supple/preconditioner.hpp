/// What stands behind conjugate gradients: a symmetric positive definite M ≈ A, made for one matrix
/// and used for those near it.
#pragma once

#include <functional>
#include <memory>

#include "supple/linear.hpp"

namespace supple {

class Preconditioner {
 public:
  virtual ~Preconditioner() = default;

  /// Make M for the matrix with these values (pattern.nonzeros()) on `pattern`, storage Lower,
  /// which is the same in all calls and outlives them. Of what was made before only the parts that
  /// do not depend on the values may be left where the status is not ok.
  virtual FactorStatus update(const CscPattern& pattern, const Vector& values) = 0;
  /// z = M⁻¹ r, both (size) and not the same vector; only after an update that was ok.
  virtual void apply(const Vector& r, Vector& z) = 0;
  /// How many iterations an update costs: with more than so many it pays to make M anew. From
  /// counts and not from the clock, so that the same problem is solved in the same way each time.
  virtual int break_even() const = 0;
  /// Whether M is A itself but for rounding: conjugate gradients want few iterations, or a new M.
  virtual bool exact() const { return true; }
  /// Whether an update that was ok proves A positive definite.
  virtual bool proves() const { return exact(); }
  /// M of the matrix at hand served badly: whether the next update is to be more exact than that.
  virtual bool sharpen() { return false; }
  /// Another matrix is at hand, for which M may still serve: keep what multiply needs of it.
  virtual void take(const CscPattern&, const Vector&) {}
  /// y = A x with the matrix last taken or updated; false where there is no quick way to it.
  virtual bool multiply(const Vector&, Vector&) { return false; }
  /// The next update makes anew also what does not depend on the values alone.
  virtual void start_over() {}
  /// Bytes that one more of its kind would take, once it was made.
  virtual double bytes() const = 0;
};

using MakePreconditioner = std::function<std::unique_ptr<Preconditioner>()>;

/// M = A but for rounding, by Cholesky: in single precision as long as that serves, which takes
/// half the time and memory, then in double. That A is not positive definite is for the latter to
/// say.
std::unique_ptr<Preconditioner> make_factor_preconditioner();

} // namespace supple
