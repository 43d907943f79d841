"""Where a posed skin passes through itself: arms in the chest, a breast in an arm."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from supple.registration.template import Template
from supple.surface import Surface

Floats = npt.NDArray[np.float64]
#: Nearer to its joint, m, an arm and the body are one.
_NEAR_JOINT = 0.07
#: Contact presses skin in this far, m.
_PRESSED = 0.004


def arms_in_body(template: Template, points: Floats) -> npt.NDArray[np.bool_]:
    """Which vertices (n,) of the arms lie inside the body, when the vertices are at ``points``."""
    names = [bone.name for bone in template.bones]
    inside = np.zeros(len(points), dtype=bool)
    for side in ("left", "right"):
        arm = names.index(f"arm_{side}")
        of_arm = template.weights[:, arm]
        if f"shoulder_{side}" in names:
            of_arm = of_arm + template.weights[:, names.index(f"shoulder_{side}")]
        body = template.triangles[(of_arm[template.triangles] < 0.2).all(axis=1)]
        far = np.linalg.norm(template.points - template.joints[arm], axis=1) > _NEAR_JOINT
        free = np.flatnonzero((template.weights[:, arm] > 0.9) & far)
        inside[free] = _behind(Surface(points, body), points[free])
    return inside


def _behind(surface: Surface, points: Floats) -> npt.NDArray[np.bool_]:
    """Which ``points`` lie behind the surface beyond contact, at a face and not past its rim."""
    hit = surface.closest(points)
    depth = -np.einsum("ij,ij->i", points - hit.point, hit.normal)
    return np.asarray((depth > _PRESSED) & (depth > 0.7 * hit.distance) & (hit.distance < 0.15))
