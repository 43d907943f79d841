/// Which of eight lanes a comparison holds in, as bits; private to the runtime.
#pragma once

#include <cstddef>

#ifdef __AVX512DQ__
#include <immintrin.h>
#endif

namespace supple {

template <class Flags>
unsigned bits_of(const Flags& holds) {
  static_assert(sizeof(Flags) == 64);
#ifdef __AVX512DQ__
  return _mm512_movepi64_mask(reinterpret_cast<__m512i>(holds));
#else
  unsigned bits = 0;
  for (unsigned k = 0; k < 8; ++k)
    bits |= holds[k] != 0 ? 1u << k : 0u;
  return bits;
#endif
}

/// use(lane) for each that is set, in their order: branches by lane would be guessed wrongly.
template <class Use>
void each_bit(unsigned bits, const Use& use) {
  for (; bits != 0; bits &= bits - 1)
    use(static_cast<std::size_t>(__builtin_ctz(bits)));
}

} // namespace supple
