"""Fields of which the procedural torso's blendshapes are made: windows and local displacements."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import numpy.typing as npt

from supple.registration.procedural_rig import arm_part, left

Floats = npt.NDArray[np.float64]
#: points (n, 3) m and outward normals (n, 3) to displacements (n, 3) m.
Field = Callable[[Floats, Floats], Floats]


def window(points: Floats, centre: npt.ArrayLike, radii: npt.ArrayLike) -> Floats:
    """(n,): 1 at ``centre``, 0 outside the ellipsoid of ``radii`` m; twice differentiable."""
    r2 = (((points - np.asarray(centre)) / np.asarray(radii)) ** 2).sum(axis=1)
    return np.asarray(np.maximum(1 - r2, 0.0) ** 3)


def band(height: Floats, centre: float, half: float) -> Floats:
    """(n,): 1 at the height ``centre``, 0 beyond ``half`` m of it; twice differentiable."""
    return np.asarray(np.maximum(1 - ((height - centre) / half) ** 2, 0.0) ** 3)


def bump(centre: npt.ArrayLike, radii: npt.ArrayLike, height: float) -> Field:
    """A swelling of ``height`` m along the normals around ``centre``."""
    return lambda p, n: height * window(p, centre, radii)[:, None] * n


def trunk_bump(centre: npt.ArrayLike, radii: npt.ArrayLike, height: float) -> Field:
    """The same, arms left out."""
    whole = bump(centre, radii, height)
    return lambda p, n: (1 - arm_part(left(p)))[:, None] * whole(p, n)


def shift(centre: npt.ArrayLike, radii: npt.ArrayLike, by: npt.ArrayLike) -> Field:
    """The skin around ``centre`` moved ``by`` (3,) m."""
    return lambda p, _: window(p, centre, radii)[:, None] * np.asarray(by)


def widened(centre: float, half: float, by: tuple[float, float], axis_y: float = 0.0) -> Field:
    """A band of heights scaled about the vertical axis x = 0, y = ``axis_y`` by 1 + ``by`` (2,)."""

    def field(p: Floats, _: Floats) -> Floats:
        w = band(p[:, 2], centre, half) * (1 - arm_part(left(p)))
        return np.stack([by[0] * p[:, 0] * w, by[1] * (p[:, 1] - axis_y) * w, 0 * w], axis=1)

    return field
