/// Chebyshev smoothing of A x = b with the inverses of A's diagonal blocks, in single precision.
///
/// Before and after the correction by a coarser level it is the same polynomial, so that a V-cycle
/// is symmetric. Source: Adams, Brezina, Hu, Tuminaro (2003), J. Comput. Phys. 188(2), §3.
#pragma once

#include "supple/block_matrix.hpp"

namespace supple {

class Chebyshev {
 public:
  /// For a matrix with the inverses of its diagonal blocks; `largest` bounds D⁻¹A's eigenvalues.
  void update(const std::vector<double>& inverse, double largest);

  /// x = p(D⁻¹A) D⁻¹ b and r = b − A x; b comes in r, and both are (rows·height).
  void start(const BlockMatrix<float>& A, std::vector<float>& r, std::vector<float>& x);
  /// x += P e of the next level, r −= A P e.
  void correct(const BlockMatrix<float>& A, const BlockMatrix<float>& P,
               const std::vector<float>& e, std::vector<float>& r, std::vector<float>& x);
  /// x += p(D⁻¹A) D⁻¹ r, where r is the residual of x; r is used up.
  void improve(const BlockMatrix<float>& A, std::vector<float>& r, std::vector<float>& x);

 private:
  void first(const BlockMatrix<float>& A, const std::vector<float>& r, std::vector<float>& x,
             bool add);
  void next(const BlockMatrix<float>& A, std::vector<float>& r, std::vector<float>& x);

  std::vector<float> inverse_, step_, new_step_;
  float scale_ = 1.0F;                  // of the first step
  float old_part_ = 0.0F, part_ = 0.0F; // of the second: of the last step and of the residual
};

/// An upper estimate of the largest eigenvalue of D⁻¹A by Lanczos' method.
double largest_eigenvalue(const BlockMatrix<double>& A, const std::vector<double>& inverse);

} // namespace supple
