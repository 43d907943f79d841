"""A chest wall behind both breasts, continued from the skin around them.

skin around the outlines ─► thin plate ─► soap film from it to the rim ─► weights of the skin
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from supple.registration.breast_patch import SIDES, base_plane, plane_axes, soap_film
from supple.registration.outline import Cut, cut_along
from supple.registration.skin import vertex_normals
from supple.registration.template import Template

Floats = npt.NDArray[np.float64]
Ints = npt.NDArray[np.int64]

#: Distance (m) from the outlines of the skin that the chest wall continues: beyond the flank of
#: the breast, not yet on the belly or the arm.
AROUND = (12e-3, 45e-3)
#: Least cosine of the angle between that skin and the plane of the rim.
_FACING = 0.3
#: Of the thin plate: fewer points do not hold it, and how much of their noise it leaves out.
_LEAST, _SMOOTHING = 12, 1e-4


def stretched(template: Template, cut: Cut, support: Ints) -> tuple[Ints, Floats]:
    """Inner points (i,) of a cut, and weights (i, b + s) that put a wall behind them.

    The weights are of the rim's points and of the ``support`` (s,), vertices of the template.
    """
    at = cut.at(template.points)
    normal, centre = base_plane(at[cut.rim])
    flatten = plane_axes(normal).T
    inner = np.setdiff1d(np.arange(len(at)), cut.rim)
    film = soap_film(cut, inner)
    rim = (at[cut.rim] - centre) @ flatten
    held = (template.points[support] - centre) @ flatten
    plate = _thin_plate(held, np.vstack([rim, film @ rim]))
    on_rim, behind = plate[: len(rim)], plate[len(rim) :]
    return inner, np.hstack([film, behind - film @ on_rim])


def around(template: Template, cut: Cut) -> Ints:
    """Vertices beside outlines, of the trunk, that face as the cut does, outside of both breasts.

    AROUND is how far from them.
    """
    nearest = np.min([cut_along(template, f"breast_{side}", f"nipple_{side}").distance
                      for side in SIDES], axis=0)  # fmt: skip
    chosen = (nearest > AROUND[0]) & (nearest < AROUND[1])
    for part in ("arm_left", "arm_right", "neck"):
        chosen &= ~template.regions[part]
    normal, _ = base_plane(cut.at(template.points)[cut.rim])
    facing = vertex_normals(template.points, template.triangles) @ normal > _FACING
    return np.flatnonzero(chosen & facing)


def _thin_plate(held: Floats, wanted: Floats) -> Floats:
    """Weights (w, h): values at ``wanted`` (w, 2) of a stiff thin plate near ``held`` (h, 2).

    With too little skin to hold it, the plate is flat: weights 0, the soap film does the rest.
    Source: Duchon (1977), Splines minimizing rotation-invariant semi-norms in Sobolev spaces;
    smoothing as Wahba (1990), Spline models for observational data, eq. 2.4.9.
    """
    h = len(held)
    if h < _LEAST:
        return np.zeros((len(wanted), h))
    size = np.ptp(held, axis=0).max()
    held, wanted = held / size, wanted / size
    system = np.zeros((h + 3, h + 3))
    system[:h, :h] = _bend(held, held) + _SMOOTHING * h * np.eye(h)
    system[:h, h:] = np.column_stack([np.ones(h), held])
    system[h:, :h] = system[:h, h:].T
    rows = np.column_stack([_bend(wanted, held), np.ones(len(wanted)), wanted])
    return np.asarray(np.linalg.solve(system, rows.T)[:h].T)  # the system is symmetric


def _bend(p: Floats, q: Floats) -> Floats:
    """r² ln r² (p, q)."""
    square = ((p[:, None] - q[None]) ** 2).sum(axis=2)
    return np.asarray(square * np.log(np.where(square > 0, square, 1.0)))
