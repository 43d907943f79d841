#include "strips.hpp"

namespace supple::strips {
namespace {

#include "strips_body.hpp"

#if defined(__AVX512F__)
constexpr int kBytes = 64;
constexpr int kColumns = 8;
#else
constexpr int kBytes = 32;
constexpr int kColumns = 4;
#endif

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
