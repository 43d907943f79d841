"""How many cells a call treats, and the C that every kernel of lanes begins with.

LANES fills the widest registers of the processor that the compiler is told of: 8 doubles with
AVX-512, 4 with AVX, 2 otherwise (SSE2, NEON). The C is the same for all of them. Four instead of
eight were slower in every kernel measured, in those too that keep most values in memory (inverse
tangents on Q2 and Q1, powers of stretches: by 13 to 50 %), so no form has a rule of its own.
"""

from __future__ import annotations

from functools import cache
from pathlib import Path

WIDTH = """#if defined(__AVX512F__)
#define LANES 8
#elif defined(__AVX__)
#define LANES 4
#else
#define LANES 2
#endif
"""

#: What composites read of either path.
PLAIN = "#define LANES 1\n#define LOWER 0\n#define ALIGNED\n"

TYPES = """
#define LOWER 1
#define ALIGNED _Alignas(SUPPLE_ALIGNMENT)
typedef double vec __attribute__((vector_size(8 * LANES), may_alias));
typedef int64_t mask __attribute__((vector_size(8 * LANES), may_alias));
#define IN_LANES __attribute__((unused)) static inline vec

/* a where m, b elsewhere */
IN_LANES supple_choose(mask m, vec a, vec b) { return (vec)((m & (mask)a) | (~m & (mask)b)); }
/* a number as a vector */
IN_LANES supple_all(double a) { return a - (vec){0}; }
"""


@cache
def preamble() -> str:
    """LANES, types, selection and vector functions; stands behind the contract."""
    return WIDTH + TYPES + functions()


def functions() -> str:
    """The vector functions; stands behind LANES and TYPES."""
    headers = (Path(__file__).parent / name for name in ("math.h", "angles.h"))
    return "".join(header.read_text(encoding="utf-8") for header in headers)
