/// One instruction set's unit of the kernels. Before it is included SUPPLE_UNIT names the unit and
/// SUPPLE_BYTES says how wide its vectors are.
#include "strips.hpp"

namespace supple::strips {
namespace {

constexpr int kBytes = SUPPLE_BYTES;
constexpr int kColumns = kBytes / 8; ///< as many as a tile's sums find registers
#if defined(__AVX2__)
constexpr bool kShuffles = true; ///< lanes can change places at no cost
#else
constexpr bool kShuffles = false;
#endif

#include "strips_solve.hpp"
// What is built on it.
#include "strips_body.hpp"

} // namespace

namespace SUPPLE_UNIT {
const Kernels<double>& doubles() {
  return Strips<double, kBytes, kColumns>::table;
}
const Kernels<float>& floats() {
  return Strips<float, kBytes, kColumns>::table;
}
} // namespace SUPPLE_UNIT

} // namespace supple::strips
