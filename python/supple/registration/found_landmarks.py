"""Landmarks that the scan shows by itself, for a fit to be pulled by."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from supple.registration.posture import Posture
from supple.registration.refine_landmarks import ON_SKIN, refine
from supple.registration.register_settings import RegisterSettings
from supple.registration.rest_landmarks import alike, at_rest, evidence
from supple.registration.rig import Rig
from supple.registration.template import Floats, Template
from supple.surface import Surface

if TYPE_CHECKING:
    from supple.registration.auto_landmarks import Proposal

#: m, of the tip of a nipple that stands out of the breast's round.
TIP = 3e-3


def found_landmarks(
    scan: Surface, rig: Rig, posture: Posture, named: Mapping[str, Floats], keep: RegisterSettings
) -> tuple[dict[str, Floats], dict[str, float]]:
    """Landmarks to fit, (3,) m, and their standard deviations: those given, and nipples found.

    Skin slides on skin, and a breast is round: only a nipple tells where its middle is.
    """
    marks, sds = dict(named), dict.fromkeys(named, keep.landmark_sd)
    if keep.sure is None:
        return marks, sds
    at = rig.template.landmark_points(rig.vertices(posture))
    for name, one in proposed(scan, rig.template, posture).items():
        near = np.linalg.norm(one.point - at[name]) < keep.found_reach if name in at else False
        if near and name not in marks and one.confidence >= keep.sure:
            marks[name], sds[name] = one.point, keep.found_sd / one.confidence
    return marks, sds


def told_landmarks(
    scan: Surface, template: Template, posture: Posture, offset: Floats, points: Floats,
    seen: npt.NDArray[np.bool_], slid: Collection[str] = (),
) -> tuple[dict[str, Floats], dict[str, float], float]:  # fmt: skip
    """Landmarks (3,) m as the shape of a fit tells them, and the tips of nipples that stand out.

    Args:
        offset, points: (n, 3) m, what moved the skin off ``posture``, and its vertices then.
        seen: (n,) which vertices the scan shows.
        slid: names of landmarks that are known to have slid.

    Returns:
        Places, standard deviations, and the furthest from where the fit has one, m.
    """
    skin = at_rest(template, posture, offset)
    found = evidence(template, skin, points, seen, slid)
    marks = dict(zip(found.names, found.places, strict=True))
    sds = dict(zip(found.names, found.sds, strict=True))
    at = template.landmark_points(points)
    near = {name: marks.get(name, place) for name, place in at.items() if "nipple" in name}
    tips = {k: one for k, one in refine(scan, near).items() if one.confidence > ON_SKIN}
    if _paired(template, posture, {name: one.point - at[name] for name, one in tips.items()}):
        marks |= {name: one.point for name, one in tips.items()}
        sds |= dict.fromkeys(tips, TIP)
    apart = [float(np.linalg.norm(place - at[name])) for name, place in marks.items()]
    return marks, sds, max(apart, default=0.0)


def _paired(template: Template, posture: Posture, steps: Mapping[str, Floats]) -> bool:
    """Whether both sides show a tip, in places alike: one alone may be a ridge of something else.

    Args:
        steps: (3,) m, from where the fit has each nipple.
    """
    names = [bone.name for bone in template.bones]
    if len(steps) != 2 or "chest" not in names:
        return False
    R = posture.rotations[names.index("chest")]
    one, other = (R.T @ step for step in steps.values())
    return alike(one, other)


def proposed(scan: Surface, template: Template, posture: Posture) -> dict[str, Proposal]:
    """Nipples that the scan shows, from the front of the body that ``posture`` puts there."""
    from supple.registration.auto_landmarks import propose

    names = [bone.name for bone in template.bones]
    if "chest" not in names:
        return {}
    chest = names.index("chest")
    R, joint = posture.rotations[chest], template.joints[chest]
    return propose(scan, (R.T, joint - R.T @ (joint + posture.translations[chest])), True)


def astray(
    scan: Surface, template: Template, posture: Posture, points: Floats, sure: float
) -> float:
    """Largest distance, m, of a nipple of the fit ``points`` (n, 3) m to one that surely shows."""
    at = template.landmark_points(points)
    return max(
        (float(np.linalg.norm(one.point - at[name]))
         for name, one in proposed(scan, template, posture).items()
         if name in at and one.confidence >= sure), default=0.0,
    )  # fmt: skip
