#include "strips.hpp"

namespace supple::strips {
namespace {

#if defined(__AVX512F__)
constexpr int kBytes = 64;
constexpr int kColumns = 8;
#else
constexpr int kBytes = 32;
constexpr int kColumns = 4;
#endif
#if defined(__AVX2__)
constexpr bool kShuffles = true; ///< lanes can change places at no cost
#else
constexpr bool kShuffles = false;
#endif

#include "strips_body.hpp"

} // namespace

template <>
const Kernels<double>& kernels<double>() {
  return Strips<double, kBytes, kColumns>::table;
}
template <>
const Kernels<float>& kernels<float>() {
  return Strips<float, kBytes, kColumns>::table;
}

} // namespace supple::strips
