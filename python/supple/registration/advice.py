"""What the user of a registration is told besides what the fit doubts by itself.

Where it fails: how much of a body the scan shows. Where it does not: which landmarks contradict
the scan, and that a body is of a size that none has.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from supple.registration.body_size import body_size
from supple.registration.landmark_doubts import misplaced, mistaken
from supple.registration.template import Template
from supple.surface import Surface

if TYPE_CHECKING:
    from supple.registration.registration import Registration


def advised(
    found: Registration, landmarks: Mapping[str, npt.ArrayLike] | None, sd: float,
    alone: Callable[[], Registration],
) -> Registration:  # fmt: skip
    """With a warning for landmarks that the scan contradicts, or for a size of no body.

    Args:
        landmarks: name → (3,) m that were given; they pulled with ``sd`` m.
        alone: registers the scan without landmarks; called where one, or the size, is doubted.
    """
    given = {name: np.asarray(at, dtype=np.float64) for name, at in (landmarks or {}).items()}
    more = misplaced(found, given, sd)
    if not more and body_size(found).doubt:
        more = [body_size(found).doubt]
    if not more:
        return found
    if given:
        more = mistaken(alone().landmarks, given) or more
    return replace(found, warnings=[*more, *found.warnings], trustworthy=False)


def too_little(scan: Surface, template: Template, started: bool = False) -> str:
    """Why a fit found nothing to hold on to: how much the scan shows, and what to scan.

    Args:
        started: from a posture that was given.
    """
    if started:
        return "the posture to start from must be near the scan; give a nearer one, or none."
    wide = " × ".join(f"{100 * extent:.0f}" for extent in sorted(np.ptp(scan.points, axis=0))[::-1])
    seen = ""
    if len(scan.triangles):
        area = float(scan.areas.sum())
        share = area / Surface(template.points, template.triangles).areas.sum()
        seen = f"{1e4 * area:.0f} cm² of skin, {share:.0%} of a torso's, on "
    return (
        f"the scan must show enough of a torso to hold on to, but shows {seen}{wide} cm; scan the "
        "front from neck to waist and from armpit to armpit with both breasts, or give three or "
        "more landmarks."
    )
