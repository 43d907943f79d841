"""A cantilever under its own weight by beam theory, at any size of deflection: a reference.

The bar is cut at s, the arc length from its tip; W(s) is the weight beyond the cut, θ the angle of
the axis below the horizontal. Bending, and if asked stretch and shear (Reissner), then say

    dθ/ds = -M/EI    dM/ds = W cos θ    (x, drop)' = (cos θ, sin θ)    M = 0 at s = 0

and the tip's angle is shot for until θ = 0 at the clamp. Euler–Bernoulli's elastica under a spread
load: Rohde (1953), Quart. Appl. Math. 11; with stretch and shear: Reissner (1972), ZAMP 23.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

Floats = npt.NDArray[np.float64]


@dataclass(frozen=True)
class Cantilever:
    """A straight bar, clamped level at its root; rows from the root to the tip, at equal steps.

    Attributes:
        length: m.
        load: (k,) N/m, downwards, per length at rest.
        bending: (k,) N m², E I.
        stretching, shearing: N, E A and κ G A; infinite in the elastica.
    """

    length: float
    load: Floats
    bending: Floats
    stretching: float = np.inf
    shearing: float = np.inf


@dataclass(frozen=True)
class Bent:
    """The axis from root to tip: places x and drops below the root (n,), m, and angles (n,)."""

    x: Floats
    drop: Floats
    angle: Floats
    length: float

    @property
    def tip(self) -> tuple[float, float]:
        """Displacement of the tip along the bar at rest and downwards, m."""
        return float(self.x[-1] - self.length), float(self.drop[-1])

    @property
    def displacement(self) -> float:
        """|u| of the tip, m."""
        return float(np.hypot(*self.tip))


def bend(bar: Cantilever, points: int = 201) -> Bent:
    """The bent bar at ``points`` places of equal spacing."""
    from scipy.optimize import brentq

    s = np.linspace(0.0, bar.length, points)
    angle = brentq(lambda tip: _from_tip(bar, tip, s[[0, -1]])[0, -1], 0.0, np.pi / 2, xtol=1e-13)
    theta, _, reach, fall = _from_tip(bar, angle, s)
    x, drop = reach[-1] - reach, fall[-1] - fall
    return Bent(x[::-1], drop[::-1], theta[::-1], bar.length)


def _from_tip(bar: Cantilever, angle: float, s: Floats) -> Floats:
    """θ, M, and reach and fall from the tip (4, n) at distances ``s`` (n,) m from it."""
    from scipy.integrate import solve_ivp

    grid = np.linspace(0.0, bar.length, len(bar.load))
    load, bending = bar.load[::-1], bar.bending[::-1]
    steps = np.diff(grid) * (load[1:] + load[:-1]) / 2
    weight = np.concatenate([[0.0], np.cumsum(steps)])

    def slope(at: float, state: Any) -> list[float]:
        theta, moment, *_ = state
        W, c, sn = np.interp(at, grid, weight), np.cos(theta), np.sin(theta)
        along, across = 1 + W * sn / bar.stretching, W * c / bar.shearing
        reach, fall = along * c - across * sn, along * sn + across * c
        return [-moment / np.interp(at, grid, bending), W * reach, reach, fall]

    start = [angle, 0.0, 0.0, 0.0]
    found = solve_ivp(slope, (0.0, bar.length), start, "DOP853", s, rtol=1e-11, atol=1e-14)
    return np.asarray(found.y)
