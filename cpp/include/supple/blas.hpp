/// The BLAS under the factorisations: which kernels it runs, how fast, on how many threads.
#pragma once

#include <string>

namespace supple {

/// What the loaded BLAS is and does.
struct BlasReport {
  std::string core;    ///< OpenBLAS' name of its kernels ("SkylakeX", "Prescott", …); "" elsewhere
  std::string config;  ///< OpenBLAS' build line, or ""
  int threads = 0;     ///< threads that it may use now; 0 if unknown
  double gflops = 0.0; ///< best of a few dgemm of 256 × 256, one thread, GFLOP/s
};

/// Look at the BLAS that this library is linked to. The speed is measured once per process (≈ 20
/// ms).
BlasReport blas_report();

/// Let the BLAS use `threads` threads. False if it cannot be told (not OpenBLAS).
bool set_blas_threads(int threads);

/// Sets the number of BLAS threads for its own lifetime.
class BlasThreads {
 public:
  explicit BlasThreads(int threads);
  ~BlasThreads();
  BlasThreads(const BlasThreads&) = delete;
  BlasThreads& operator=(const BlasThreads&) = delete;

 private:
  int before_;
};

} // namespace supple
