"""Skin moved along itself, so that its landmarks lie where they were given.

Distances to a scan say little of movements along the skin, so a fit leaves them to bones and
shapes. What these leave of the steps to landmarks is closed by a smooth field u on the skin at
rest, the mean of a Gaussian process given the steps d with their noise, after which each vertex
returns to the skin:

    u(x) = k(x, X) (k(X, X) + σ²)⁻¹ d,   k(x, y) = s² ((1 − ρ/2) g(x − y) ± ρ/2 g(x − M y))

with a Gaussian g and the mirror M: bodies differ on both sides alike, so the across component of
the mirrored part (−) changes its sign. The surface stays where it is, and so does its rim.

Source: Rasmussen, Williams (2006), Gaussian Processes for Machine Learning, eq. 2.25.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import lru_cache

import numpy as np
import numpy.typing as npt

from supple.registration.posture import Posture
from supple.registration.rest_landmarks import at_rest, grown
from supple.registration.skin import edges, free_edges
from supple.registration.template import Floats, Template
from supple.surface import Surface, area_vectors

#: s and the length of g, m; and the share ρ of the field that both sides have in common.
_SIZE, _LENGTH, _COMMON = 12e-3, 80e-3, 0.8
_MIRROR = np.array([-1.0, 1.0, 1.0])
#: m from the rim, over which skin comes free.
_RIM = 50e-3
#: No triangle may shrink below this share, or turn over; rounds in which that is mended.
_LEAST, _ROUNDS = 0.1, 8
#: m; vertices that move less stay.
_STILL = 1e-4


def slide(
    template: Template, posture: Posture, points: Floats, offset: Floats,
    marks: Mapping[str, Floats], sd: float,
) -> Floats:  # fmt: skip
    """By what the vertices (n, 3) m move along the skin; 0 if it cannot but fold.

    Args:
        points: (n, 3) m of the skin.
        offset: (n, 3) m of them, by which they are off what ``posture`` makes of the template.
        marks: name → (3,) m, where landmarks are to be.
        sd: m, how well that is known, along each axis.
    """
    if not marks:
        return np.zeros_like(points)
    skin = at_rest(template, posture, offset)
    at, posed = template.landmark_points(skin), template.landmark_points(points)
    turns = _turns(template, posture, list(marks))
    steps = np.array([R.T @ (place - posed[name])
                      for R, (name, place) in zip(turns, marks.items(), strict=True)])  # fmt: skip
    places = np.array([at[name] for name in marks])
    moved = field(skin, places, steps, sd)
    return _along(template, skin, moved * _free(template)[:, None], points)


def _along(template: Template, skin: Floats, moved: Floats, points: Floats) -> Floats:
    """The step (n, 3) m of ``points`` to where ``skin`` moved by ``moved`` returns to itself.

    Vertices of triangles that would turn over, in a crease at rest or in one of the pose alone,
    move less, and so do those around.
    """
    home = Surface(skin, template.triangles)
    asked = np.flatnonzero((moved**2).sum(axis=1) > _STILL**2)
    step, at_home = np.zeros_like(points), skin.copy()
    for _ in range(_ROUNDS):
        hit = home.closest(skin[asked] + moved[asked])
        corners, shares = template.triangles[hit.triangle], np.asarray(hit.barycentric)
        at_home[asked] = np.einsum("kc,kcd->kd", shares, skin[corners])
        step[asked] = np.einsum("kc,kcd->kd", shares, points[corners]) - points[asked]
        over = _over(template.triangles, skin, at_home)
        over |= _over(template.triangles, points, points + step)
        if not over.any():
            return step
        asked = np.flatnonzero(grown(template, over))
        moved[asked] *= 0.5
    return np.zeros_like(points)


def _over(
    triangles: npt.NDArray[np.int64], skin: Floats, moved: Floats
) -> npt.NDArray[np.bool_]:  # fmt: skip
    """Vertices (n,) of triangles of ``skin`` (n, 3) m that turn over or vanish once moved."""
    before, after = (area_vectors(points, triangles) for points in (skin, moved))
    gone = (before * after).sum(axis=1) < _LEAST * (before**2).sum(axis=1)
    over = np.zeros(len(skin), dtype=bool)
    over[triangles[gone]] = True
    return over


@lru_cache(maxsize=16)
def _free(template: Template) -> Floats:
    """(n,) how freely vertices move along the skin: 0 at its rim, 1 away from it."""
    faces = template.triangles
    rim = template.points[np.unique(edges(faces)[free_edges(faces)])]
    if not len(rim):
        return np.ones(len(template.points))
    apart = ((template.points[:, None] - rim) ** 2).sum(axis=2).min(axis=1)
    return np.asarray(1 - np.exp(-apart / (2 * (_RIM / 2) ** 2)))


def field(points: Floats, places: Floats, steps: Floats, sd: float) -> Floats:
    """The likeliest smooth displacement (n, 3) m at ``points`` (n, 3) m of a body at rest.

    Args:
        places: (k, 3) m, where it is known.
        steps: (k, 3) m, what it is there.
        sd: m, standard deviation of that.
    """
    moved = np.empty_like(points)
    (own, image), (near, far) = _kernels(places, places), _kernels(points, places)
    for axis, sign in enumerate(_MIRROR):
        known = own + sign * image + sd**2 * np.eye(len(places))
        moved[:, axis] = (near + sign * far) @ np.linalg.solve(known, steps[:, axis])
    return moved


def _kernels(points: Floats, places: Floats) -> tuple[Floats, Floats]:
    """Covariances (n, k) m² of the field between points of one side, and with the mirror's."""

    def near(others: Floats) -> Floats:
        apart = ((points[:, None] - others) ** 2).sum(axis=2)
        return np.asarray(_SIZE**2 * np.exp(-apart / (2 * _LENGTH**2)))

    return (1 - _COMMON / 2) * near(places), _COMMON / 2 * near(places * _MIRROR)


def _turns(template: Template, posture: Posture, names: list[str]) -> Floats:
    """(k, 3, 3), what turns the skin at landmarks from rest."""
    parts = [template.landmarks[name] for name in names]
    corners = template.triangles[[int(part.triangle[0]) for part in parts]]
    shares = np.array([part.barycentric[0] for part in parts])
    weights = np.einsum("kc,kcb->kb", shares, template.weights[corners])
    return np.asarray(np.tensordot(weights, posture.rotations, axes=1))
