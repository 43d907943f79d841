"""Which way a body faces: the best pose against the best that is turned, both fitted.

A chest and a back are alike to a few mm, and after scales and shapes a template fits either; what
tells is how far from an ordinary body it had to go for it.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from supple.registration.initial_pose import Candidate
from supple.registration.posture import Posture
from supple.registration.register_settings import RegisterSettings
from supple.registration.rig import RigFit
from supple.registration.template import Floats, Template


@dataclass(frozen=True, eq=False)
class Rival:
    """A pose with what speaks against it: energy, in units of that of the whole scan."""

    fit: RigFit
    against: float


def against(fit: RigFit) -> float:
    """Energy, data and priors, by the share of the scan that it explains.

    Each term is a negative log-likelihood; a pose that leaves skin out is charged for that as if
    it fitted that alike.
    """
    share = float((fit.used > 0.1).mean())
    return sum(fit.energy.values()) / max(share, 1e-3)


def turned_round(one: Posture, template: Template, middle: Floats) -> Posture:
    """``one`` turned by 180° about the length of its chest, through ``middle`` (3,) m."""
    R = facing(one, template)
    half = R @ np.diag([-1.0, -1.0, 1.0]) @ R.T
    return one.moved(half, middle - half @ middle, template.joints)


def facing(one: Posture, template: Template) -> Floats:
    """Rotation (3, 3) of the chest."""
    names = [bone.name for bone in template.bones]
    return np.asarray(one.rotations[names.index("chest") if "chest" in names else 0])


def apart(a: Posture, b: Posture, template: Template) -> float:
    """Angle between two chests, rad."""
    turn = facing(a, template) @ facing(b, template).T
    return float(np.arccos(np.clip((np.trace(turn) - 1) / 2, -1, 1)))


def contenders(
    starts: Sequence[Candidate], template: Template, middle: Floats, keep: RegisterSettings
) -> list[Candidate]:
    """Starts to be fitted: the best few, one of each other facing, and the back in any case.

    Args:
        middle: (3,) m of the scan.
    """
    best = starts[0]
    chosen = [one for one in starts if one.score <= keep.rival * best.score][: keep.starts]

    def new(one: Candidate) -> bool:
        return all(apart(one.posture, k.posture, template) > keep.turned for k in chosen)

    for one in starts:
        if one.score <= keep.facing * best.score and new(one):
            chosen.append(one)
    back = replace(best, posture=turned_round(best.posture, template, middle))
    return [*chosen, back] if new(back) else chosen


def decided(
    coarse: Sequence[RigFit], template: Template, refit: Callable[[RigFit], RigFit],
    keep: RegisterSettings,
) -> list[Rival]:  # fmt: skip
    """The best of each facing, ``refit`` if there are more; the likeliest is first.

    Args:
        coarse: fits, best first.
    """
    faces: list[RigFit] = []
    for fit in coarse:
        new = all(apart(fit.posture, one.posture, template) > keep.turned for one in faces)
        if new and against(fit) <= keep.faced * against(coarse[0]):
            faces.append(fit)
    fits = [refit(one) for one in faces] if len(faces) > 1 else faces
    return sorted((Rival(fit, against(fit)) for fit in fits), key=lambda one: one.against)
