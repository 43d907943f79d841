"""kernels/simd/math.h and angles.h: accurate in every lane, and no lane sees another.

Exact answers are the C library's in extended precision (numpy.longdouble, 11 bits more), which is
itself held to the decimal module's forty digits.
"""

from __future__ import annotations

import ctypes
import platform
import subprocess
from decimal import Decimal, localcontext
from pathlib import Path

import numpy as np
import pytest

from supple.kernels import build
from supple.kernels.simd.lanes import TYPES, functions

LONG = np.longdouble
pytestmark = pytest.mark.skipif(
    np.finfo(LONG).eps > 2e-19, reason="no extended precision to compare with"
)

THIRDS = (-10, -8, -7, -5, -4, -2, -1, 1, 2, 4, 5)
POWERS = (-3, -2, -1, 0, 1, 2, 3, 4, 5)
ONE = ("exp", "log", "sqrt", "abs", "sin", "cos", "tan", "asin", "acos", "atan", "sinh", "cosh",
       "tanh", "erf")  # fmt: skip
TWO = ("pow", "min", "max", "atan2")

_FUSED = """
#ifdef SUPPLE_FUSED
int fused = 1;
#else
int fused = 0;
#endif
"""

_LOOP = """
void {name}(long n, const double* a, const double* b, double* out) {{
    for (long i = 0; i < n; i += LANES) {{
        vec x, y;
        memcpy(&x, a + i, sizeof x);
        memcpy(&y, b + i, sizeof y);
        x = {call};
        memcpy(out + i, &x, sizeof x);
    }}
    (void)b;
}}
"""

#: (lanes, further flags): the machine's own vectors and, on x86, SSE alone: no fused sums.
TARGETS = [(2, "-march=native"), (4, "-march=native"), (8, "-march=native")]
if platform.machine() == "x86_64":
    TARGETS.append((2, "-march=x86-64-v2"))


class Library:
    """The header compiled for some lanes, called on arrays of any length."""

    def __init__(self, folder: Path, lanes: int, target: str) -> None:
        header = f"#define LANES {lanes}\n#define SUPPLE_ALIGNMENT 64\n{TYPES}{functions()}"
        calls = {name: f"supple_{name}(x)" for name in ONE}
        calls |= {name: f"supple_{name}(x, y)" for name in TWO}
        calls |= {f"third_{i}": f"supple_pow_thirds(x, {k})" for i, k in enumerate(THIRDS)}
        calls |= {f"power_{i}": f"supple_powi(x, {n})" for i, n in enumerate(POWERS)}
        loops = "".join(_LOOP.format(name=f"all_{n}", call=c) for n, c in calls.items())
        includes = "".join(f"#include <{h}.h>\n" for h in ("math", "stdint", "string"))
        text = f"{includes}{header}{_FUSED}{loops}"
        (folder / "math.c").write_text(text, encoding="utf-8")
        flags = [*build.OPTIMISATION, target, "-std=c17", "-shared", "-fPIC", "-Wall", "-Wextra"]
        command = [build._compiler(), *flags, "-Wno-psabi", "-Werror", "math.c", "-o", "math.so"]
        subprocess.run([*command, "-lm"], cwd=folder, check=True)
        self._functions = ctypes.CDLL(str(folder / "math.so"))
        self.fused = bool(ctypes.c_int.in_dll(self._functions, "fused"))

    def __call__(self, name: str, x, y=None) -> np.ndarray:
        x = np.ascontiguousarray(x, dtype=float)
        n = -(-len(x) // 8) * 8
        a, b = np.ones(n), np.ones(n)
        a[: len(x)], b[: len(x)] = x, x if y is None else y
        result = np.empty(n)
        pointers = [v.ctypes.data_as(ctypes.c_void_p) for v in (a, b, result)]
        self._functions[f"all_{name}"](ctypes.c_long(n), *pointers)
        return result[: len(x)]


@pytest.fixture(scope="module", params=TARGETS, ids=lambda t: f"{t[0]} {t[1]}")
def lanes(request, tmp_path_factory):
    return Library(tmp_path_factory.mktemp("math"), *request.param)


def ulps(found, exact):
    """Distance in units of the last place of the exact result, 0 where both are inf or NaN."""
    with np.errstate(all="ignore"):
        rounded = exact.astype(float)
        unit = np.spacing(np.abs(np.where(np.isfinite(rounded), rounded, 1.0)))
        same = (found == rounded) | (np.isnan(found) & np.isnan(rounded))
        off = np.abs(found.astype(LONG) - exact) / unit.astype(LONG)
    return np.where(same & ~np.isfinite(rounded), 0.0, off.astype(float))


def uniform(low, high, n=20_000):
    return np.random.default_rng(1).uniform(low, high, n)


def decades(low, high, n=20_000):
    return 10.0 ** np.random.default_rng(2).uniform(low, high, n)


ARGUMENTS = {
    "exp": [uniform(-1, 1), uniform(-708, 709.7), uniform(-746, -700), decades(-320, 0),
            np.arange(-1074, 1024) * np.log(2) / 2],
    "log": [uniform(0.5, 2), decades(-307, 308), decades(-323, -307), 1 + uniform(-1e-3, 1e-3),
            np.sqrt(0.5) * (1 + uniform(-1e-6, 1e-6)), 1 + decades(-15, -1)],
    "sqrt": [decades(-323, 308)],
    "sinh": [uniform(-1, 1), uniform(-30, 30), uniform(-710, 710), decades(-320, 0)],
    "cosh": [uniform(-1, 1), uniform(-30, 30), uniform(-710, 710)],
    "acos": [uniform(-1, 1), 1 - decades(-16, -1), decades(-16, -1) - 1],
    "cos": [uniform(-7, 7), uniform(-1e4, 1e4), decades(0, 300)],
    "sin": [uniform(-7, 7), uniform(-1e4, 1e4), decades(-320, 300)],
}  # fmt: skip
EXACT = {"acos": np.arccos}
BOUND = {"exp": 0.8, "log": 0.9, "sqrt": 0.501, "sinh": 1.6, "cosh": 1.2}


@pytest.mark.parametrize("name", ARGUMENTS)
def test_a_function_is_right_to_its_stated_ulp(name, lanes):
    """Over the whole range, near zeros of the result, and where it is subnormal."""
    for x in ARGUMENTS[name]:
        error = ulps(lanes(name, x), EXACT.get(name, getattr(np, name, None))(x.astype(LONG)))
        assert error.max() <= BOUND.get(name, 1.0), (x[error.argmax()], error.max())


POW_ARGUMENTS = [
    (uniform(0.2, 5), uniform(-5, 5)[::-1]),
    (uniform(0.2, 5), uniform(-450, 450)[::-1]),
    (decades(-323, 308), uniform(-1.2, 1.2)),
    (1 + uniform(-1e-3, 1e-3), uniform(-7e5, 7e5)[::-1]),
    (-uniform(0.1, 9), np.rint(uniform(-400, 400)[::-1])),
]


@pytest.mark.parametrize("case", range(len(POW_ARGUMENTS)))
def test_pow_is_right_to_an_ulp(case, lanes):
    """Results up to the ends of the range take a logarithm good to 2^-64, and one more."""
    x, y = POW_ARGUMENTS[case]
    with np.errstate(over="ignore", under="ignore"):
        error = ulps(lanes("pow", x, y), np.power(x.astype(LONG), y.astype(LONG)))
    assert error.max() <= 0.8, (x[error.argmax()], y[error.argmax()], error.max())


@pytest.mark.parametrize("k", THIRDS)
def test_powers_by_thirds_are_right_to_an_ulp(k, lanes):
    """x^(k/3), by the exact k/3 where products can be fused, else by the double next to it."""
    ends = min(900 / abs(k), 300)
    for x in (uniform(0.3, 3), decades(-ends, ends), decades(-min(ends, 323), 0)):
        root = np.cbrt(x.astype(LONG))
        exact = root ** LONG(k) if k > 0 else 1 / root ** LONG(-k)
        if not lanes.fused:
            exact = np.power(x.astype(LONG), LONG(k / 3))
        assert ulps(lanes(f"third_{THIRDS.index(k)}", x), exact).max() <= 0.55


@pytest.mark.parametrize("n", POWERS)
def test_an_integer_power_is_right_to_as_many_ulp(n, lanes):
    """Half a rounding, of up to two units, in each product and in the division."""
    for x in (uniform(-3, 3), decades(-50, 50)):
        exact = x.astype(LONG) ** LONG(n)
        assert ulps(lanes(f"power_{POWERS.index(n)}", x), exact).max() <= (
            abs(n) if n not in (-1, 2) else 0.51
        )


SPECIAL = np.array([
    0.0, -0.0, 1.0, -1.0, np.inf, -np.inf, np.nan, 5e-324, -5e-324, 2.3e-308, 1e-310, 1.79e308,
    -1.79e308, 709.782712893384, 709.7827128933841, 710.5, -745.1332191019411, -745.1332191019412,
    -746.0, 1e300, -1e300, 0.5, 2.0, 3.0, -3.0, 2.5, -2.5, 1 / 3, 4.0, 2.0**52 + 1, 2.0**53 - 1,
    1 - 2.0**53, 2.0**53, 2.0**51 + 0.5, 1e-20,
])  # fmt: skip


@pytest.mark.parametrize("name", TWO)
def test_special_pairs_give_what_the_c_library_gives(name, lanes):
    """Every pair of zeros, infinities, NaN, subnormal, huge, odd, even and broken numbers."""
    exact = {"pow": np.power, "min": np.fmin, "max": np.fmax, "atan2": np.arctan2}[name]
    x, y = (a.ravel() for a in np.meshgrid(SPECIAL, SPECIAL))
    if name == "atan2":  # the sign of a zero is not kept
        x, y = np.where(x == 0, 0.0, x), np.where(y == 0, 0.0, y)
    with np.errstate(all="ignore"):
        error = ulps(lanes(name, x, y), exact(x.astype(LONG), y.astype(LONG)))
    assert error.max() <= 1.0, (x[error.argmax()], y[error.argmax()])


@pytest.mark.parametrize("name", [n for n in ONE if n != "erf"])
def test_special_arguments_give_what_the_c_library_gives(name, lanes):
    names = {"asin": "arcsin", "acos": "arccos", "atan": "arctan"}
    with np.errstate(all="ignore"):
        exact = getattr(np, names.get(name, name))(SPECIAL.astype(LONG))
        error = ulps(lanes(name, SPECIAL), exact)
    assert error.max() <= 2.0, (SPECIAL[error.argmax()], error.max())


@pytest.mark.parametrize("k", THIRDS)
def test_powers_by_thirds_of_special_numbers(k, lanes):
    """As pow(x, k/3), up to the rounding of k/3."""
    with np.errstate(all="ignore"):
        exact = np.power(SPECIAL.astype(LONG), LONG(k) / 3)
        found = lanes(f"third_{THIRDS.index(k)}", SPECIAL)
        near = np.isclose(found, exact.astype(float), rtol=1e-12, atol=1e-320)
    assert np.all(near | (np.isnan(found) & np.isnan(exact)))


@pytest.mark.parametrize("name", [*ONE, *TWO, "third_0", "third_8", "power_0"])
def test_no_lane_sees_another(name, lanes):
    """Every number beside every special one gives bit for bit what it gives among its like."""
    alone = np.concatenate([lanes(name, np.full(8, x), np.full(8, 0.7))[:1] for x in SPECIAL])
    for shift in range(1, len(SPECIAL)):
        mixed = np.roll(SPECIAL, shift)
        found = np.roll(lanes(name, mixed, np.full(len(mixed), 0.7)), -shift)
        assert np.array_equal(found, alone, equal_nan=True)


def test_extended_precision_is_the_decimal_module_s():
    """The reference of the tests above, to 0.01 ulp of a double."""
    with localcontext() as context:
        context.prec = 40
        for x in (*uniform(0.01, 30.0, 50), *decades(-300, 2, 50)):
            for function, exact in ((np.exp, Decimal(x).exp()), (np.log, Decimal(x).ln())):
                found = function(LONG(x))
                head = float(found)
                value = Decimal(head) + Decimal(float(found - LONG(head)))
                assert abs(value - exact) <= Decimal("0.01") * Decimal(float(np.spacing(abs(head))))
