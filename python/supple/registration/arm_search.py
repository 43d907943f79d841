"""Arms that a fit lost, set again where arms are: kept if the scan is explained better so.

An arm that the scan hardly shows has no skin of its own to go to. While the body's shape is still
unknown it turns into skin of the trunk or into clutter, and from there no step leads back.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from supple.registration.pose_presets import Preset, preset_posture
from supple.registration.posture import Posture
from supple.registration.rig import RigFit
from supple.registration.template import Floats, Template

#: Degrees from hanging, sideways, and from there forward or back: arms beyond are doubted.
_RAISED, _FORWARD = (5.0, 150.0), 30.0
#: Degrees from hanging where an arm is tried, if the other one does not tell.
_TRIED = (30.0, 110.0)
#: Energy, in that of the arm where it was, below which it is kept.
_BETTER = 0.98
_SIDES = ("left", "right")
_IMAGE = np.diag([-1.0, 1.0, 1.0])


def settled_arms(
    fit: RigFit, template: Template, refit: Callable[[Posture], RigFit]
) -> Posture | None:
    """The posture of ``fit`` with arms where they explain more; None: they stay.

    A lost arm of a template without another stays: nothing tells where it is.

    Args:
        refit: moves the bones from a posture, quickly.
    """
    lost = lost_arms(fit.posture, template)
    if not lost:
        return None
    best, least = None, _BETTER * _energy(refit(fit.posture))
    for side in lost:
        start = best or fit.posture
        for turns in _trials(start, template, side, alone=len(lost) == 1):
            tried = refit(_with_arm(start, template, side, turns))
            if _energy(tried) < least:
                best, least = tried.posture, _energy(tried)
    return best


def _energy(fit: RigFit) -> float:
    return sum(fit.energy.values())


def lost_arms(posture: Posture, template: Template) -> list[str]:
    """Sides whose arm points where an arm hardly does."""
    number = {bone.name: k for k, bone in enumerate(template.bones)}
    lost = []
    for side in _SIDES:
        if not {f"arm_{side}", "chest"} <= number.keys():
            continue
        raised, forward = _direction(posture, template, number[f"arm_{side}"], number["chest"])
        if not _RAISED[0] < raised < _RAISED[1] or abs(forward) > _FORWARD:
            lost.append(side)
    return lost


def _direction(posture: Posture, template: Template, arm: int, chest: int) -> tuple[float, float]:
    """Degrees of an arm from hanging, out to its side, and to the back."""
    at_rest = template.weights[:, arm] @ (template.points - template.joints[arm])
    out = np.sign(at_rest[0])
    x, y, z = posture.rotations[chest].T @ posture.rotations[arm] @ at_rest
    return (float(np.degrees(np.arctan2(out * x, -z))),
            float(np.degrees(np.arctan2(y, np.hypot(x, z)))))  # fmt: skip


def _trials(posture: Posture, template: Template, side: str, alone: bool) -> list[list[Floats]]:
    """Turns (3, 3) of shoulder and arm against their parents.

    As the other arm's, if it has the same bones; if that is lost as well, those of presets.
    """
    if alone:
        other = _turns(posture, template, _SIDES[side == "left"])
        alike = len(other) == len(_bones(template, side))
        return [[_IMAGE @ turn @ _IMAGE for turn in other]] if alike else []
    presets = [preset_posture(template, Preset("", degrees)) for degrees in _TRIED]
    return [_turns(preset, template, side) for preset in presets]


def _bones(template: Template, side: str) -> list[int]:
    """Shoulder and arm."""
    number = {bone.name: k for k, bone in enumerate(template.bones)}
    return [number[name] for name in (f"shoulder_{side}", f"arm_{side}") if name in number]


def _turns(posture: Posture, template: Template, side: str) -> list[Floats]:
    R = posture.rotations
    return [R[template.parents[k]].T @ R[k] for k in _bones(template, side)]


def _with_arm(posture: Posture, template: Template, side: str, turns: list[Floats]) -> Posture:
    """``posture`` with one arm turned anew, as large as its parents, joints closed."""
    R, shifts, scales = (
        part.copy() for part in (posture.rotations, posture.translations, posture.scales)
    )
    for k, turn in zip(_bones(template, side), turns, strict=True):
        p = template.parents[k]
        R[k], scales[k] = R[p] @ turn, scales[p]
        arm = scales[p] * (template.joints[k] - template.joints[p])
        shifts[k] = R[p] @ arm + template.joints[p] + shifts[p] - template.joints[k]
    return Posture(R, shifts, scales, posture.blend)
