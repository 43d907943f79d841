"""The breast on a template: the skin inside of its outline, and a chest wall stretched behind it.

    outline ─► signed distance of the vertices ─► triangles cut along its zero ─► skin of the breast
    outline ─► soap film over its plane ─► chest wall, closed with the skin at the outline

Every point is a fixed weighted mean of the template's vertices, so that measures of a patch are
smooth in the posture.

The chest wall is not seen by a scan. Here it is the soap film of the outline, that is, the harmonic
function over the outline's plane: the minimal surface where it is shallow. A chest that is curved
there by 1 / R stands in front of it, so that a breast of base radius a is found π a⁴ / (8 R) too
large; an outline drawn on the mound makes it too small. Others put a Coons patch there (Choppin et
al. 2013, doi 10.15221/13.012, 30 % too large on prostheses) or a statistical shape of the thorax
(Göpper et al. 2020, doi 10.1371/journal.pone.0233586).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from supple.registration.outline import Cut, cut_along
from supple.registration.template import Template

Floats = npt.NDArray[np.float64]
Ints = npt.NDArray[np.int64]

SIDES = ("left", "right")


@dataclass(frozen=True, eq=False, repr=False)
class BreastPatch:
    """The skin of a breast and the chest wall behind it.

    Attributes:
        side: "left" or "right".
        cut: the skin inside of the outline.
        wall: (i, b) what each inner point of the wall is made of: points of the outline.
        inner: (i,) points of the cut that are not on the outline.
    """

    side: str
    cut: Cut
    wall: Floats
    inner: Ints

    def skin_points(self, vertices: Floats) -> Floats:
        """The skin (…, q, 3) m with the template's vertices at (…, n, 3) m."""
        return self.cut.at(vertices)

    def wall_points(self, vertices: Floats) -> Floats:
        """The chest wall (…, q, 3) m, point by point behind the skin, equal on the outline."""
        points = self.cut.at(vertices)
        points[..., self.inner, :] = self.wall @ points[..., self.cut.rim, :]
        return points


def breast_patch(template: Template, side: str) -> BreastPatch:
    """The patch of the curve ``breast_left`` or ``breast_right``.

    Raises:
        MeshError: the curve does not go once around that nipple.
    """
    cut = cut_along(template, f"breast_{side}", f"nipple_{side}")
    inner = np.setdiff1d(np.arange(len(cut.corners)), cut.rim)
    at = cut.at(template.points)
    normal, centre = base_plane(at[cut.rim])
    flat = np.zeros((len(at), 2))
    flat[cut.rim] = (at[cut.rim] - centre) @ plane_axes(normal).T
    flat[inner] = soap_film(cut, inner) @ flat[cut.rim]
    return BreastPatch(side, cut, soap_film(cut, inner, flat), inner)


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


def plane_axes(normal: Floats) -> Floats:
    """Two unit vectors (2, 3) across ``normal`` (3,)."""
    least = np.eye(3)[np.abs(normal).argmin()]
    u = np.cross(normal, least)
    u /= np.linalg.norm(u)
    return np.stack([u, np.cross(normal, u)])


def soap_film(cut: Cut, inner: Ints, flat: Floats | None = None) -> Floats:
    """Weights (i, b) of the rim that stretch a film over it.

    Without ``flat`` each inner point is the mean of its neighbours (Tutte 1963). With it, places
    (q, 2) of all points in a plane, the film is harmonic there: the cotangent weights of Pinkall &
    Polthier (1993), Experiment. Math. 2, 15–36.
    """
    from scipy.sparse import coo_array, diags_array
    from scipy.sparse.linalg import spsolve

    q, (a, b, c) = len(cut.corners), cut.triangles.T
    ends, weights = np.vstack([np.stack(pair, 1) for pair in ((a, b), (b, c), (c, a))]), None
    if flat is None:
        ends = np.unique(np.sort(ends, axis=1), axis=0)
        weights = np.ones(len(ends))
    else:
        weights = np.concatenate([_cotangent(flat, *k) for k in ((a, b, c), (b, c, a), (c, a, b))])
    rows, columns = np.vstack([ends, ends[:, ::-1]]).T
    graph = coo_array((np.tile(weights, 2), (rows, columns)), shape=(q, q)).tocsr()
    laplacian = (diags_array(np.asarray(graph.sum(axis=1)).ravel()) - graph).tocsc()
    to_rim = -laplacian[inner][:, cut.rim].toarray()
    return np.asarray(spsolve(laplacian[inner][:, inner].tocsc(), to_rim)).reshape(to_rim.shape)


def _cotangent(flat: Floats, a: Ints, b: Ints, c: Ints) -> Floats:
    """Of the angles (t,) at the corners c of flat triangles."""
    u, v = flat[a] - flat[c], flat[b] - flat[c]
    return np.asarray((u * v).sum(axis=1) / (u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0]))
