"""Signal relative to fat: takes the coil's fall-off away and makes images of any scale alike.

Fat lies beneath the skin everywhere, so its signal there, spread smoothly inwards, is the level
that tissue is compared with; it stands in for a bias field and, unlike one that is fitted to the
histogram, survives a fall-off by a factor of ten.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from scipy import ndimage

from supple.breast.segment_body import smooth

if TYPE_CHECKING:
    from supple.breast.grid import Field, Mask

#: ln of signal over fat: what is lower is not fat where fat is bright.
NOT_FAT = -0.4
#: Fat-suppressed: the brightest 2 % of a breast are this much above the fat beneath its skin (ln).
BRIGHTER_THAN_FAT = 0.17


@dataclass(frozen=True)
class Level:
    """Natural logarithm of signal over fat's (z, y, x), and whether fat is suppressed."""

    relative: Field
    fat_suppressed: bool


def relative_to_fat(signal: Field, least: float, depth: Field, front: Mask, breasts: Mask) -> Level:
    """Compare tissue with the fat around it.

    Args:
        signal: (z, y, x) as scanned.
        least: least signal of tissue; keeps the logarithm finite in air.
        depth: mm below the skin, 0 in air.
        front: the body in front of the thorax's middle.
        breasts: what hangs, away from the ends of the image.
    """
    log = np.log(ndimage.gaussian_filter(signal, 0.6) + np.float32(0.3 * least))
    suppressed = _fat_suppressed(log, depth, breasts)
    if suppressed:
        shell = front & (depth > 4) & (depth < 18)
        fat = shell & (np.abs(log - smooth(log, shell, 8.0)) < 0.3)
        return Level(log - _spread(log, fat), True)
    shell = front & (depth > 3) & (depth < 10)
    fat = shell & (log > smooth(log, shell, 5.0))
    for _ in range(2):
        fat = front & (depth > 3) & (np.abs(log - _spread(log, fat)) < -NOT_FAT)
    return Level(log - _spread(log, fat), False)


def _fat_suppressed(log: Field, depth: Field, breasts: Mask) -> bool:
    """Whether tissue in the breasts is brighter than the fat beneath their skin.

    Without suppression nothing in a T1-weighted breast outshines fat; with it vessels, gland and
    tumours do.
    """
    shell, deep = breasts & (depth > 3) & (depth < 8), breasts & (depth > 8)
    if not deep.any():
        return False
    above = (log - smooth(log, shell, 8.0))[deep]
    return bool(np.percentile(above, 98) > BRIGHTER_THAN_FAT)


def _spread(log: Field, fat: Mask) -> Field:
    """Fat's level everywhere: its mean within 20 mm, further off within 50 mm."""
    return smooth(log, fat, 10.0, far=smooth(log, fat, 25.0))
