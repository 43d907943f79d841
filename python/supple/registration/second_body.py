"""Whether a scan holds a torso besides the one that was registered: two people side by side."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from supple.errors import SuppleError
from supple.registration.register import register
from supple.surface import Surface

if TYPE_CHECKING:
    from supple.registration.registration import Registration

#: Least share of the scan's points beside the body; hair, a table or a chair may be more.
_BESIDE = 0.2
#: m between the middles of two bodies, at least.
_APART = 0.3
#: Doubts that a fit to another body may have: half of it may be cut away, or a nipple be astray.
_DOUBTS = 1


def second_body(found: Registration) -> str:
    """A sentence if a torso fits what ``found`` leaves of its scan, or nothing.

    Costs another registration where that is much of the scan, and nothing elsewhere.
    """
    rest = _rest(found.scan, ~found.used)
    if len(rest.points) < _BESIDE * len(found.scan.points):
        return ""
    try:
        other = register(rest, found.template)
    except SuppleError:
        return ""
    apart = float(np.linalg.norm(other.points.mean(axis=0) - found.points.mean(axis=0)))
    if len(other.warnings) > _DOUBTS or apart < _APART:
        return ""
    return (f"The scan shows another body {100 * apart:.0f} cm away, and either may be the "
            "patient; cut one away.")  # fmt: skip


def _rest(scan: Surface, kept: np.ndarray) -> Surface:
    """The points ``kept`` (n,) bool, with the triangles all of whose corners they are."""
    if not len(scan.triangles):
        return Surface(scan.points[kept])
    triangles = scan.triangles[kept[scan.triangles].all(axis=1)]
    used = np.zeros(len(scan.points), dtype=bool)
    used[triangles] = True
    return Surface(scan.points[used], (np.cumsum(used) - 1)[triangles])
