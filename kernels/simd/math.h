/* Vector functions, each lane by libm's. */
#define SUPPLE_LANEWISE(name, function)                                            \
    IN_LANES name(vec a) {                                                         \
        for (int l = 0; l < LANES; ++l) a[l] = function(a[l]);                     \
        return a;                                                                  \
    }
#define SUPPLE_LANEWISE_TWO(name, function)                                        \
    IN_LANES name(vec a, vec b) {                                                  \
        for (int l = 0; l < LANES; ++l) a[l] = function(a[l], b[l]);               \
        return a;                                                                  \
    }
SUPPLE_LANEWISE(supple_sqrt, sqrt)
SUPPLE_LANEWISE(supple_exp, exp)
SUPPLE_LANEWISE(supple_log, log)
SUPPLE_LANEWISE(supple_sin, sin)
SUPPLE_LANEWISE(supple_cos, cos)
SUPPLE_LANEWISE(supple_tan, tan)
SUPPLE_LANEWISE(supple_sinh, sinh)
SUPPLE_LANEWISE(supple_cosh, cosh)
SUPPLE_LANEWISE(supple_tanh, tanh)
SUPPLE_LANEWISE(supple_acos, acos)
SUPPLE_LANEWISE(supple_asin, asin)
SUPPLE_LANEWISE(supple_atan, atan)
SUPPLE_LANEWISE(supple_erf, erf)
SUPPLE_LANEWISE_TWO(supple_pow, pow)
SUPPLE_LANEWISE_TWO(supple_atan2, atan2)

IN_LANES supple_abs(vec a) { return (vec)((mask)a & INT64_MAX); }
IN_LANES supple_min(vec a, vec b) { return supple_choose((a < b) | (b != b), a, b); }
IN_LANES supple_max(vec a, vec b) { return supple_choose((a > b) | (b != b), a, b); }
