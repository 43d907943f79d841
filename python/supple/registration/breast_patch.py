"""The breast on a template: the skin inside of its outline, and a chest wall stretched behind it.

    outline ─► signed distance of the vertices ─► triangles cut along its zero ─► skin of the breast
    skin around the outline ─► thin plate ─► soap film from it to the outline ─► chest wall

Every point is a fixed weighted mean of the template's vertices, so that measures of a patch are
smooth in the posture.

The chest wall is not seen by a scan. Here it is the thin plate (Duchon 1977) that continues the
skin around the breast behind it, over the outline's plane, plus the soap film (harmonic) that
closes the gap along the outline. Without skin around, that is the minimal surface of the outline.
Others put a Coons patch there (Choppin et al. 2013, doi 10.15221/13.012) or a statistical shape of
the thorax (Göpper et al. 2020, doi 10.1371/journal.pone.0233586).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from supple.registration.outline import Cut, cut_along
from supple.registration.skin import edges, vertex_normals
from supple.registration.template import Template

Floats = npt.NDArray[np.float64]
Ints = npt.NDArray[np.int64]

#: Distance (m) from the outline of the skin that the chest wall continues: beyond the flank of
#: the breast, not yet on the belly or the arm.
AROUND = (12e-3, 45e-3)
SIDES = ("left", "right")
#: Least cosine of the angle between that skin and the outline's plane.
_FACING = 0.3
#: Of the thin plate: fewer points do not hold it, and how much of their noise it leaves out.
_LEAST, _SMOOTHING = 12, 1e-4


@dataclass(frozen=True, eq=False, repr=False)
class BreastPatch:
    """The skin of a breast and the chest wall behind it.

    Attributes:
        side: "left" or "right".
        cut: the skin inside of the outline.
        support: (s,) vertices of the template that hold the chest wall besides the outline.
        wall: (i, b + s) what each inner point of the wall is made of: outline, then support.
        inner: (i,) points of the cut that are not on the outline.
    """

    side: str
    cut: Cut
    support: Ints
    wall: Floats
    inner: Ints

    def skin_points(self, vertices: Floats) -> Floats:
        """The skin (…, q, 3) m with the template's vertices at (…, n, 3) m."""
        return self.cut.at(vertices)

    def wall_points(self, vertices: Floats) -> Floats:
        """The chest wall (…, q, 3) m, point by point behind the skin, equal on the outline."""
        points = self.cut.at(vertices)
        rim = points[..., self.cut.rim, :]
        held = np.concatenate([rim, vertices[..., self.support, :]], axis=-2)
        points[..., self.inner, :] = self.wall @ held
        return points


def breast_patch(template: Template, side: str) -> BreastPatch:
    """The patch of the curve ``breast_left`` or ``breast_right``.

    Raises:
        MeshError: the curve does not go once around that nipple.
    """
    cut = cut_along(template, f"breast_{side}", f"nipple_{side}")
    support = around(template, cut, [side])
    inner, wall = stretched(template, cut, support)
    return BreastPatch(side, cut, support, wall, inner)


def stretched(template: Template, cut: Cut, support: Ints) -> tuple[Ints, Floats]:
    """Inner points (i,) of a cut, and weights (i, b + s) that put a wall behind them.

    The weights are of the rim's points and of the ``support`` (s,), vertices of the template.
    """
    at = cut.at(template.points)
    normal, centre = base_plane(at[cut.rim])
    flatten = _axes(normal).T
    inner = np.setdiff1d(np.arange(len(at)), cut.rim)
    film = _soap_film(cut, inner)
    rim = (at[cut.rim] - centre) @ flatten
    held = (template.points[support] - centre) @ flatten
    plate = _thin_plate(held, np.vstack([rim, film @ rim]))
    on_rim, behind = plate[: len(rim)], plate[len(rim) :]
    return inner, np.hstack([film, behind - film @ on_rim])


def base_plane(rim: Floats) -> tuple[Floats, Floats]:
    """Unit normal (…, 3) of loops (…, b, 3), towards whom they run anticlockwise; centres (…, 3).

    The normal is that of the loop's vector area, the centre the mean along it.
    """
    following = np.roll(rim, -1, axis=-2)
    steps = np.linalg.norm(following - rim, axis=-1, keepdims=True)
    centre = ((rim + following) / 2 * steps).sum(axis=-2) / steps.sum(axis=-2)
    away = rim - centre[..., None, :]
    area = np.cross(away, np.roll(away, -1, axis=-2)).sum(axis=-2)
    return area / np.linalg.norm(area, axis=-1, keepdims=True), centre


def volumes(patch: BreastPatch, vertices: Floats) -> Floats:
    """Between skin and chest wall, (…) m³, with the template's vertices at (…, n, 3) m."""
    skin, wall = patch.skin_points(vertices), patch.wall_points(vertices)
    origin = skin.mean(axis=-2, keepdims=True)  # near, so that little cancels
    triangles = patch.cut.triangles
    return _cone(skin - origin, triangles) - _cone(wall - origin, triangles)


def _cone(points: Floats, triangles: Ints) -> Floats:
    a, b, c = (points[..., triangles[:, k], :] for k in range(3))
    return np.asarray(np.einsum("...td,...td->...", np.cross(a, b), c) / 6)


def _axes(normal: Floats) -> Floats:
    """Two unit vectors (2, 3) across ``normal`` (3,)."""
    least = np.eye(3)[np.abs(normal).argmin()]
    u = np.cross(normal, least)
    u /= np.linalg.norm(u)
    return np.stack([u, np.cross(normal, u)])


def around(template: Template, cut: Cut, sides: Sequence[str] = SIDES) -> Ints:
    """Vertices beside outlines, of the trunk, that face as the cut does, outside of both breasts.

    Args:
        sides: of the outlines; AROUND is the distance from them.
    """
    distance = {side: cut_along(template, f"breast_{side}", f"nipple_{side}").distance
                for side in SIDES}  # fmt: skip
    nearest = np.min([distance[side] for side in sides], axis=0)
    chosen = (nearest > AROUND[0]) & (nearest < AROUND[1])
    chosen &= np.min(list(distance.values()), axis=0) > AROUND[0] / 2
    for part in ("arm_left", "arm_right", "neck"):
        chosen &= ~template.regions[part]
    normal, _ = base_plane(cut.at(template.points)[cut.rim])
    facing = vertex_normals(template.points, template.triangles) @ normal > _FACING
    return np.flatnonzero(chosen & facing)


def _soap_film(cut: Cut, inner: Ints) -> Floats:
    """Weights (i, b) that make each inner point the mean of its neighbours; Tutte (1963)."""
    from scipy.sparse import coo_array, diags_array
    from scipy.sparse.linalg import spsolve

    ends = np.unique(np.sort(edges(cut.triangles).reshape(-1, 2), axis=1), axis=0)
    both, q = np.vstack([ends, ends[:, ::-1]]), len(cut.corners)
    graph = coo_array((np.ones(len(both)), both.T), shape=(q, q)).tocsr()
    laplacian = (diags_array(np.asarray(graph.sum(axis=1)).ravel()) - graph).tocsc()
    to_rim = -laplacian[inner][:, cut.rim].toarray()
    return np.asarray(spsolve(laplacian[inner][:, inner].tocsc(), to_rim)).reshape(to_rim.shape)


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
