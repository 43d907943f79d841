"""C functions of our own: the exponential integral to 1e-14; sums over stretches in UFL."""

from __future__ import annotations

import ctypes
import subprocess
from decimal import Decimal, localcontext

import numpy as np
import pytest
import ufl

from supple.kernels import build, functions
from supple.kernels.elements import space
from supple.kernels.energy import Ei

EULER = Decimal(
    "0.57721566490153286060651209008240243104215933593992359880576723488486772677766467"
)
ROOT = 0.3725074107813666


@pytest.fixture(scope="module")
def in_c(tmp_path_factory):
    """The kernels' own C function, compiled with the kernels' flags."""
    folder = tmp_path_factory.mktemp("ei")
    text = functions.IN_C["exponential_integral"].replace("static inline ", "")
    (folder / "ei.c").write_text(f"#include <math.h>\n{text}\n", encoding="utf-8")
    flags = [f for f in build.FLAGS if "visibility" not in f]
    command = [build._compiler(), "-O3", *flags, "-Wall", "-Werror", "ei.c", "-o", "ei.so", "-lm"]
    subprocess.run(command, cwd=folder, check=True)
    function = ctypes.CDLL(str(folder / "ei.so")).exponential_integral
    function.argtypes, function.restype = [ctypes.c_double], ctypes.c_double
    return function


def exact(x):
    """Ei(x) = γ + ln x + Σ x^k/(k k!), in 75 digits beyond what cancels or grows."""
    with localcontext() as context:
        context.prec = 75 + int(x)
        x = Decimal(float(x))
        total, power, k = EULER + x.ln(), Decimal(1), 0
        while k < x or power > Decimal(10) ** -60:
            k += 1
            power = power * x / k
            total += power / k
        return total


@pytest.mark.parametrize(
    "x",
    [1e-300, 1e-8, 0.01, 0.18, 0.19, 0.37, ROOT, ROOT + 1e-9, 0.3726, 0.5, 0.56, 1.0, 5.0, 13.7,
     39.9, 40.0, 40.1, 48.0, 51.0, 80.0, 300.0],
)  # fmt: skip
def test_exponential_integral_is_right_to_1e_14(x, in_c):
    """Also beside its root, against its series in decimal arithmetic."""
    assert abs(Decimal(in_c(x)) / exact(x) - 1) < Decimal("1e-14")
    assert abs(Decimal(float(Ei(x))) / exact(x) - 1) < Decimal("1e-14")


def test_exponential_integral_is_no_number_below_zero(in_c):
    """And -∞ at 0, as it must."""
    assert np.isnan(in_c(-1.0))
    assert in_c(0.0) == -np.inf
    with np.errstate(all="ignore"):
        assert np.isnan(Ei(-1.0))
        assert Ei(0.0) == -np.inf


def test_a_frozen_value_has_no_derivative_and_ei_that_of_its_integrand():
    """d frozen(x) = 0, d Ei(x) = eˣ/x; a constant needs no freezing."""
    x = ufl.variable(space("P1").field(1))
    assert ufl.algorithms.apply_derivatives.apply_derivatives(
        ufl.diff(functions.freeze(x), x)
    ) == ufl.as_ufl(0)
    slope = ufl.algorithms.apply_derivatives.apply_derivatives(ufl.diff(Ei(x), x))
    assert slope == ufl.exp(x) / x
    assert functions.freeze(2.0) == ufl.as_ufl(2.0)
