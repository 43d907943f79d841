#define SUPPLE_UNIT baseline
#define SUPPLE_BYTES 32
#include "strips_unit.hpp"

namespace supple::strips {

namespace avx2 {
const Kernels<double>& doubles();
const Kernels<float>& floats();
} // namespace avx2
namespace avx512 {
const Kernels<double>& doubles();
const Kernels<float>& floats();
} // namespace avx512

namespace {

enum class Set { Baseline, Avx2, Avx512 };

Set best() {
#if defined(__x86_64__)
  if (__builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512dq") &&
      __builtin_cpu_supports("avx512vl"))
    return Set::Avx512;
  if (__builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma")) return Set::Avx2;
#endif
  return Set::Baseline;
}

} // namespace

template <>
const Kernels<double>& kernels<double>() {
#if defined(__x86_64__)
  static const Set set = best();
  if (set == Set::Avx512) return avx512::doubles();
  if (set == Set::Avx2) return avx2::doubles();
#endif
  return baseline::doubles();
}
template <>
const Kernels<float>& kernels<float>() {
#if defined(__x86_64__)
  static const Set set = best();
  if (set == Set::Avx512) return avx512::floats();
  if (set == Set::Avx2) return avx2::floats();
#endif
  return baseline::floats();
}

} // namespace supple::strips
