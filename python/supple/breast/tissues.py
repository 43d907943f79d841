"""The label values of every label image and every tissue array in the pipeline."""

from __future__ import annotations

from enum import IntEnum


class Tissue(IntEnum):
    """What a voxel or a cell is made of; written as is into label images (uint8)."""

    AIR = 0
    FAT = 1
    GLAND = 2
    CHEST = 3
    TUMOUR = 4


#: Tissues that the finite-element breast is made of; the chest wall is its support.
BREAST = (Tissue.FAT, Tissue.GLAND, Tissue.TUMOUR)
