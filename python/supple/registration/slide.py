"""Skin moved along itself, so that its landmarks lie where they are known to be.

Distances to a scan say little of movements along the skin, so a fit leaves them to its shapes. What
these leave of the steps to landmarks is closed by a smooth field u on the skin at rest, the mean of
a Gaussian process given the steps d with their noise, after which each vertex returns to the skin:

    u(x) = k(x, X) (k(X, X) + σ²)⁻¹ d,   k(x, y) = s² ((1 − ρ/2) g(x − y) ± ρ/2 g(x − M y))

with a Gaussian g and the mirror M: bodies differ on both sides alike, so the across component of
the mirrored part (−) changes its sign. The surface stays where it is.

Source: Rasmussen, Williams (2006), Gaussian Processes for Machine Learning, eq. 2.25.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from supple.registration.posture import Posture
from supple.registration.rest_landmarks import at_rest
from supple.registration.template import Floats, Template
from supple.surface import Surface

#: s and the length of g, m; and the share ρ of the field that both sides have in common.
_SIZE, _LENGTH, _COMMON = 12e-3, 80e-3, 0.8
_MIRROR = np.array([-1.0, 1.0, 1.0])


def slide(
    template: Template, posture: Posture, points: Floats, offset: Floats,
    marks: Mapping[str, Floats], sds: Mapping[str, float],
) -> Floats:  # fmt: skip
    """By what the vertices (n, 3) m move along the skin.

    Args:
        points: (n, 3) m of the skin.
        offset: (n, 3) m of them, by which they are off what ``posture`` makes of the template.
        marks: name → (3,) m, where landmarks are to be.
        sds: name → m, how well that is known.
    """
    if not marks:
        return np.zeros_like(points)
    skin = at_rest(template, posture, offset)
    at, posed = template.landmark_points(skin), template.landmark_points(points)
    turns = _turns(template, posture, list(marks))
    steps = np.array([R.T @ (place - posed[name])
                      for R, (name, place) in zip(turns, marks.items(), strict=True)])  # fmt: skip
    places = np.array([at[name] for name in marks])
    wanted = skin + field(skin, places, steps, np.array([sds[name] for name in marks]))
    hit = Surface(skin, template.triangles).closest(wanted)
    corners = points[template.triangles[hit.triangle]]
    return np.asarray(np.einsum("kc,kcd->kd", hit.barycentric, corners) - points)


def field(points: Floats, places: Floats, steps: Floats, sds: Floats) -> Floats:
    """The likeliest smooth displacement (n, 3) m at ``points`` (n, 3) m of a body at rest.

    Args:
        places: (k, 3) m, where it is known.
        steps: (k, 3) m, what it is there.
        sds: (k,) m, standard deviations of that.
    """
    moved = np.empty_like(points)
    (own, image), (near, far) = _kernels(places, places), _kernels(points, places)
    for axis, sign in enumerate(_MIRROR):
        known = own + sign * image + np.diag(sds**2)
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
