/// What a library must do to stand behind supple::Factor; private to the runtime.
#pragma once

#include <memory>

#include "supple/linear.hpp"

namespace supple {

/// One factorisation by one library. Sizes are checked by Factor; unknowns ≥ 1.
class Backend {
 public:
  virtual ~Backend() = default;

  /// `pattern` outlives the backend's use of it: it may keep pointers into it.
  virtual void analyse(const CscPattern& pattern) = 0;
  /// `values` (pattern.nonzeros()) are finite and may be kept as the matrix until the next call.
  virtual FactorStatus factorise(double* values) = 0;
  /// x = A⁻¹ rhs, without refinement; both (size).
  virtual void solve(const double* rhs, double* x) = 0;
  virtual Inertia inertia() const = 0;
  /// Pivots that were too small and that the last factorise replaced: A⁻¹ is then only near.
  virtual std::int64_t raised_pivots() const { return 0; }

  virtual double flops() const = 0;
  virtual double nonzeros() const = 0;
  virtual const char* ordering() const = 0;
};

std::unique_ptr<Backend> make_umfpack();
std::unique_ptr<Backend> make_supernodal(Kind kind);
std::unique_ptr<Backend> make_cholesky(Precision precision);
std::unique_ptr<Backend> make_pardiso(Kind kind);

} // namespace supple
