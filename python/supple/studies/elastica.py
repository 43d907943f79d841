"""A cantilever under its own weight by beam theory, at any size of deflection: a reference.

The bar is cut at s, the arc length from its tip; W(s) is the weight beyond the cut, θ the angle of
the axis below the horizontal. Bending, and if asked stretch and shear (Reissner), then say

    dθ/ds = -M/EI    dM/ds = W cos θ    (x, drop)' = (cos θ, sin θ)    M = 0 at s = 0

and the tip's angle is shot for until θ = 0 at the clamp. Euler–Bernoulli's elastica under a spread
load: Rohde (1953), Quart. Appl. Math. 11; with stretch and shear: Reissner (1972), ZAMP 23.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import cos, sin

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
    """The bent bar at ``points`` places of equal spacing; for loads of w L³/E I up to 1000.

    Shooting magnifies rounding by exp(2/3 (w L³/E I)^(1/2)).
    """
    from scipy.optimize import brentq

    step = bar.length / (points - 1)
    halves = _half_steps(bar, points)

    def root(tip: float) -> float:
        return float(_from_tip(bar, halves, tip, step)[-1, 0])

    # Of all tip angles that meet the clamp, the largest hangs; the others are curled up.
    tries = np.pi / 2 - np.append(np.geomspace(1e-12, 1.0, 25), np.pi / 2)
    low = next(tip for tip in tries if root(tip) <= 0)
    theta, _, reach, fall = _from_tip(bar, halves, brentq(root, low, np.pi / 2, xtol=1e-14), step).T
    x, drop = reach[-1] - reach, fall[-1] - fall
    return Bent(x[::-1], drop[::-1], theta[::-1], bar.length)


def unbend(bar: Cantilever, bent: Bent) -> Bent:
    """The shape that ``bent`` would have without its load if it were made of ``bar``.

    The bent shape and the load give the moment, whatever the bar is made of; the bar's own
    curvature is what is seen less M/EI.
    """
    weight, bending = _half_steps(bar, len(bent.angle))[::-2].T
    step = bar.length / (len(weight) - 1)
    whole = _running(weight * np.cos(bent.angle), step)
    angle = bent.angle - _running((whole[-1] - whole) / bending, step)
    return Bent(_running(np.cos(angle), step), _running(np.sin(angle), step), angle, bar.length)


def _running(values: Floats, step: float) -> Floats:
    return np.append(0.0, np.cumsum((values[1:] + values[:-1]) / 2 * step))


def _half_steps(bar: Cantilever, points: int) -> Floats:
    """Weight beyond, N, and E I, N m² (2 points - 1, 2), from the tip to the root."""
    given, wanted = np.linspace(0, 1, len(bar.load)), np.linspace(0, 1, 2 * points - 1)
    load = np.interp(wanted, given, bar.load[::-1])
    bending = np.interp(wanted, given, bar.bending[::-1])
    return np.column_stack([_running(load, bar.length / (2 * points - 2)), bending])


def _from_tip(bar: Cantilever, halves: Floats, angle: float, step: float) -> Floats:
    """θ, M, and reach and fall from the tip (points, 4): Runge's and Kutta's method."""

    def slope(state: Floats, at: Floats) -> Floats:
        theta, moment, *_ = state.tolist()
        weight, bending = at.tolist()
        c, s = cos(theta), sin(theta)
        along, across = 1 + weight * s / bar.stretching, weight * c / bar.shearing
        reach, fall = along * c - across * s, along * s + across * c
        return np.array([-moment / bending, weight * reach, reach, fall])

    states = [np.array([angle, 0.0, 0.0, 0.0])]
    for k in range(0, len(halves) - 1, 2):
        y = states[-1]
        one = slope(y, halves[k])
        two = slope(y + step / 2 * one, halves[k + 1])
        three = slope(y + step / 2 * two, halves[k + 1])
        four = slope(y + step * three, halves[k + 2])
        states.append(y + step / 6 * (one + 2 * two + 2 * three + four))
    return np.array(states)
