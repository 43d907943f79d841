"""What landmarks mean where a definition needs more than a glance, the same on every template."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

Floats = npt.NDArray[np.float64]

#: The xiphoid is this part of the way down from the sternal notch to the breasts' folds.
_XIPHOID = 0.9


def xiphoid_height(notch: float, fold: float) -> float:
    """Height of the xiphoid on the midline, from those of notch and folds, m.

    A sternum of 19 cm on a chest whose folds are 21 cm below the notch.
    """
    return (1 - _XIPHOID) * notch + _XIPHOID * fold


def level_with(outline: Floats, nipple: Floats) -> tuple[Floats, Floats]:
    """Innermost and outermost point (3,) m of a breast's outline (k, 3) at its nipple's height."""
    after = np.roll(outline, -1, axis=0)
    above, next_above = outline[:, 2] - nipple[2], after[:, 2] - nipple[2]
    cut = np.flatnonzero((above > 0) != (next_above > 0))
    share = (above[cut] / (above[cut] - next_above[cut]))[:, None]
    points = (1 - share) * outline[cut] + share * after[cut]
    aside = np.abs(points[:, 0])
    return points[aside.argmin()], points[aside.argmax()]
