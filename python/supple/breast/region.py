"""Which voxels make the finite-element body: both breasts on their chest wall.

labels ─► breast tissue within reach of the breasts ─► no thin sheet, no crevice, no island
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
import SimpleITK as sitk
from scipy import ndimage

from supple.breast.grid import FAR, PatientGrid, signed_distance, voxel_coordinates
from supple.breast.reach import RegionSettings, reach
from supple.breast.tissues import BREAST, Tissue
from supple.errors import InputError

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from supple.breast.grid import Field, Mask

#: Values of `BreastRegion.contact` beside those of Tissue.
CUT, BODY = 255, 254


@dataclass(frozen=True)
class BreastRegion:
    """The body to be meshed.

    Attributes:
        mask: uint8 image on the labels' voxels (cropped, padded by two), 1 inside the body.
        grid: the patient-aligned grid of the two fields below.
        level: (grid) signed distance to the body's surface, mm, negative inside.
        contact: (grid) what the body borders on: AIR, CHEST, or CUT where tissue or the patient
            goes on beyond a cut or the image; BODY inside it and where nothing is said.
        parts: how many bodies: 1 where tissue joins the breasts.
        segmented_mm3: volume of the labelled breast tissue within reach, before it is cleaned.
        warnings: one sentence each.
    """

    mask: sitk.Image
    grid: PatientGrid
    level: Field
    contact: NDArray[np.uint8]
    parts: int
    segmented_mm3: float
    warnings: tuple[str, ...]

    @property
    def volume_mm3(self) -> float:
        """Volume of the voxels inside."""
        return _volume_mm3(self.mask)


def breast_region(
    labels: sitk.Image,
    settings: RegionSettings | None = None,
    tumour_mm: Sequence[float] | None = None,
) -> BreastRegion:
    """Both breasts' region of a label image.

    Args:
        labels: 3-D image of `Tissue` codes, LPS mm, any direction cosines; patient prone.
        settings: lengths and shares; the defaults serve adults.
        tumour_mm: x, y, z LPS mm; breast tissue around its foot belongs to the body in any case.

    Raises:
        InputError: not such an image, or it holds no breast or no chest wall.
    """
    s = settings or RegionSettings()
    check_labels(labels)
    coarse, beyond, within, sides = reach(labels, s, tumour_mm)
    box = coarse.points(within)
    grid = PatientGrid.around(box.min(axis=0) - 9.0, box.max(axis=0) + 9.0, s.fine)
    tissue = _breast_tissue(labels, grid)
    reached = coarse.image(beyond)
    beyond = grid.resample(reached, sitk.sitkLinear, FAR)
    level = grid.resample(signed_distance(tissue), sitk.sitkLinear, FAR)
    contact = _contact(grid.resample(labels, sitk.sitkNearestNeighbor, CUT), beyond)
    solid = _solid(grid, level, beyond, s)
    level = _trim(grid, level, solid)
    contact[level < 0] = BODY
    mask = _voxels_below(grid.image(level), tissue)
    segmented = _volume_mm3(tissue * _voxels_below(reached, tissue))
    warnings = sides + _border_warning(labels, mask)
    parts = int(ndimage.label(solid)[1])
    return BreastRegion(mask, grid, level, contact, parts, segmented, warnings)


def check_labels(labels: sitk.Image) -> None:
    """Refuse what is not a label image of breasts on a chest wall, with the remedy."""
    if labels.GetDimension() != 3 or labels.GetNumberOfComponentsPerPixel() != 1:
        raise InputError(
            f"labels must be one 3-D image of tissue codes, got {labels.GetDimension()} dimensions"
            f" and {labels.GetNumberOfComponentsPerPixel()} components: give a label map."
        )
    found = {int(code) for code in np.unique(sitk.GetArrayViewFromImage(labels))}
    known = {int(t): t.name.lower() for t in Tissue}
    meaning = ", ".join(f"{code} {name}" for code, name in known.items())
    if unknown := sorted(found - known.keys()):
        raise InputError(f"labels must hold {meaning}; got {unknown[:5]}: map them to these codes.")
    if not found & {int(t) for t in BREAST}:
        raise InputError(
            "labels must hold breast tissue (1 fat, 2 gland or 4 tumour), got only"
            f" {', '.join(known[code] for code in sorted(found))}: check the segmentation's seeds."
        )
    if int(Tissue.CHEST) not in found:
        raise InputError(
            "labels must hold a chest wall (3) for the breasts to rest on, got none: label what is"
            " inside the body and not breast as 3."
        )


def _breast_tissue(labels: sitk.Image, grid: PatientGrid) -> sitk.Image:
    """1 where a voxel is fat, gland or tumour; cropped to the box of `grid`, padded by zeros."""
    index = voxel_coordinates(labels, grid.corners())
    first = np.clip(np.floor(index.min(axis=0)), 0, labels.GetSize()).astype(int)
    last = np.clip(np.ceil(index.max(axis=0)) + 1, 0, labels.GetSize()).astype(int)
    part = sitk.RegionOfInterest(labels, (last - first).tolist(), first.tolist())
    inside = np.isin(sitk.GetArrayViewFromImage(part), BREAST)
    tissue = sitk.GetImageFromArray(inside.astype(np.uint8))
    tissue.CopyInformation(part)
    padded: sitk.Image = sitk.ConstantPad(tissue, [2, 2, 2], [2, 2, 2], 0)
    return padded


def _contact(codes: NDArray[Any], beyond: Field) -> NDArray[np.uint8]:
    """AIR, CHEST, CUT for tissue beyond the reach and outside the image, BODY elsewhere."""
    contact = np.full(codes.shape, BODY, np.uint8)
    contact[np.isin(codes, BREAST) & (beyond > 0)] = CUT
    for code in (Tissue.AIR, Tissue.CHEST, CUT):
        contact[codes == code] = code
    return contact


def _solid(grid: PatientGrid, level: Field, beyond: Field, s: RegionSettings) -> Mask:
    """Nodes of the body: no thin sheet, no ragged hole, no crevice, no cavity, no island."""
    inside = (level < 0) & (beyond < 0)
    thick = inside & (grid.distance(level < -s.sheet / 2) < (s.sheet + grid.spacing) / 2)
    smooth = inside & (thick | grid.closing(thick, s.bridge / 2))
    solid = ndimage.binary_fill_holes(smooth | (grid.closing(smooth, s.crevice / 2) & (beyond < 0)))
    names, count = ndimage.label(solid)
    sizes = np.bincount(names.ravel(), minlength=count + 1)
    sizes[0] = 0
    if not sizes.any():
        raise InputError(
            f"labels must hold breast tissue thicker than {s.sheet:g} mm, got only thinner sheets:"
            " check the segmentation and that its lengths are in mm."
        )
    return np.asarray((sizes >= s.least_part * sizes.max())[names], bool)


def _trim(grid: PatientGrid, level: Field, solid: Mask) -> Field:
    """`level` of the tissue without what is not `solid`, and with the gaps that `solid` fills.

    Trimming starts one node off the solid, so that it leaves the tissue's own surface as it is.
    """
    nodes = grid.signed_distance(solid)
    trimmed = np.maximum(level, nodes - grid.spacing)
    return np.where(solid & (level > 0), np.minimum(level, nodes), trimmed).astype(np.float32)


def _voxels_below(field: sitk.Image, voxels: sitk.Image) -> sitk.Image:
    """1 on each of `voxels` at whose centre `field` is negative."""
    values = sitk.Resample(field, voxels, sitk.Transform(), sitk.sitkLinear, FAR)
    below: sitk.Image = sitk.Cast(values < 0, sitk.sitkUInt8)
    return below


def _volume_mm3(mask: sitk.Image) -> float:
    count = np.count_nonzero(sitk.GetArrayViewFromImage(mask))
    return float(np.prod(mask.GetSpacing()) * count)


def _border_warning(labels: sitk.Image, mask: sitk.Image) -> tuple[str, ...]:
    """Says at which ends of the image the body is cut off, in the patient's directions."""
    inside = np.argwhere(sitk.GetArrayViewFromImage(mask))[:, ::-1]
    offset = voxel_coordinates(labels, np.array([mask.GetOrigin()])).round().astype(int)
    ends = []
    for axis, count in enumerate(labels.GetSize()):
        index = inside[:, axis] + offset[0, axis]
        ends += [_side(labels, axis, -1)] if index.min() <= 0 else []
        ends += [_side(labels, axis, 1)] if index.max() >= count - 1 else []
    if not ends:
        return ()
    return (f"The breasts reach the image's border ({', '.join(ends)}) and are cut off there.",)


def _side(labels: sitk.Image, axis: int, sign: int) -> str:
    """The patient's direction in which voxel index `axis` grows or (`sign` < 0) falls."""
    along = sign * np.array(labels.GetDirection()).reshape(3, 3)[:, axis]
    names = (("right", "left"), ("anterior", "posterior"), ("inferior", "superior"))
    main = int(np.abs(along).argmax())
    return names[main][int(along[main] > 0)]
