#include "supple/blas.hpp"

#include <dlfcn.h>

#include <algorithm>
#include <chrono>
#include <vector>

// Named, not looked up: the BLAS is then linked wherever this file is.
extern "C" void dgemm_(const char*, const char*, const int*, const int*, const int*, const double*,
                       const double*, const int*, const double*, const int*, const double*, double*,
                       const int*);

namespace supple {
namespace {

/// A function of the BLAS that the process has loaded for us, null if it has none of that name.
template <class Function>
Function* find(const char* name) {
  return reinterpret_cast<Function*>(dlsym(RTLD_DEFAULT, name));
}

double measure_gflops() {
  const BlasThreads one(1);
  constexpr int n = 256;
  constexpr std::size_t size = std::size_t{n} * n;
  const std::vector<double> a(size, 0.5), b(size, 0.25);
  std::vector<double> c(size, 0.0);
  const double alpha = 1.0, beta = 0.0;
  double best = 1e30;
  for (int repeat = 0; repeat < 6; ++repeat) { // the first one warms up
    const auto begin = std::chrono::steady_clock::now();
    dgemm_("N", "T", &n, &n, &n, &alpha, a.data(), &n, b.data(), &n, &beta, c.data(), &n);
    const std::chrono::duration<double> spent = std::chrono::steady_clock::now() - begin;
    best = std::min(best, spent.count());
  }
  return 2.0 * n * n * n / best / 1e9;
}

std::string text(const char* name) {
  auto* const function = find<char*()>(name);
  const char* const answer = function == nullptr ? nullptr : function();
  return answer == nullptr ? "" : answer;
}

int blas_threads() {
  auto* const get = find<int()>("openblas_get_num_threads");
  return get == nullptr ? 0 : get();
}

} // namespace

BlasReport blas_report() {
  static const double gflops = measure_gflops();
  return {text("openblas_get_corename"), text("openblas_get_config"), blas_threads(), gflops};
}

bool set_blas_threads(int threads) {
  auto* const set = find<void(int)>("openblas_set_num_threads");
  if (set == nullptr) return false;
  set(std::max(threads, 1));
  return true;
}

BlasThreads::BlasThreads(int threads) : before_(blas_threads()) {
  if (before_ > 0 && before_ != threads) set_blas_threads(threads);
}

BlasThreads::~BlasThreads() {
  if (before_ > 0 && before_ != blas_threads()) set_blas_threads(before_);
}

} // namespace supple
