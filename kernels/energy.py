"""The words of an energy file: kinematics, typed parameters, operations, volumetric terms.

An energy file imports from here (as ``supple.energy``) and from nowhere else; DESIGN §3.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from .kinematics import Kinematics
from .tensors import (
    Ei,
    axes,
    choose,
    cos,
    cross,
    det,
    dot,
    exp,
    identity,
    inner,
    ln,
    positive,
    sin,
    sqrt,
    sym,
    tanh,
    tr,
    transpose,
)

__all__ = [  # what an energy file may import
    "Direction",
    "Ei",
    "Kinematics",
    "Metre",
    "Number",
    "Pa",
    "Ratio",
    "Volumetric",
    "axes",
    "choose",
    "cos",
    "cross",
    "det",
    "dot",
    "exp",
    "identity",
    "inner",
    "lame",
    "ln",
    "log_volumetric",
    "ogden_volumetric",
    "positive",
    "quadratic_volumetric",
    "sin",
    "sqrt",
    "sym",
    "tanh",
    "tr",
    "transpose",
]


@dataclass(frozen=True)
class Kind:
    """Type of a parameter: its unit and its open or closed bounds.

    Called, it gives the same type with other bounds: ``c2: Pa(minimum=0.0) = 1e3``, both closed;
    ``Number(above=0.0)`` is open, and ``Pa(signed=True)`` has no lower one.
    """

    name: str
    unit: str
    minimum: float = -math.inf
    maximum: float = math.inf
    open: bool = True  # the bounds themselves are outside
    size: int = 1

    def __call__(
        self,
        minimum: float | None = None,
        maximum: float | None = None,
        *,
        above: float | None = None,
        signed: bool = False,
    ) -> Kind:
        if above is not None:
            if minimum is not None or maximum is not None:
                raise ValueError("above stands alone")
            return replace(self, minimum=float(above), maximum=math.inf, open=True)
        low = -math.inf if signed else self.minimum if minimum is None else float(minimum)
        high = self.maximum if maximum is None else float(maximum)
        return replace(self, minimum=low, maximum=high, open=False)

    def admits(self, value: Any) -> bool:
        """True where every entry of ``value`` is finite and inside the bounds.

        A direction, one in each row, must not be zero.
        """
        v = np.asarray(value, dtype=float)
        if self.size > 1:
            return bool(np.isfinite(v).all() and (abs(v).max(axis=-1) > 0).all())
        if self.open:
            inside = (v > self.minimum) & (v < self.maximum)
        else:
            inside = (v >= self.minimum) & (v <= self.maximum)
        return bool(np.all(np.isfinite(v) & inside))

    def normalised(self, value: Any) -> tuple[float, ...]:
        """One direction as a unit vector."""
        v = np.asarray(value, dtype=float) / np.max(np.abs(value))
        return tuple(float(x) for x in v / np.linalg.norm(v))

    def range(self) -> str:
        """The bounds in words, for messages."""
        if self.size > 1:
            return "three numbers, not all 0"
        left, right = ("(", ")") if self.open else ("[", "]")
        return f"{left}{self.minimum:g}, {self.maximum:g}{right}"


Pa = Kind("Pa", "Pa", minimum=0.0)
Ratio = Kind("Ratio", "1", minimum=-1.0, maximum=0.5)
Number = Kind("Number", "1")
Metre = Kind("Metre", "m", minimum=0.0)
Direction = Kind("Direction", "1", size=3)


def lame(young: Any, poisson: Any) -> tuple[Any, Any]:
    """Lamé's (mu, lambda), Pa, from Young's modulus, Pa, and Poisson's ratio."""
    mu = young / (2 * (1 + poisson))
    return mu, young * poisson / ((1 + poisson) * (1 - 2 * poisson))


@dataclass(frozen=True)
class Volumetric:
    """A volumetric energy U(J) with the pair of its mixed form psi_dev + p g(J) - U*(p).

    The helpers take g(J) = J - 1, so that p is the pressure, positive in tension. Thesis eq. 38 has
    g(J) = ln J, the same in the limit of fine meshes. On a mesh J is g's constraint only in the
    mean, and p g''(J) < 0 rewards every J that strays from it: in tension near the shear modulus
    Taylor-Hood cells then fold up instead of stretching (a clamped cube at stretch 2: 26 % too
    soft). J - 1 neither rewards nor resists.

    Attributes:
        U: energy, Pa.
        g: constraint g(J), 1: the multiplier p gives the stress p g'(J).
        conjugate: U*(p) = max over J of p g(J) - U(J), Pa, of ``p`` in Pa.
    """

    U: Any
    g: Any
    conjugate: Any


def log_volumetric(J: Any, bulk: Any) -> Volumetric:
    """bulk/2 ln(J)²; its pressure bulk ln(J)/J is at most bulk/e, reached at J = e."""

    def conjugate(p: Any) -> Any:
        s = _log_stretch(p / bulk)
        return p * (exp(s) - 1) - bulk / 2 * s**2

    return Volumetric(bulk / 2 * ln(J) ** 2, J - 1, conjugate)


def quadratic_volumetric(J: Any, bulk: Any) -> Volumetric:
    """bulk/2 (J - 1)²."""
    return Volumetric(bulk / 2 * (J - 1) ** 2, J - 1, lambda p: p**2 / (2 * bulk))


def ogden_volumetric(J: Any, bulk: Any) -> Volumetric:
    """bulk/4 (J² - 1 - 2 ln J); Mazier 2022, eq. 70."""

    def conjugate(p: Any) -> Any:
        # Its pressure is bulk/2 (J - 1/J), so J² = 1 + 2 x J with x = p/bulk.
        x = p / bulk
        ratio = x + sqrt(1 + x**2)
        return p * (ratio / 2 - 1) + bulk / 2 * ln(ratio)

    return Volumetric(bulk / 4 * (J**2 - 1 - 2 * ln(J)), J - 1, conjugate)


def _log_stretch(a: Any) -> Any:
    """The root s <= 1 of s = a exp(s), -W(-a) of Lambert's function; NaN past a = 1/e.

    A start that is right at a = 0 and 1/e and to 2 % between (the root's series in r, Corless et
    al. 1996, eq. 4.22), then two Newton steps.
    """
    r = sqrt(1 - math.e * a)
    s = 1 - ln(1 + math.sqrt(2) * r + (math.e - 1 - math.sqrt(2)) * r**2)
    for _ in range(2):
        push = a * exp(s)
        s = push * (1 - s) / (1 - push)
    return s
