"""How breasts differ: blendshapes of the left one; the right one's are their mirror images."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
import numpy.typing as npt

from supple.registration import procedural_body as body
from supple.registration.procedural_fields import Field, window
from supple.registration.procedural_rig import BASE, BASE_RADII, smooth

Floats = npt.NDArray[np.float64]
_RISE = 0.055  # of the nipple over the base, m


def _in_breast(local: Callable[[Floats, Floats], Sequence[Floats | float]]) -> Field:
    """A field from displacements (u to the side, v up, w out) of ``local(q, rise)``.

    ``q`` (n, 3) m are places in the breast's axes; ``rise`` (n,) is 0 at the base, 1 at the nipple.
    """

    def field(p: Floats, _: Floats) -> Floats:
        q = (p - body.BREAST) @ body.BREAST_AXES.T
        rise = np.clip(q[:, 2] / _RISE, 0, None)
        moves = np.stack(np.broadcast_arrays(*local(q, rise), rise)[:3], axis=1)
        return np.asarray((_mound(q)[:, None] * moves) @ body.BREAST_AXES)

    return field


def _mound(q: Floats) -> Floats:
    """1 on most of the breast, 0 from 1.4 radii of its base on and behind the chest."""
    radius = np.linalg.norm((q[:, :2] - BASE) / BASE_RADII, axis=1)
    return smooth((1.4 - radius) / 0.75) * smooth((q[:, 2] + 0.05) / 0.04)


def _swell(u: float, v: float, radii: Sequence[float], height: float) -> Field:
    """A swelling along the normals about the place (u, v) m of the breast."""

    def field(p: Floats, n: Floats) -> Floats:
        q = (p - body.BREAST) @ body.BREAST_AXES.T
        flat = np.stack([q[:, 0], q[:, 1], np.minimum(q[:, 2], 0.0)], axis=1)
        return height * window(flat, (u, v, 0.0), (*radii, 0.06))[:, None] * n

    return field


BREAST_SHAPES: dict[str, Field] = {
    "breast_size_left": _in_breast(
        lambda q, r: (0.16 * q[:, 0] * r**0.5, 0.16 * q[:, 1] * r**0.5, 0.014 * r**0.8)),
    "breast_projection_left": _in_breast(lambda q, r: (0.0, 0.0, 0.012 * smooth(r / 1.2))),
    "breast_width_left": _in_breast(lambda q, _: (0.10 * q[:, 0], 0.0, 0.0)),
    "breast_height_left": _in_breast(lambda q, _: (0.0, 0.10 * q[:, 1], 0.0)),
    "breast_up_left": _in_breast(lambda q, r: (0.0, 0.010, 0.0)),
    "breast_lateral_left": _in_breast(lambda q, r: (0.008, 0.0, 0.0)),
    "breast_ptosis_left": _in_breast(
        lambda q, r: (0.0, -0.018 * r**1.5, -0.003 * r)),
    "breast_heavy_left": _in_breast(
        lambda q, r: (0.10 * q[:, 0] * r, -0.010 * r, 0.016 * r * smooth(0.5 - q[:, 1] / 0.10))
    ),
    "breast_sag_left": _in_breast(
        lambda q, r: (0.0, -0.010 * r * smooth(-q[:, 1] / 0.06), 0.004 * r)),
    "breast_turn_left": _in_breast(lambda q, r: (0.010 * r, 0.0, -0.15 * q[:, 0] * r)),
    "breast_tilt_left": _in_breast(lambda q, r: (0.0, 0.008 * r, -0.15 * q[:, 1] * r)),
    "breast_point_left": _in_breast(
        lambda q, r: (-0.08 * q[:, 0] * r, -0.08 * q[:, 1] * r, 0.006 * r**3)),
    "breast_lower_pole_left": _swell(0.0, -0.035, (0.065, 0.055), 0.007),
    "breast_upper_pole_left": _swell(0.0, 0.040, (0.070, 0.060), 0.007),
    "breast_medial_pole_left": _swell(-0.040, 0.0, (0.055, 0.070), 0.006),
    "breast_lateral_pole_left": _swell(0.045, 0.0, (0.055, 0.070), 0.006),
    "breast_slope_left": _swell(0.005, 0.085, (0.080, 0.070), 0.007),
    "breast_tail_left": _swell(0.055, 0.055, (0.060, 0.060), 0.007),
    "breast_fold_left": _swell(0.0, -0.068, (0.065, 0.032), -0.005),
    "breast_fold_lateral_left": _swell(0.066, -0.030, (0.040, 0.050), -0.005),
    "breast_cleavage_left": _swell(-0.070, 0.020, (0.035, 0.070), 0.005),
    "nipple_up_left": _in_breast(lambda q, r: (0.0, 0.008 * _tip(q, 0.045), 0.0)),
    "nipple_lateral_left": _in_breast(lambda q, r: (0.008 * _tip(q, 0.045), 0.0, 0.0)),
    "nipple_out_left": _in_breast(lambda q, _: (0.0, 0.0, 0.003 * _tip(q, 0.016))),
    "areola_left": _in_breast(lambda q, _: (0.0, 0.0, 0.004 * _tip(q, 0.034))),
}  # fmt: skip


def _tip(q: Floats, radius: float) -> Floats:
    """1 at the nipple, 0 from ``radius`` m on."""
    r2 = ((q[:, :2] - body.NIPPLE[:2]) ** 2).sum(axis=1) / radius**2
    return np.asarray(np.maximum(1 - r2, 0.0) ** 3)
