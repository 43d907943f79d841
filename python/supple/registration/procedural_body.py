"""The procedural torso as a closed form: a level set that is negative inside; its normals.

Proportions lie amid those of MakeHuman's average young woman (CC0), the Visible Human female and
the mean of the 110 torsos of iRBSM, each brought to one size and pose by a registration; sizes are
near the 2012 survey of Gordon et al. (ANSUR II, Natick/TR-15/007) and Al-Qattan et al. (2019),
Plast. Reconstr. Surg. Glob. Open 7, e2326 (nipples 20 cm apart, folds 8 cm below them). The height
z = 0 is 2 cm above the nipples.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

if TYPE_CHECKING:
    from scipy.interpolate import CubicSpline

Floats = npt.NDArray[np.float64]

#: Trunk: height, half breadth, front, back (m), exponent of the superellipse.
_TRUNK = np.array([
    (-0.40, 0.188, -0.099, 0.134, 2.3),
    (-0.31, 0.176, -0.108, 0.118, 2.3),
    (-0.23, 0.149, -0.112, 0.090, 2.3),
    (-0.15, 0.132, -0.116, 0.077, 2.4),
    (-0.08, 0.135, -0.112, 0.088, 2.45),
    (0.00, 0.141, -0.103, 0.101, 2.5),
    (0.07, 0.136, -0.075, 0.103, 2.5),
    (0.12, 0.122, -0.044, 0.096, 2.45),
    (0.16, 0.094, -0.012, 0.087, 2.2),
    (0.20, 0.060, 0.002, 0.070, 2.0),
    (0.26, 0.040, 0.000, 0.040, 2.0),
])  # fmt: skip

SHOULDER = np.array([0.160, 0.029, 0.101])  #: centre of the left humeral head, m
ARM = np.array([0.62, 0.02, -0.78]) / np.linalg.norm([0.62, 0.02, -0.78])  #: along the left arm
NECK = np.array([0.0, 0.040, 0.150])  #: base of the neck, m
NECK_AXIS = np.array([0.0, -0.29, 0.957]) / np.linalg.norm([0.29, 0.957])
BREAST = np.array([0.081, -0.089, -0.013])  #: centre of the left breast's base, m
_OUT = np.radians(17.0)  # by which breasts look to the side
BREAST_AXES = np.array([
    (np.cos(_OUT), np.sin(_OUT), 0.0),
    (0.0, 0.0, 1.0),
    (np.sin(_OUT), -np.cos(_OUT), 0.0),
])  #: rows: to the side, up, to the front of the left breast  # fmt: skip
NIPPLE = np.array([0.0080, -0.0090, 0.0540])  #: in the breast's axes, m

#: Ends (m) and radii (m) of the cones along collar bone, trapezius, neck, pectoral and upper arm.
_COLLAR = ((0.022, 0.034, 0.122), (0.146, 0.031, 0.102), 0.045, 0.042)
_TRAPEZIUS = ((0.011, 0.055, 0.191), (0.147, 0.044, 0.108), 0.028, 0.032)
_NECK = ((0.0, 0.031, 0.119), (0.0, -0.053, 0.388), 0.049, 0.0485)
_PECTORAL = ((0.109, -0.031, 0.078), (0.185, -0.001, 0.071), 0.030, 0.032)
_UPPER_ARM = (0.047, 0.041)
_DELTOID = (0.047, 0.053, 0.085)  # half axes, m
#: Middles and half axes of the breast's lower pole and of its upper slope, in its axes, m.
_POLE = ((0.002, -0.009, 0.001), (0.058, 0.051, 0.051))
_SLOPE = ((-0.002, 0.023, -0.034), (0.058, 0.070, 0.045))


def level(points: Floats) -> Floats:
    """Nearly the signed distance (n,) m of ``points`` (n, 3) m to the skin, cuts left out."""
    p = np.stack([np.hypot(points[:, 0], 0.006), points[:, 1], points[:, 2]], axis=1)
    body = smooth_min(trunk(p), shoulder_girdle(p), 0.05)
    body = smooth_min(body, neck(p), 0.035)
    # the armpit is a narrow cleft, the front of the shoulder a soft hollow
    softness = 0.024 + 0.016 / (1 + np.exp(-(p[:, 2] - 0.072) / 0.010))
    body = smooth_min(body, arm(p), softness)
    body = smooth_min(body, pectoral(p), 0.030)
    return smooth_min(body, *breast(p))


def slope(points: Floats, step: float = 1e-5) -> Floats:
    """Gradient (n, 3) of the level set at ``points`` (n, 3) m, by central differences."""
    moves = step * np.eye(3)
    ahead, behind = (level((points + way * moves[:, None]).reshape(-1, 3)) for way in (1, -1))
    return np.asarray(((ahead - behind) / (2 * step)).reshape(3, -1).T)


def normals(points: Floats) -> Floats:
    """Unit outward normals (n, 3) at ``points`` (n, 3) m."""
    g = slope(points)
    return np.asarray(g / np.linalg.norm(g, axis=1, keepdims=True))


def met(start: Floats, way: Floats, surface: Callable[[Floats], Floats] | None = None) -> Floats:
    """Where rays from ``start`` (n, 3) m outside along unit ``way`` meet the skin first, (n, 3) m.

    By sphere tracing, for the level set's slope is near 1.
    """
    at = start.copy()
    for _ in range(40):
        at += 0.8 * (surface or level)(at)[:, None] * way
    return at


def smooth_min(a: Floats, b: Floats, width: Floats | float) -> Floats:
    """The lesser of both, twice differentiable where they are within ``width`` of each other."""
    near = np.maximum(width - np.abs(a - b), 0.0) / width
    return np.asarray(np.minimum(a, b) - near**3 * (width / 6))


def trunk(p: Floats) -> Floats:
    """Superelliptic cross sections along the height, with the furrows of spine and sternum."""
    breadth, front, back, power = _profile()(np.clip(p[:, 2], *_TRUNK[[0, -1], 0])).T
    depth, y = (back - front) / 2, p[:, 1] - (back + front) / 2
    power_sum = (np.abs(p[:, 0]) / breadth) ** power + np.abs(y / depth) ** power + 1e-12
    outside = power_sum ** (1 / power) - 1
    return np.asarray(outside * np.minimum(breadth, depth) + _furrows(p))


def _furrows(p: Floats) -> Floats:
    behind = 1 / (1 + np.exp(-(p[:, 1] - 0.02) / 0.015))
    spine = 0.012 * np.exp(-((p[:, 0] / 0.028) ** 2)) * np.exp(-(((p[:, 2] + 0.07) / 0.15) ** 4))
    sternum = 0.003 * np.exp(-((p[:, 0] / 0.03) ** 2)) * np.exp(-(((p[:, 2] - 0.03) / 0.09) ** 4))
    return np.asarray(spine * behind + sternum * (1 - behind))


@cache
def _profile() -> CubicSpline:
    from scipy.interpolate import CubicSpline

    return CubicSpline(_TRUNK[:, 0], _TRUNK[:, 1:])


def shoulder_girdle(p: Floats) -> Floats:
    """From the neck's base over the clavicle and the trapezius to the acromion."""
    return smooth_min(cone(p, *_COLLAR), cone(p, *_TRAPEZIUS), 0.04)


def neck(p: Floats) -> Floats:
    """A slightly flat, forward-leaning cylinder."""
    return cone(p, *_NECK)


def arm(p: Floats) -> Floats:
    """Deltoid and upper arm, |x| taken."""
    upper = cone(p, tuple(SHOULDER), tuple(SHOULDER + 0.30 * ARM), *_UPPER_ARM)
    deltoid = ellipsoid(p - (SHOULDER + 0.040 * ARM), _DELTOID)
    return smooth_min(upper, deltoid, 0.015)


def pectoral(p: Floats) -> Floats:
    """The muscle's edge from chest to arm, which makes the fold before the armpit."""
    return cone(p, *_PECTORAL)


def breast(p: Floats) -> tuple[Floats, Floats]:
    """A full lower pole, a flatter slope above, areola and nipple; how softly it joins the chest.

    The lower fold is sharp; above, the breast fades into the chest.
    """
    q = (p - BREAST) @ BREAST_AXES.T
    pole, slope = (ellipsoid(q - middle, radii) for middle, radii in (_POLE, _SLOPE))
    mound = smooth_min(pole, slope, 0.05)
    areola = ellipsoid(q - NIPPLE + (0.0, 0.0, 0.006), (0.016, 0.016, 0.006))
    nipple = np.linalg.norm(q - NIPPLE + (0.0, 0.0, 0.003), axis=1) - 0.0055
    softness = 0.015 + 0.044 / (1 + np.exp(-(q[:, 1] - 0.020) / 0.018))
    return smooth_min(smooth_min(mound, areola, 0.008), nipple, 0.006), softness


def nipple() -> Floats:
    """The tip (3,) m of the left one."""
    before = NIPPLE * (1.0, 1.0, 0.0) + (0.0, 0.0, 0.1)
    return np.asarray(met((BREAST + before @ BREAST_AXES)[None], -BREAST_AXES[2])[0])


def cone(p: Floats, a: tuple[float, ...], b: tuple[float, ...], ra: float, rb: float) -> Floats:
    """Distance to a segment from ``a`` to ``b`` less a radius that goes from ``ra`` to ``rb``."""
    along = np.subtract(b, a)
    s = np.clip((p - a) @ along / (along @ along), 0, 1)
    return np.asarray(np.linalg.norm(p - a - s[:, None] * along, axis=1) - ra - s * (rb - ra))


def ellipsoid(p: Floats, radii: tuple[float, ...]) -> Floats:
    """Nearly the distance to an ellipsoid at the origin; exact to first order at its surface."""
    r = np.asarray(radii)
    scaled = np.linalg.norm(p / r, axis=1)
    return np.asarray(scaled * (scaled - 1) / (np.linalg.norm(p / r**2, axis=1) + 1e-9))
