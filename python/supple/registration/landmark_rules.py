"""What landmarks mean where a definition needs more than a glance, the same on every template."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

Floats = npt.NDArray[np.float64]

#: The xiphoid is this part of the way down from the sternal notch to the breasts' folds.
_XIPHOID = 0.9
#: m below the nipple, where the chord ends from which the fold is furthest; and how deep it may be.
_CHORD, _DEEP = 0.13, 0.10


def xiphoid_height(notch: float, fold: float) -> float:
    """Height of the xiphoid on the midline, from those of notch and folds, m.

    A sternum of 19 cm on a chest whose folds are 21 cm below the notch.
    """
    return (1 - _XIPHOID) * notch + _XIPHOID * fold


def fold_below(points: Floats, triangles: npt.NDArray[np.int64], nipple: Floats) -> Floats:
    """The crease (3,) m under a breast, on an edge of the skin, straight below its ``nipple``.

    Where the sagittal section through the nipple is furthest behind the chord from the nipple to
    the chest 13 cm below it.
    """
    edges = triangles[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2)
    a, b = points[edges[:, 0]], points[edges[:, 1]]
    cut = (a[:, 0] < nipple[0]) != (b[:, 0] < nipple[0])
    share = ((nipple[0] - a[cut, 0]) / (b[cut, 0] - a[cut, 0]))[:, None]
    line = (1 - share) * a[cut] + share * b[cut]
    below = nipple[2] - line[:, 2]
    line = line[(below > 0) & (below < _CHORD) & (line[:, 1] < nipple[1] + _DEEP)]
    lowest = line[line[:, 2].argmin()]
    along = (lowest - nipple)[1:] / np.linalg.norm((lowest - nipple)[1:])
    off = line[:, 1:] - nipple[1:]
    return np.asarray(line[np.argmax(off[:, 1] * along[0] - off[:, 0] * along[1])])


def level_with(outline: Floats, nipple: Floats) -> tuple[Floats, Floats]:
    """Innermost and outermost point (3,) m of a breast's outline (k, 3) at its nipple's height."""
    after = np.roll(outline, -1, axis=0)
    above, next_above = outline[:, 2] - nipple[2], after[:, 2] - nipple[2]
    cut = np.flatnonzero((above > 0) != (next_above > 0))
    share = (above[cut] / (above[cut] - next_above[cut]))[:, None]
    points = (1 - share) * outline[cut] + share * after[cut]
    aside = np.abs(points[:, 0])
    return points[aside.argmin()], points[aside.argmax()]
