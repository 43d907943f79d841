"""Where the body is: the voxels that air in front of a prone patient does not reach."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import SimpleITK as sitk
from scipy import ndimage
from skimage import filters

from supple.breast.grid import PatientGrid, corners
from supple.errors import InputError

if TYPE_CHECKING:
    from collections.abc import Iterable

    from numpy.typing import NDArray

    from supple.breast.grid import Field, Mask

#: A voxel is air below this share of the tissue's signal near by; at the skin, of that beneath it.
AIR_SHARE, SKIN_SHARE = 0.2, 0.4
#: Faces of the grid: array axis, its end, and the direction that it looks at.
_FACES = (
    (1, 0, "anterior"), (1, -1, "posterior"), (2, 0, "right"),
    (2, -1, "left"), (0, 0, "inferior"), (0, -1, "superior"),
)  # fmt: skip


def on_patient_grid(image: sitk.Image, spacing: float) -> tuple[PatientGrid, Field]:
    """The image on a grid along the patient's axes; finer voxels are averaged first."""
    low, high = corners(image)
    half = 0.5 * spacing
    grid = PatientGrid.around(low + half, high - half - 0.01 * spacing, spacing)
    variance = [(0.4 * spacing) ** 2 * (s < 0.75 * spacing) for s in image.GetSpacing()]
    averaged = sitk.DiscreteGaussian(sitk.Cast(image, sitk.sitkFloat32), variance)
    return grid, np.maximum(grid.resample(averaged, sitk.sitkLinear, 0.0), 0.0)


def find_body(signal: Field, air_seeds: Iterable[tuple[int, int, int]] = ()) -> tuple[Mask, float]:
    """The body, and the least signal of tissue.

    Threshold (Otsu on log signal, then a share of the tissue signal near by, so that the surface
    follows the coil's fall-off), air grown from the front face, opening, largest component.

    Args:
        signal: (z, y, x), not negative, the front first along y.
        air_seeds: indices z, y, x of voxels that are air all the same (ghosts, coil).

    Raises:
        InputError: no body, or air is not in front of it.
    """
    blurred = ndimage.gaussian_filter(signal, 0.6)
    least = float(np.expm1(otsu(np.log1p(blurred[blurred > 0]))))
    bright = ndimage.binary_opening(blurred > least)
    near = smooth(blurred * blurred, bright, 6.0) / np.maximum(smooth(blurred, bright, 6.0), 1e-6)
    tissue = blurred > np.maximum(AIR_SHARE * near, 0.75 * least)
    tissue = ndimage.binary_opening(tissue, iterations=2)
    check_front(tissue)
    for seed in air_seeds:
        tissue &= ~_grown(blurred, seed)
    return _largest(_peeled(signal, _solid(~_reached_from_front(~tissue)))), least


def check_front(tissue: Mask) -> None:
    """Refuse an image whose free air is not where breasts hang in a prone patient, at -y."""
    air = {name: 1 - float(np.take(tissue, end, axis).mean()) for axis, end, name in _FACES}
    free = max(("anterior", "posterior"), key=lambda name: air[name])
    if free == "posterior" and air["posterior"] > air["anterior"] + 0.1:
        raise InputError(
            "image must show the breasts hanging towards anterior (-y in LPS), got free air on the"
            f" posterior side ({air['posterior']:.0%} against {air['anterior']:.0%}): its header's"
            " orientation looks wrong, or the patient is not in view; correct the header."
        )
    if air["anterior"] < 0.5:
        raise InputError(
            f"image must have air in front of the breasts (-y in LPS), got {air['anterior']:.0%}"
            " air on the front face: give an image that shows both whole breasts of a prone"
            " patient, with the right orientation in its header."
        )


def smooth(values: Field, where: Mask, sigma: float, far: Field | float | None = None) -> Field:
    """Gaussian mean over `where`, `sigma` in voxels; `far` (else its mean) where that is remote."""
    if not where.any():
        return np.zeros(where.shape, np.float32)
    base = np.asarray(values[where].mean() if far is None else far, np.float32)
    above = _blur(np.where(where, values - base, 0).astype(np.float32), sigma)
    weight = np.maximum(_blur(where.astype(np.float32), sigma), 0.0)
    return np.asarray(base + above / (weight + 1e-3), np.float32)


def otsu(values: NDArray[np.floating[Any]]) -> float:
    """The threshold that parts `values` best in two (Otsu 1979)."""
    threshold: Any = filters.threshold_otsu
    return float(threshold(values))


def _blur(array: Field, sigma: float) -> Field:
    """A Gaussian whose cost does not grow with `sigma` (recursive: Deriche 1993)."""
    blurred = sitk.SmoothingRecursiveGaussian(sitk.GetImageFromArray(array), sigma)
    return np.asarray(sitk.GetArrayFromImage(blurred))


def _peeled(signal: Field, body: Mask) -> Mask:
    """Take off the rim that blur adds: skin ends where the signal is about half of that beneath.

    Skin is darker than bright fat and brighter than suppressed fat; the share is such that either
    way the surface is off by less than a fifth of a voxel of 2 mm.
    """
    blurred = ndimage.gaussian_filter(signal, 0.3)
    depth = ndimage.distance_transform_edt(body)
    fat, rim = (body & (depth > low) & (depth < high) for low, high in ((1.5, 4.5), (1.2, 2.5)))
    beneath = np.maximum(smooth(blurred, fat, 1.5), smooth(blurred, rim, 1.0))
    return np.asarray(body & ((depth > 2) | (blurred > SKIN_SHARE * beneath)))


def _reached_from_front(air: Mask) -> Mask:
    parts, _ = ndimage.label(air)
    reached = np.unique(parts[:, 0, :])
    return np.isin(parts, reached[reached > 0])


def _grown(signal: Field, seed: tuple[int, int, int]) -> Mask:
    """What is connected to `seed` and no brighter than half as much again."""
    limit = 1.5 * float(signal[seed])
    image = sitk.GetImageFromArray(signal)
    grown = sitk.ConnectedThreshold(image, [seed[::-1]], lower=0.0, upper=limit)
    return np.asarray(sitk.GetArrayFromImage(grown), bool)


def _solid(body: Mask) -> Mask:
    """The largest part that hangs together by more than a thread, its fine tips included."""
    core = ndimage.binary_opening(body, iterations=3)
    if not core.any():
        raise InputError(
            "image must show a body, got nothing that stands out from noise: give a prone breast"
            " MRI, or labels."
        )
    return np.asarray(ndimage.binary_dilation(_largest(core), iterations=4, mask=body))


def _largest(mask: Mask) -> Mask:
    """The largest part of `mask`."""
    parts, _ = ndimage.label(mask)
    return np.asarray(parts == np.bincount(parts.ravel())[1:].argmax() + 1)
