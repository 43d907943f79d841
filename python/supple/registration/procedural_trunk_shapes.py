"""How chests, bellies, backs, shoulders, necks and arms differ: blendshapes of the trunk."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from supple.registration import procedural_body as body
from supple.registration.procedural_fields import Field, band, bump, shift, trunk_bump, widened
from supple.registration.procedural_rig import arm_part, smooth

Floats = npt.NDArray[np.float64]


def _kyphosis(centre: float, half: float, by: float) -> Field:
    """A band of heights moved backwards by ``by`` m, arms and all."""

    def field(p: Floats, _: Floats) -> Floats:
        w = band(p[:, 2], centre, half)
        return np.asarray(w[:, None] * np.array([0.0, by, 0.0]))

    return field


def _arm(along: float, across: float, back: float) -> Field:
    """Left arm: longer by a share of the place along it, thicker across it, sideways and back."""
    side = np.cross(body.ARM, (0.0, 1.0, 0.0))
    behind = np.cross(side, body.ARM)

    def field(p: Floats, _: Floats) -> Floats:
        q = p - body.SHOULDER
        w = (arm_part(p * (1, 1, 1)) * smooth(p[:, 0] / 0.05))[:, None]
        parts = ((along, body.ARM), (across, side), (back, behind))
        return np.asarray(w * sum(k * np.outer(q @ axis, axis) for k, axis in parts))

    return field


def _neck(by: tuple[float, float, float]) -> Field:
    def field(p: Floats, _: Floats) -> Floats:
        q = p - body.NECK
        w = smooth((q @ body.NECK_AXIS + 0.02) / 0.08)[:, None]
        return np.asarray(w * q * np.asarray(by))

    return field


TRUNK_SHAPES: dict[str, Field] = {
    "chest_breadth_upper": widened(0.10, 0.11, (0.07, 0.0)),
    "chest_breadth_middle": widened(0.01, 0.11, (0.07, 0.0)),
    "chest_breadth_lower": widened(-0.08, 0.11, (0.08, 0.0)),
    "chest_depth_upper": widened(0.10, 0.11, (0.0, 0.10), 0.01),
    "chest_depth_middle": widened(0.01, 0.11, (0.0, 0.10)),
    "chest_depth_lower": widened(-0.08, 0.11, (0.0, 0.10)),
    "waist_breadth": widened(-0.16, 0.12, (0.10, 0.0)),
    "waist_depth": widened(-0.16, 0.12, (0.0, 0.12)),
    "hip_breadth": widened(-0.30, 0.14, (0.09, 0.0)),
    "hip_depth": widened(-0.30, 0.14, (0.0, 0.12)),
    "belly_upper": trunk_bump((0.0, -0.11, -0.12), (0.17, 0.13, 0.12), 0.013),
    "belly_lower": trunk_bump((0.0, -0.11, -0.25), (0.18, 0.13, 0.13), 0.015),
    "belly_navel": bump((0.0, -0.115, -0.185), (0.05, 0.08, 0.05), -0.006),
    "flank_left": trunk_bump((0.14, 0.0, -0.17), (0.11, 0.13, 0.11), 0.011),
    "iliac_left": trunk_bump((0.16, 0.0, -0.27), (0.11, 0.13, 0.11), 0.011),
    "back_roll_left": trunk_bump((0.10, 0.085, -0.07), (0.11, 0.10, 0.07), 0.009),
    "buttock_left": trunk_bump((0.085, 0.11, -0.30), (0.080, 0.09, 0.075), 0.014),
    "lumbar_hollow": trunk_bump((0.0, 0.085, -0.17), (0.13, 0.12, 0.11), -0.012),
    "spine_furrow": trunk_bump((0.0, 0.09, -0.06), (0.035, 0.08, 0.20), -0.005),
    "kyphosis": _kyphosis(0.12, 0.14, 0.014),
    "lordosis": _kyphosis(-0.16, 0.13, -0.012),
    "dorsi_left": trunk_bump((0.12, 0.07, 0.04), (0.07, 0.09, 0.09), 0.0058),
    "scapula_left": trunk_bump((0.085, 0.115, 0.075), (0.06, 0.08, 0.08), 0.008),
    "shoulder_up_left": shift((0.17, 0.02, 0.14), (0.13, 0.16, 0.12), (0.0, 0.0, 0.014)),
    "shoulder_out_left": shift((0.17, 0.02, 0.13), (0.13, 0.16, 0.14), (0.012, 0.0, 0.0)),
    "shoulder_front_left": shift((0.17, 0.02, 0.13), (0.13, 0.16, 0.14), (0.0, -0.014, 0.0)),
    "deltoid_front_left": bump((0.18, -0.03, 0.115), (0.06, 0.05, 0.07), 0.007),
    "deltoid_back_left": bump((0.185, 0.07, 0.115), (0.06, 0.05, 0.07), 0.007),
    "deltoid_side_left": bump((0.225, 0.02, 0.09), (0.05, 0.06, 0.08), 0.007),
    "trapezius_left": bump((0.075, 0.05, 0.18), (0.06, 0.06, 0.06), 0.009),
    "clavicle_left": bump((0.09, -0.02, 0.15), (0.07, 0.05, 0.05), 0.007),
    "pectoral_left": bump((0.10, -0.055, 0.10), (0.07, 0.06, 0.06), 0.008),
    "axilla_front_left": bump((0.155, -0.035, 0.065), (0.045, 0.05, 0.05), 0.008),
    "axilla_back_left": bump((0.155, 0.06, 0.055), (0.05, 0.05, 0.06), 0.009),
    "axilla_side_left": trunk_bump((0.15, 0.01, 0.02), (0.06, 0.07, 0.07), 0.0028),
    "arm_girth_left": _arm(0.0, 0.12, 0.12),
    "arm_ellipse_left": _arm(0.0, 0.10, -0.10),
    "arm_length_left": _arm(0.12, 0.0, 0.0),
    "neck_girth": _neck((0.10, 0.10, 0.0)),
    "neck_depth": _neck((-0.04, 0.10, 0.0)),
    "neck_length": _neck((0.0, 0.0, 0.15)),
    "neck_forward": shift((0.0, 0.03, 0.25), (0.10, 0.12, 0.12), (0.0, -0.012, 0.0)),
    "nape": bump((0.0, 0.09, 0.19), (0.07, 0.06, 0.07), 0.008),
    "sternum_hollow": bump((0.0, -0.08, 0.05), (0.04, 0.06, 0.11), -0.006),
    "throat": bump((0.0, -0.02, 0.165), (0.05, 0.05, 0.05), -0.006),
    "ribs_left": trunk_bump((0.09, -0.09, -0.09), (0.07, 0.08, 0.05), 0.008),
}
