"""Landmarks that the scan shows by itself, for a fit to be pulled by."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from supple.registration.posture import Posture
from supple.registration.register_settings import RegisterSettings
from supple.registration.rig import Rig
from supple.registration.template import Floats
from supple.surface import Surface


def found_landmarks(
    scan: Surface, rig: Rig, posture: Posture, named: Mapping[str, Floats], keep: RegisterSettings
) -> tuple[dict[str, Floats], dict[str, float]]:
    """Landmarks to fit, (3,) m, and their standard deviations: those given, and nipples found.

    Skin slides on skin, and a breast is round: only a nipple tells where its middle is.
    """
    marks, sds = dict(named), dict.fromkeys(named, keep.landmark_sd)
    if keep.sure is None:
        return marks, sds
    from supple.registration.auto_landmarks import propose

    chest = [bone.name for bone in rig.template.bones].index("chest")
    R, joint = posture.rotations[chest], rig.template.joints[chest]
    upright = R.T, joint - R.T @ (joint + posture.translations[chest])
    at = rig.template.landmark_points(rig.vertices(posture))
    for name, one in propose(scan, upright).items():
        near = np.linalg.norm(one.point - at[name]) < keep.found_reach if name in at else False
        if near and name not in marks and one.confidence >= keep.sure and "nipple" in name:
            marks[name], sds[name] = one.point, keep.found_sd / one.confidence
    return marks, sds
