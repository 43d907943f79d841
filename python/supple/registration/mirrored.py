"""How unlike two breasts are: each one's skin, mirrored in the midline, against the other side."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from supple.registration.breast_patch import BreastPatch
from supple.registration.template import Template

Floats = npt.NDArray[np.float64]
Ints = npt.NDArray[np.int64]


@dataclass(frozen=True, eq=False, repr=False)
class _Pairs:
    """Points of one breast, what they lie on when mirrored, and which way they are off it."""

    patch: BreastPatch
    corners: Ints  # (q, 3) vertices of the template that each point lands between
    weights: Floats  # (q, 3)
    away: Floats  # (q, 3) unit
    share: Floats  # (q,) of the area


class Mirrored:
    """The root mean square distance, at any vertices near ``points`` (n, 3) m."""

    def __init__(self, template: Template, points: Floats, patches: list[BreastPatch]) -> None:
        self._template, self._points, self._patches = template, points, patches
        self._pairs: list[_Pairs] | None = None

    def ask(self, at: Floats, left: Floats, middle: Floats) -> Floats:
        """(s,) m, at vertices (s, n, 3) m; ``left`` (s, 3) and ``middle`` (s, 3) are the midline's.

        The pairs are those of the first call's first vertices.
        """
        if self._pairs is None:
            self._pairs = [self._paired(patch, at[0], left[0], middle[0])
                           for patch in self._patches]  # fmt: skip
        squares: Floats = np.zeros(len(at))
        for pairs in self._pairs:
            mirrored = _reflected(pairs.patch.skin_points(at), left, middle)
            on = np.einsum("qc,sqcd->sqd", pairs.weights, at[:, pairs.corners])
            off = np.einsum("sqd,qd->sq", mirrored - on, pairs.away)
            squares = squares + off**2 @ pairs.share / 2
        return np.asarray(np.sqrt(squares))

    def _paired(self, patch: BreastPatch, at: Floats, left: Floats, middle: Floats) -> _Pairs:
        from supple.surface import Surface

        skin = patch.skin_points(at)
        mirrored = _reflected(skin[None], left[None], middle[None])[0]
        landed = Surface(at, self._template.triangles).closest(mirrored)
        off = mirrored - landed.point
        far = landed.distance[:, None] > 1e-9
        away = np.where(far, off / np.where(far, landed.distance[:, None], 1), landed.normal)
        corners = self._template.triangles[landed.triangle]
        return _Pairs(patch, corners, landed.barycentric, away, _areas(skin, patch.cut.triangles))


def _reflected(points: Floats, normal: Floats, middle: Floats) -> Floats:
    """Points (s, q, 3) mirrored in the planes through ``middle`` across ``normal`` (s, 3)."""
    off = np.einsum("sqd,sd->sq", points - middle[:, None], normal)
    return np.asarray(points - 2 * off[..., None] * normal[:, None])


def _areas(points: Floats, triangles: Ints) -> Floats:
    """(q,) share of the area that belongs to each point."""
    a, b, c = (points[triangles[:, k]] for k in range(3))
    area = np.linalg.norm(np.cross(b - a, c - a), axis=1)
    own = np.bincount(triangles.ravel(), np.repeat(area, 3), len(points))
    return np.asarray(own / own.sum())
