"""Bones of the procedural torso: joints, and weights as closed forms of the place."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from supple.registration import procedural_body as body
from supple.registration.template import BONES, Bone

Floats = npt.NDArray[np.float64]

#: Joints of the midline and of the left, m.
_JOINTS = {
    "abdomen": (0.0, 0.045, -0.24),
    "chest": (0.0, 0.040, -0.11),
    "neck": (0.0, 0.055, 0.165),
    "shoulder": (0.025, -0.025, 0.135),
    "arm": tuple(body.SHOULDER.tolist()),
    "breast": tuple(body.BREAST.tolist()),
}
#: The breast's base: middle and half axes, m, to the side and up, in its axes.
BASE, BASE_RADII = np.array([0.002, 0.010]), np.array([0.064, 0.072])

#: m; the arm takes the skin of the chest along, for pectoralis and dorsi end on it.
_SKIN = (0.074, 0.115)


def bones() -> tuple[Bone, ...]:
    """The nine, parents before children."""
    return tuple(Bone(name, parent, _joint(name)) for name, parent in BONES)


def _joint(name: str) -> tuple[float, float, float]:
    x, y, z = _JOINTS[name.split("_")[0]]
    return (-x if name.endswith("_right") else x, y, z)


def weights(points: Floats) -> Floats:
    """(n, 9) of the bones at ``points`` (n, 3) m: ≥ 0, rows sum to 1, smooth in the place."""
    p = left(points)
    arm, rest = _split(np.ones(len(p)), arm_part(p, *_SKIN))
    girdle = smooth((p[:, 0] - 0.045) / 0.09) * smooth((p[:, 2] - 0.04) / 0.10)
    shoulder, rest = _split(rest, girdle)
    neck, rest = _split(rest, smooth(((p - body.NECK) @ body.NECK_AXIS + 0.005) / 0.08))
    breast, rest = _split(rest, smooth((1.28 - breast_radius(p)) / 1.10))
    chest, abdomen = _split(rest, smooth((p[:, 2] + 0.18) / 0.15))
    parts = {"arm": arm, "shoulder": shoulder, "neck": neck, "breast": breast, "chest": chest,
             "abdomen": abdomen}  # fmt: skip
    whole = sum(parts.values())  # 1 but for rounding, which must not differ between the sides
    return np.stack(
        [parts[name.split("_")[0]] / whole * _on_side(name, points) for name, _ in BONES], axis=1
    )


def _split(whole: Floats, share: Floats) -> tuple[Floats, Floats]:
    return whole * share, whole * (1 - share)


def _on_side(name: str, points: Floats) -> Floats:
    """1 on the bone's own side, 0 on the other, ½ on the midline."""
    sign = {"left": 1, "right": -1}.get(name.split("_")[-1], 0)
    return np.asarray(np.heaviside(sign * points[:, 0], 0.5) if sign else np.ones(len(points)))


def left(points: Floats) -> Floats:
    """``points`` (n, 3), those on the right mirrored to the left."""
    return np.stack([np.abs(points[:, 0]), points[:, 1], points[:, 2]], axis=1)


def smooth(t: Floats) -> Floats:
    """From 0 at t ≤ 0 to 1 at t ≥ 1, twice differentiable (Perlin's polynomial)."""
    t = np.clip(t, 0, 1)
    return np.asarray(np.clip(t**3 * (10 - 15 * t + 6 * t**2), 0, 1))  # above 1 by rounding else


def arm_part(p: Floats, reach: float = 0.014, fade: float = 0.07) -> Floats:
    """How much (n,) each point on the left belongs to the arm: by its place along and off it.

    From ``reach`` m nearer to the trunk than to the arm on, over a way of ``fade`` m.
    """
    along = (p - body.SHOULDER) @ body.ARM
    off = body.trunk(p) - body.arm(p)
    return smooth((along + 0.05) / 0.12) * smooth((off + reach) / fade)


def breast_radius(p: Floats) -> Floats:
    """Place (n,) on the left breast: 0 at the middle of its base, 1 on its outline, 9 behind."""
    q = (p - body.BREAST) @ body.BREAST_AXES.T
    radius = np.linalg.norm((q[:, :2] - BASE) / BASE_RADII, axis=1)
    return np.asarray(np.where(q[:, 2] > -0.045, radius, 9.0))
