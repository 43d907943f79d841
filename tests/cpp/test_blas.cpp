#include "supple/blas.hpp"

#include "check.hpp"

using namespace supple;

/// Any BLAS multiplies; one that cannot be asked for threads says so.
TEST(report_measures_the_blas_that_is_loaded) {
  const BlasReport report = blas_report();
  std::printf("      core %s, %d threads, %.1f GFLOP/s\n", report.core.c_str(), report.threads,
              report.gflops);
  CHECK(report.gflops > 0.0);
  CHECK(set_blas_threads(1) == (report.threads > 0));
}

TEST(threads_are_set_for_a_scope) {
  const int before = blas_report().threads;
  if (before == 0) return; // not OpenBLAS
  set_blas_threads(2);
  {
    const BlasThreads one(1);
    CHECK(blas_report().threads == 1);
  }
  CHECK(blas_report().threads == 2);
  set_blas_threads(before);
}
