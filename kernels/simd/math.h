/* Mathematical functions of LANES numbers at once, for generated kernels.
 *
 * GCC/Clang vector extensions, no intrinsics and no tables: every lane goes the same way, and none
 * sees another. Worst errors that tests/kernels/test_vector_math.py holds, in units of the last
 * place (ulp) of the exact result:
 *     supple_exp 0.8, supple_log 0.9, supple_pow 0.8, supple_pow_thirds 0.55 (1 without FMA)
 *     supple_sin, supple_cos, supple_acos 1, supple_sinh 1.6, supple_cosh 1.2
 *     supple_powi(x, n) |n|, 1/2 for n = 2 and -1; supple_sqrt 1/2; supple_abs, _min, _max exact
 *     tan, asin, atan, tanh, erf, atan2: the C library's, lane by lane
 * Zeros, infinities, NaN, negative and subnormal arguments give what the C library gives, but for
 * the sign of a zero. Written for -ffp-contract=fast without -ffast-math: a sum or difference may
 * become part of a fused one, nothing is reassociated. Types and supple_choose: lanes.py.
 */
typedef uint64_t bits __attribute__((vector_size(8 * LANES), may_alias));
#define SUPPLE_INLINE IN_LANES __attribute__((always_inline))
/* Called, not inlined: long, and two calls with one argument become one. */
#define SUPPLE_CALLED __attribute__((noinline, const, unused)) static vec
#define SUPPLE_EACH for (int lane = 0; lane < LANES; ++lane)

SUPPLE_INLINE supple_abs(vec x) { return (vec)((bits)x & UINT64_C(0x7fffffffffffffff)); }

/* The C library's: a NaN gives way to a number. */
SUPPLE_INLINE supple_max(vec x, vec y) { return supple_choose((x > y) | (y != y), x, y); }
SUPPLE_INLINE supple_min(vec x, vec y) { return supple_choose((x < y) | (y != y), x, y); }

SUPPLE_INLINE supple_sqrt(vec x) {
    SUPPLE_EACH x[lane] = __builtin_sqrt(x[lane]);
    return x;
}

#if defined(__FP_FAST_FMA) || defined(__FMA__) || defined(__ARM_FEATURE_FMA)
#define SUPPLE_FUSED
#endif

/* c - a b in (nearly) one rounding. Without a fused operation by Dekker (1971), Numer. Math. 18,
   whose products of halves are exact; there nothing can be contracted. */
SUPPLE_INLINE supple_residual(vec c, vec a, vec b) {
#ifdef SUPPLE_FUSED
    SUPPLE_EACH c[lane] = __builtin_fma(-a[lane], b[lane], c[lane]);
    return c;
#else
    const vec ah = (vec)((bits)a & ~UINT64_C(0x7ffffff)), al = a - ah;
    const vec bh = (vec)((bits)b & ~UINT64_C(0x7ffffff)), bl = b - bh, p = a * b;
    return (c - p) - (((ah * bh - p) + (ah * bl + al * bh)) + al * bl);
#endif
}

/* Lane by lane through the C library. */
#define SUPPLE_BY_LANES(name)                         \
    SUPPLE_CALLED supple_##name(vec x) {              \
        SUPPLE_EACH x[lane] = name(x[lane]);          \
        return x;                                     \
    }
#define SUPPLE_BY_LANES_2(name)                       \
    SUPPLE_CALLED supple_##name(vec x, vec y) {       \
        SUPPLE_EACH x[lane] = name(x[lane], y[lane]); \
        return x;                                     \
    }
SUPPLE_BY_LANES(tan)
SUPPLE_BY_LANES(asin)
SUPPLE_BY_LANES(atan)
SUPPLE_BY_LANES(tanh)
SUPPLE_BY_LANES(erf)
SUPPLE_BY_LANES_2(atan2)

/* exp(x + tail) for a tail below an ulp of 1e3: x + tail = n ln 2 + r after Cody and Waite (1980)
   with the rounding of r carried along; exp(r) = 1 + r + r² P(r), P near-minimax on |r| <= ln(2)/2
   to 2^-57.6; 2^n in two factors, the first of which never makes a subnormal number. */
SUPPLE_INLINE supple_exp_of_sum(vec x, vec tail) {
    const double shift = 0x1.8p52 + 1022;
    x = supple_choose(x > 710.0, supple_all(710.0), x);
    x = supple_choose(x < -746.0, supple_all(-746.0), x);
    const vec t = x * 0x1.71547652b82fep+0 + shift, n = t - shift;
    const vec w = x - n * 0x1.62e42fefa38p-1, v = tail - n * 0x1.ef35793c7673p-45;
    const vec r = w + v, c = (w - r) + v;
    const vec r2 = r * r, r4 = r2 * r2;
    const vec p01 = 0x1.555555555551p-3 * r + 0x1.000000000000cp-1;
    const vec p23 = 0x1.111111112119bp-7 * r + 0x1.555555554fe4p-5;
    const vec p45 = 0x1.a01a014dbc99ep-13 * r + 0x1.6c16c185f760fp-10;
    const vec p67 = 0x1.71ded720eda62p-19 * r + 0x1.a01995e460d9dp-16;
    const vec p89 = 0x1.adfa45d221166p-26 * r + 0x1.28b0d4566b2bbp-22;
    const vec p = (p01 + r2 * p23) + r4 * ((p45 + r2 * p67) + r4 * p89);
    const vec s = 1.0 + r;
    const vec y = s + (((1.0 - s) + r) + (c + r2 * p));
    const bits low = (bits)(x < -700.0) & (UINT64_C(65) << 52);
    const vec two_n = (vec)(((bits)t << 52) + low);
    return y * two_n * (vec)(UINT64_C(0x4000000000000000) - low);
}

SUPPLE_CALLED supple_exp(vec x) { return supple_exp_of_sum(x, supple_all(0.0)); }

/* x = 2^k (1 + f) with 1 + f in [sqrt(1/2), sqrt(2)), for finite x > 0, subnormal ones too. */
SUPPLE_INLINE supple_split(vec x, vec* k) {
    const mask tiny = x < 0x1p-1022;
    const bits raw = (bits)supple_choose(tiny, x * 0x1p54, x);
    const bits moved = raw + UINT64_C(0x95f619980c433);
    const vec big = (vec)((moved >> 52) | UINT64_C(0x4330000000000000));
    *k = big - supple_choose(tiny, supple_all(0x1p52 + 1023 + 54), supple_all(0x1p52 + 1023));
    return (vec)((moved & UINT64_C(0xfffffffffffff)) + UINT64_C(0x3fe6a09e667f3bcd)) - 1.0;
}

/* For finite x > 0 `regular`, else what the logarithm is at 0, below it, at infinity and NaN. */
SUPPLE_INLINE supple_log_anywhere(vec x, vec regular) {
    const vec at_zero = supple_all(-__builtin_inf()), below = supple_all(__builtin_nan(""));
    const vec special = supple_choose(x == 0.0, at_zero, supple_choose(x < 0.0, below, x));
    return supple_choose((x > 0.0) & (x < __builtin_inf()), regular, special);
}

/* With s = f/(2 + f): ln(1 + f) = 2 atanh s = f - f²/2 + s (f²/2 + R(s²)), where f is exact; the
   series' tail R near-minimax to 2^-59.4. After Tang (1990), ACM TOMS 16(4), without his table. */
SUPPLE_CALLED supple_log(vec x) {
    vec k;
    const vec f = supple_split(x, &k);
    const vec s = f / (2.0 + f), z = s * s, z2 = z * z, half = 0.5 * f * f;
    const vec q01 = 0x1.999999997f72dp-2 * z + 0x1.5555555555594p-1;
    const vec q23 = 0x1.c71c51d50fa2ap-3 * z + 0x1.249249423c734p-2;
    const vec q45 = 0x1.39a0ddfa994c2p-3 * z + 0x1.7466486178ecdp-3;
    const vec q = (q01 + z2 * q23) + z2 * z2 * (q45 + z2 * 0x1.2f0d5e2c92795p-3);
    const vec low = s * (half + z * q) + k * 0x1.ef35793c7673p-45;
    return supple_log_anywhere(x, k * 0x1.62e42fefa38p-1 - ((half - low) - f));
}

#ifdef SUPPLE_FUSED
/* ln x = the result + *low, to 2^-67 of it: the same series, its quotient and leading terms in two
   doubles (Dekker 1971). */
SUPPLE_INLINE supple_log_in_two(vec x, vec* low) {
    vec k;
    const vec f = supple_split(x, &k);
    const vec d = 2.0 + f, d_low = (2.0 - d) + f, inverse = 1.0 / d, s = f * inverse;
    const vec s_low = (supple_residual(f, s, d) - s * d_low) * inverse;
    const vec z = s * s, z_low = 2.0 * s * s_low - supple_residual(z, s, s);
    const vec z2 = z * z;
    const vec p01 = 0x1.249249249315p-2 * z + 0x1.9999999999995p-2;
    const vec p23 = 0x1.745d183dec639p-3 * z + 0x1.c71c71c56444fp-3;
    const vec p45 = 0x1.112112a7d433ep-3 * z + 0x1.3b135fff863dfp-3;
    const vec p67 = 0x1.eb76255ddc6b8p-4 * z + 0x1.de26213628c94p-4;
    const vec tail = z * ((p01 + z2 * p23) + z2 * z2 * (p45 + z2 * p67));
    const vec q = 0x1.5555555555555p-1 + tail;
    const vec q_low = ((0x1.5555555555555p-1 - q) + tail) + 0x1.5555555555555p-55;
    const vec t = z * q, t_low = (z * q_low + z_low * q) - supple_residual(t, z, q);
    const vec u = 2.0 + t, u_low = ((2.0 - u) + t) + t_low;
    const vec g = s * u, g_low = (s * u_low + s_low * u) - supple_residual(g, s, u);
    const vec k_ln2 = k * 0x1.62e42fefa38p-1, sum = k_ln2 + g;
    *low = ((k_ln2 - sum) + g) + (g_low + k * 0x1.ef35793c7673p-45);
    return sum;
}

/* x^y as exp(y ln |x|), and the rules of C17, F.10.4.4. */
SUPPLE_CALLED supple_pow(vec x, vec y) {
    const vec size = supple_abs(x), power = supple_abs(y);
    vec low;
    const vec high = supple_log_anywhere(size, supple_log_in_two(size, &low));
    const vec e = y * high;
    const vec e_low = y * low - supple_residual(e, y, high);
    const mask in_range = supple_abs(e) < 1e3;
    vec r = supple_exp_of_sum(e, (vec)(in_range & (mask)e_low));

    const mask large = power >= 0x1p52;  /* an integer, and even from 2^53 on */
    const vec aligned = supple_choose(large, power, power + 0x1p52);
    const mask whole = large | (aligned - 0x1p52 == power);
    const bits odd = (bits)(whole & (power < 0x1p53)) & (bits)aligned & 1;
    r = (vec)((bits)r ^ ((bits)x & (odd << 63)));
    r = supple_choose((x < 0.0) & (size < __builtin_inf()) & ~whole,
                      supple_all(__builtin_nan("")), r);
    const mask one = (y == 0.0) | (x == 1.0) | ((size == 1.0) & (power == __builtin_inf()));
    return supple_choose(one, supple_all(1.0), r);
}

/* x^(-1/3) to an ulp or so for normal x > 0: a linear start on the upper half of the bits, right to
   4 %, and two steps of the binomial series of (1 - h)^(-1/3), h = 1 - x y³. */
SUPPLE_CALLED supple_rcbrt(vec x) {
    const vec upper = (vec)(((bits)x >> 32) | UINT64_C(0x4330000000000000)) - 0x1p52;
    vec y = (vec)((bits)(upper * (-1.0 / 3.0) + (0x1p52 + 1430195274.0)) << 32);
    vec h = 1.0 - x * y * (y * y);
    const vec series = (1.0 / 3.0) + h * (2.0 / 9.0 + h * (14.0 / 81.0 + h * (35.0 / 243.0)));
    y += y * (h * series);
    h = 1.0 - x * y * (y * y);
    return y + y * (h * (1.0 / 3.0 + h * (2.0 / 9.0)));
}

/* What `y`, of supple_rcbrt(x), lacks. */
SUPPLE_CALLED supple_rcbrt_rest(vec x, vec y) {
    const vec u = x * y, v = y * y;
    const vec u_low = -supple_residual(u, x, y), v_low = -supple_residual(v, y, y);
    const vec h = supple_residual(supple_all(1.0), u, v) - (u_low * v + u * v_low);
    return y * (h * (1.0 / 3.0));
}

/* x^(k/3) for a literal k that 3 does not divide: powers of x^(-1/3) in two doubles, and of x. */
SUPPLE_INLINE supple_pow_thirds(vec x, int k) {
    const mask tiny = x < 0x1p-1022;
    const vec safe = supple_choose(tiny, x * 0x1p54, x);
    const vec y = supple_rcbrt(safe), rest = supple_rcbrt_rest(safe, y);
    const vec scale = supple_choose(tiny, supple_all(0x1p18), supple_all(1.0));
    vec h = supple_all(1.0), l = supple_all(0.0), base = y * scale, base_low = rest * scale;
    unsigned left = k < 0 ? 0u - (unsigned)k : 2u - ((unsigned)k + 2u) % 3u;
    for (; left; left >>= 1) {
        if (left & 1u) {
            const vec p = h * base;
            l = (h * base_low + l * base) - supple_residual(p, h, base);
            h = p;
        }
        const vec q = base * base;
        base_low = 2.0 * base * base_low - supple_residual(q, base, base);
        base = q;
    }
    for (int i = 0; i < (k + 2) / 3; ++i) {
        const vec p = h * x;
        l = l * x - supple_residual(p, h, x);
        h = p;
    }
    const vec inf = supple_all(__builtin_inf()), zero = supple_all(0.0);
    const vec beyond = supple_choose(supple_abs(x) == inf, k < 0 ? zero : inf,
                                     supple_all(__builtin_nan("")));
    const vec special = supple_choose(x == 0.0, k < 0 ? inf : zero, beyond);
    return supple_choose((x > 0.0) & (x < inf), supple_choose(h < inf, h + l, h), special);
}

#else /* two doubles a number take twice the C library's time without fused operations */
SUPPLE_BY_LANES_2(pow)
SUPPLE_INLINE supple_pow_thirds(vec x, int k) { return supple_pow(x, supple_all(k / 3.0)); }
#endif

/* x^n for a literal n, by squaring. */
SUPPLE_INLINE supple_powi(vec x, int n) {
    vec r = supple_all(1.0);
    for (unsigned left = n < 0 ? 0u - (unsigned)n : (unsigned)n; left; left >>= 1, x *= x)
        if (left & 1u) r *= x;
    if (n < 0) r = 1.0 / r;
    return r;
}
