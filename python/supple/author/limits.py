"""How far a law goes along each test: where its states end, and where it stops being elliptic."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from . import modes
from .curves import Curve, along
from .ellipticity import least_wave_stiffness
from .points import PointLaw

Floats = npt.NDArray[np.float64]
Bools = npt.NDArray[np.bool_]

_REFINEMENTS, _PARTS = 3, 11


@dataclass(frozen=True)
class Limit:
    """The first value on the way out from rest where something fails."""

    curve: Curve
    value: float
    side: str  # "below" or "above"

    def __str__(self) -> str:
        mode = self.curve.mode
        along_axis = "" if self.curve.axes == (0, 1, 2) else f" along {'xyz'[self.curve.axes[0]]}"
        return f"{mode.title} {mode.control}{along_axis} {self.value:.3g}"


def ends(law: PointLaw, curve: Curve) -> list[Limit]:
    """Where the law has no state any more, each side of rest."""
    return list(_first(law, curve, lambda c: c.exists))


def losses(law: PointLaw, curve: Curve, scale: float) -> list[Limit]:
    """Where it loses strong ellipticity, each side of rest; ``scale`` is its stiffness, Pa.

    A state that does not exist loses nothing: see `ends`.
    """
    return list(_first(law, curve, lambda c: wave_stiffness(law, c) > 1e-9 * scale))


def wave_stiffness(law: PointLaw, curve: Curve) -> Floats:
    """min over unit a, n of (a⊗n):A:(a⊗n) (n,) Pa along the curve; +inf where it has no state."""
    least = least_wave_stiffness(modes.tangent(law, curve.deformation, curve.axes))
    return np.where(np.isfinite(least), least, np.inf)


def _first(law: PointLaw, curve: Curve, holds: Callable[[Curve], Bools]) -> Iterator[Limit]:
    good = holds(curve)
    rest = int(np.abs(curve.values - curve.mode.rest).argmin())
    for side, step in (("below", -1), ("above", 1)):
        path = np.arange(rest, -1 if step < 0 else len(good), step)
        failing = path[~good[path]]
        if len(failing) and failing[0] != rest:
            inner, outer = curve.values[failing[0] - step], curve.values[failing[0]]
            yield Limit(curve, _between(law, curve, holds, inner, outer), side)


def _between(
    law: PointLaw, curve: Curve, holds: Callable[[Curve], Bools], inner: float, outer: float
) -> float:
    """The first failing value between a good one and a failing one, to 1e-3 of their distance."""
    for _ in range(_REFINEMENTS):
        values = np.linspace(inner, outer, _PARTS + 1)
        fails = ~holds(along(law, curve.mode, values, curve.axes))
        fails[-1] = True
        first = max(1, int(fails.argmax()))
        inner, outer = values[first - 1], values[first]
    return float(outer)
