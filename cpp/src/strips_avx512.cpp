#if defined(__x86_64__)
#define SUPPLE_UNIT avx512
#define SUPPLE_BYTES 64
#include "strips_unit.hpp"
#endif
