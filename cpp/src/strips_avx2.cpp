#if defined(__x86_64__)
#define SUPPLE_UNIT avx2
#define SUPPLE_BYTES 32
#include "strips_unit.hpp"
#endif
