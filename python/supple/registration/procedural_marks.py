"""Landmarks, drawn curves and regions of the procedural torso."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from supple.registration import procedural_body as body
from supple.registration.procedural_mesh import Skin
from supple.registration.procedural_rig import BASE, BASE_RADII, arm_part, breast_radius, left
from supple.registration.template import OnSurface
from supple.surface import Surface

Floats = npt.NDArray[np.float64]

NOTCH, XIPHOID = 0.142, -0.030  #: heights of the ends of the sternum, m
AXILLA = np.array([0.152, -0.012, 0.056])  #: near the left one, m


def landmarks(skin: Skin) -> dict[str, OnSurface]:
    """The twelve."""
    places = {"nipple": body.NIPPLE[None, :2], "breast_medial": _outline(np.array([np.pi])),
              "breast_lateral": _outline(np.array([0.0])),
              "breast_inferior": _outline(np.array([-np.pi / 2]))}  # fmt: skip
    at = {name: _on_breast(place) for name, place in places.items()}
    at["axilla"] = AXILLA[None]
    found = {"sternal_notch": _drawn(skin, _midline(np.array([NOTCH]))),
             "xiphoid": _drawn(skin, _midline(np.array([XIPHOID])))}  # fmt: skip
    for name, points in at.items():
        found[f"{name}_left"] = _drawn(skin, points)
        found[f"{name}_right"] = mirrored(skin, found[f"{name}_left"])
    return found


def curves(skin: Skin, count: int = 48) -> dict[str, OnSurface]:
    """Two arrows that meet on the sternum, and the outlines of the breasts, medial point first."""
    middle = (NOTCH + XIPHOID) / 2
    outline = _outline(np.pi + np.linspace(0, 2 * np.pi, count, endpoint=False))
    breast = _drawn(skin, _on_breast(outline), closed=True)
    return {"sternum_arrow_upper": _drawn(skin, _arrow(NOTCH - 0.004, middle + 0.010)),
            "sternum_arrow_lower": _drawn(skin, _arrow(XIPHOID + 0.004, middle - 0.010)),
            "breast_left": breast, "breast_right": mirrored(skin, breast)}  # fmt: skip


def regions(points: Floats) -> dict[str, npt.NDArray[np.bool_]]:
    """Masks (n,) of the parts of the skin."""
    p = left(points)
    n = body.normals(points)
    arm, breast = arm_part(p) > 0.5, breast_radius(p) < 1
    neck = ((p - body.NECK) @ body.NECK_AXIS > 0.025) & ~arm
    front = (n[:, 1] < 0) & ~arm & ~neck
    on_left, on_right = points[:, 0] > 0, points[:, 0] < 0
    sternum = front & (p[:, 0] < 0.025) & (p[:, 2] < NOTCH) & (p[:, 2] > XIPHOID)
    return {"breast_left": breast & front & on_left, "breast_right": breast & front & on_right,
            "sternum": sternum, "back": (n[:, 1] > 0.25) & (p[:, 1] > 0.02) & ~arm & ~neck,
            "abdomen": front & (p[:, 2] < -0.09), "neck": neck,
            "arm_left": arm & on_left, "arm_right": arm & on_right}  # fmt: skip


def mirrored(skin: Skin, part: OnSurface) -> OnSurface:
    """The same on the other side: triangles of the halves pair up, two of their corners swapped."""
    half = len(skin.triangles) // 2
    other = np.where(part.triangle < half, part.triangle + half, part.triangle - half)
    return OnSurface(other, part.barycentric[:, [0, 2, 1]], part.closed)


def _drawn(skin: Skin, points: Floats, closed: bool = False) -> OnSurface:
    near = Surface(skin.points, skin.triangles).closest(points)
    return OnSurface(np.asarray(near.triangle, dtype=np.int64), np.asarray(near.barycentric), closed)


def _outline(angle: Floats) -> Floats:
    """Places (k, 2) m on the base of the left breast, to the side and up, in its axes."""
    return BASE + BASE_RADII * np.stack([np.cos(angle), np.sin(angle)], axis=1)


def _on_breast(place: Floats) -> Floats:
    """Points (k, 3) m of the skin before places (k, 2) m in the left breast's axes."""
    start = body.BREAST + place @ body.BREAST_AXES[:2] + 0.10 * body.BREAST_AXES[2]
    return _shot(start, -body.BREAST_AXES[2])


def _midline(height: Floats) -> Floats:
    start = np.stack([0 * height, 0 * height - 0.2, height], axis=1)
    return _shot(start, np.array([0.0, 1.0, 0.0]))


def _arrow(start: float, tip: float) -> Floats:
    """Shaft, tip, one barb, tip, other barb: points (k, 3) m before the skin of the midline."""
    shaft = _midline(np.linspace(start, tip, 12))
    back = _midline(np.array([tip + 0.012 * np.sign(start - tip)]))[0]
    side = np.array([0.008, 0.0, 0.0])
    return np.vstack([shaft, back + side, shaft[-1], back - side])


def _shot(start: Floats, way: Floats) -> Floats:
    """Where rays from outside first meet the skin: sphere tracing, the level set ≤ 1-Lipschitz."""
    at = start.copy()
    for _ in range(60):
        at += 0.7 * body.level(at)[:, None] * way
    return at
