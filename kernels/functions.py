"""Functions that kernels need and UFL and C lack: a frozen value, the exponential integral.

UFL fixes its types when a form is made, so this module is imported before (by `generate`).
"""

from __future__ import annotations

from typing import Any

import ufl
from ffcx.codegeneration import lnodes
from ufl.constantvalue import ScalarValue, Zero, as_ufl
from ufl.core.ufl_type import ufl_type
from ufl.mathfunctions import MathFunction

#: What a kernel's source needs to call them: C name → definition, emitted where it is used.
IN_C = {
    "frozen": "static inline double frozen(double x) { return x; }",
    # Ei(x) = ln(x/r) + sum over k of (x^k - r^k)/(k k!) from the root r of Ei, in two doubles: all
    # terms have one sign, so nothing cancels, near the root neither. Above 40 the asymptotic sum,
    # DLMF 6.12.2, whose smallest term is 7e-17.
    "exponential_integral": """static inline double exponential_integral(double x) {
    if (x > 40.0) {
        double term = 1.0, sum = 1.0;
        for (int k = 1; k <= 40; ++k) { term *= k / x; sum += term; }
        return exp(x) / x * sum;
    }
    const double r = 0.3725074107813666, tail = 1.3140183414386028e-17;
    const double d = (x - r) - tail;
    double sum = fabs(d) < 0.5 * r ? log1p(d / r) : log(x / r);
    double power = 1.0, difference = d, factorial = 1.0;
    for (int k = 1; k <= 200; ++k) {
        factorial *= k;
        const double term = difference / (k * factorial);
        sum += term;
        if (fabs(term) <= 1e-18 * fabs(sum)) break;
        power *= r;
        difference = x * difference + power * d;
    }
    return sum;
}""",
    "supple_exponential_integral": """
IN_LANES supple_exponential_integral(vec x) {
    for (int l = 0; l < LANES; ++l) x[l] = exponential_integral(x[l]);
    return x;
}""",
}


@ufl_type()
class Frozen(MathFunction):
    """A value without a derivative."""

    __slots__ = ()

    def __init__(self, argument: Any) -> None:
        MathFunction.__init__(self, "frozen", argument)

    def derivative(self) -> Any:
        return as_ufl(0.0)


@ufl_type()
class ExponentialIntegral(MathFunction):
    """Ei(x) for x > 0, the integral of exp(t)/t."""

    __slots__ = ()

    def __init__(self, argument: Any) -> None:
        MathFunction.__init__(self, "exponential_integral", argument)

    def derivative(self) -> Any:
        (x,) = self.ufl_operands
        return ufl.exp(x) / x


def freeze(x: Any) -> Any:
    """``x`` held constant; numbers are constant already."""
    x = as_ufl(x)
    return x if isinstance(x, (ScalarValue, Zero)) else Frozen(x)


lnodes._ufl_call_lookup[Frozen] = lnodes._math_function
lnodes._ufl_call_lookup[ExponentialIntegral] = lnodes._math_function
