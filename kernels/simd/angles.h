/* Hyperbolic and circular functions of LANES numbers at once; behind math.h, which says how good. */
/* e^|x|/2, which overflows where sinh and cosh do. */
SUPPLE_INLINE supple_half_exp(vec size) {
    const double ln2 = 0x1.62e42fefa39efp-1, rest = 0x1.abc9e3b39803fp-56;
    size = supple_choose(size > 800.0, supple_all(800.0), size);
    const vec high = size - ln2;
    return supple_exp_of_sum(high, ((size - high) - ln2) - rest);
}

SUPPLE_CALLED supple_cosh(vec x) {
    const vec half = supple_half_exp(supple_abs(x));
    return half + 0.25 / half;
}

/* Below 1 the odd series, near-minimax to 2^-61, where the difference of exponentials cancels. */
SUPPLE_CALLED supple_sinh(vec x) {
    const vec size = supple_abs(x), z = x * x, z2 = z * z;
    const vec p01 = 0x1.111111111104p-7 * z + 0x1.5555555555556p-3;
    const vec p23 = 0x1.71de3a4058655p-19 * z + 0x1.a01a01a0318c3p-13;
    const vec p45 = 0x1.6118e07ffded2p-33 * z + 0x1.ae646b4b21f1bp-26;
    const vec p = (p01 + z2 * p23) + z2 * z2 * (p45 + z2 * 0x1.b52e61175a1d4p-41);
    const vec half = supple_half_exp(size), large = half - 0.25 / half;
    const vec signed_large = (vec)((bits)large | ((bits)x & (UINT64_C(1) << 63)));
    return supple_choose(size < 1.0, x + x * z * p, signed_large);
}

/* sin(x + turn π/2) for |x| < 2^19: x = n π/2 + r with π/2 in three parts (Cody and Waite 1980),
   r in two doubles, and the two series on |r| <= π/4, near-minimax to 2^-57.9 and 2^-64. */
SUPPLE_INLINE supple_sine(vec x, unsigned turn) {
    const double shift = 0x1.8p52;
    const vec counted = x * 0x1.45f306dc9c883p-1 + shift, n = counted - shift;
    const vec t = x - n * 0x1.921fb544p+0, part = n * 0x1.0b4611ap-34;
    const vec head = t - part, back = head - t;
    const vec lost = ((t - (head - back)) - (part + back)) - n * 0x1.898cc51701b84p-64;
    const vec r = head + lost, r_low = (head - r) + lost, z = r * r, z2 = z * z;
    const vec s01 = 0x1.111111110f775p-7 * z - 0x1.5555555555548p-3;
    const vec s23 = 0x1.71de3563063a5p-19 * z - 0x1.a01a019bf64fap-13;
    const vec s45 = 0x1.5d8f1f3f89e72p-33 * z - 0x1.ae5e57a5f7feap-26;
    const vec sine = r + (r_low + r * z * (s01 + z2 * (s23 + z2 * s45)));
    const vec c01 = 0x1.555555555554bp-5 - 0x1.6c16c16c15046p-10 * z;
    const vec c23 = 0x1.a01a019c9697fp-16 - 0x1.27e4f7f80e871p-22 * z;
    const vec c45 = 0x1.1ee9e0a72f418p-29 - 0x1.8fa9264b27f3cp-37 * z;
    const vec first = 1.0 - 0.5 * z;
    const vec tail = z2 * (c01 + z2 * (c23 + z2 * c45)) - r * r_low;
    const vec cosine = first + (((1.0 - first) - 0.5 * z) + tail);
    const bits quarter = (bits)counted + turn;
    const vec y = supple_choose((mask)(quarter & 1) != 0, cosine, sine);
    return (vec)((bits)y ^ ((quarter & 2) << 62));
}

/* Lanes of larger arguments, infinity and NaN go to the C library. */
#define SUPPLE_SINE(name, turn)                                      \
    SUPPLE_CALLED supple_##name(vec x) {                             \
        vec y = supple_sine(x, turn);                                \
        const mask far = ~(supple_abs(x) < 0x1p19);                  \
        SUPPLE_EACH if (far[lane]) y[lane] = name(x[lane]);          \
        return y;                                                    \
    }
SUPPLE_SINE(sin, 0)
SUPPLE_SINE(cos, 1)

/* π/2 - asin x up to 1/2, beyond it 2 asin sqrt((1 - |x|)/2) or π less that; the series of asin
   near-minimax to 2^-59. */
SUPPLE_CALLED supple_acos(vec x) {
    const vec size = supple_abs(x);
    const mask inner = size <= 0.5;
    const vec z = supple_choose(inner, x * x, 0.5 - 0.5 * size), root = supple_sqrt(z);
    const vec s = supple_choose(inner, x, root), z2 = z * z, z4 = z2 * z2;
    const vec p00 = 0x1.333333332e1cfp-4 * z + 0x1.5555555555577p-3;
    const vec p02 = 0x1.f1c71a9a148c8p-6 * z + 0x1.6db6db720719fp-5;
    const vec p04 = 0x1.1c49fc65881d9p-6 * z + 0x1.6e8bde3f7b103p-6;
    const vec p06 = 0x1.758f673d28cccp-7 * z + 0x1.ca1e60d2c0ed9p-7;
    const vec p08 = 0x1.e94ffef1b5ff1p-9 * z + 0x1.61044ffabf9b5p-7;
    const vec p10 = -0x1.56890f4fe5aecp-6 * z + 0x1.6295e03cc9fd7p-6;
    const vec p = ((p00 + z2 * p02) + z4 * (p04 + z2 * p06)) +
                  z4 * z4 * ((p08 + z2 * p10) + z4 * 0x1.0ad250b46e8b4p-5);
    const vec beyond = s * z * p;
    const vec near = 0x1.921fb54442d18p+0 - (s - (0x1.1a62633145c07p-54 - beyond));
    const vec rest = supple_choose(root > 0.0, supple_residual(z, root, root) / (2.0 * root), z);
    const vec twice = 2.0 * (s + (beyond + rest));
    const vec far = 0x1.921fb54442d18p+1 - (twice - 0x1.1a62633145c07p-53);
    return supple_choose(inner, near, supple_choose(x < 0.0, far, twice));
}
