"""Images at the door: pixels and geometry, LPS mm, checked; no tag of a patient goes further.

file, folder or archive ─► plausible on disk ─► pixels ─► three axes, finite, not constant, mm
"""

from __future__ import annotations

import locale
import re
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import SimpleITK as sitk

from supple.breast.image_dicom import is_archive, read_archive, read_folder
from supple.breast.image_disk import check_disk
from supple.breast.tissues import BREAST, Tissue
from supple.errors import InputError

if TYPE_CHECKING:
    from collections.abc import Iterator

    from numpy.typing import NDArray

#: Voxel edges and fields of view that a breast image may have, mm.
SPACING, FIELD = (0.05, 15.0), (60.0, 1000.0)


@dataclass(frozen=True)
class Prone:
    """A checked image.

    Attributes:
        image: 3-D float32, LPS mm, with pixels and geometry alone.
        position: DICOM's PatientPosition (HFP: head first, prone), None where the file has none.
        warnings: one sentence each.
    """

    image: sitk.Image
    position: str | None
    warnings: tuple[str, ...]


def read_image(path: str | Path) -> Prone:
    """Read NIfTI, MHA/MHD, NRRD, a DICOM folder, or a tar, tar.xz or zip of a DICOM series.

    Raises:
        InputError: no such file, damaged, not one 3-D scalar image, NaN, constant, not in mm, or
            its header says that the patient is not prone.
    """
    path = Path(path)
    _check_exists("image", path)
    position: str | None = None
    warnings: tuple[str, ...] = ()
    with _silent("image", path):
        if path.is_dir():
            image, position, warnings = read_folder(path)
        elif is_archive(path):
            image, position, warnings = read_archive(path)
        else:
            image = _read_file("image", path)
    image = _pixels_and_geometry("image", path, image, sitk.sitkFloat32)
    _check_values(path, sitk.GetArrayViewFromImage(image))
    if position is None:
        warnings += ("The image does not say how the patient lies: prone is assumed.",)
    elif not position.endswith("P"):
        raise InputError(
            f"image {path.name} must be of a prone patient, got PatientPosition {position}: choose"
            " the prone series."
        )
    return Prone(image, position, warnings)


def read_labels(path: str | Path, like: sitk.Image) -> sitk.Image:
    """A label image (uint8) of `Tissue` codes, on the grid of `like` (nearest where it differs).

    Raises:
        InputError: as for `read_image`, or values that are no tissue, or no breast tissue.
    """
    path = Path(path)
    _check_exists("labels", path)
    with _silent("labels", path):
        raw = _read_file("labels", path)
    raw = _pixels_and_geometry("labels", path, raw, sitk.sitkFloat32)
    _check_codes(path, sitk.GetArrayViewFromImage(raw))
    labels: sitk.Image = sitk.Cast(raw, sitk.sitkUInt8)
    if not _same_grid(labels, like):
        labels = sitk.Resample(labels, like, sitk.Transform(), sitk.sitkNearestNeighbor, 0)
        if not np.isin(sitk.GetArrayViewFromImage(labels), BREAST).any():
            raise InputError(
                f"labels {path.name} must cover the image, got no breast tissue inside it: check"
                " that both have the same frame (LPS, mm)."
            )
    return labels


def _check_exists(name: str, path: Path) -> None:
    if not path.exists():
        raise InputError(f"{name} must be a file or folder, got {path}, which is not there.")


@contextmanager
def _silent(name: str, path: Path) -> Iterator[None]:
    """ITK's messages off, its exceptions turned into one sentence, its change of locale undone.

    GDCM leaves the process in the C locale, in which files opened later would be read as ASCII.
    """
    shown, characters = (
        sitk.ProcessObject.GetGlobalWarningDisplay(),
        locale.setlocale(locale.LC_CTYPE),
    )
    sitk.ProcessObject.SetGlobalWarningDisplay(False)
    try:
        yield
    except RuntimeError as error:
        lines = [line.strip() for line in str(error).splitlines() if line.strip()]
        cause = re.sub(r"^.*\(0x[0-9a-f]+\):\s*", "", lines[-1]) if lines else "no reason given"
        raise InputError(
            f"{name} must be a readable NIfTI, MHA/MHD, NRRD or DICOM series, got {path}"
            f" ({cause[:120]}): export it again."
        ) from None
    finally:
        sitk.ProcessObject.SetGlobalWarningDisplay(shown)
        locale.setlocale(locale.LC_CTYPE, characters)


def _read_file(name: str, path: Path) -> sitk.Image:
    """A single file of a format that ITK reads, if what it promises is on disk."""
    reader = sitk.ImageFileReader()
    reader.SetFileName(str(path))
    check_disk(name, path)
    reader.ReadImageInformation()
    size = reader.GetSize()
    if len([n for n in size if n > 1]) != 3 or reader.GetNumberOfComponents() != 1:
        raise InputError(
            f"{name} must be one 3-D image of one value per voxel, got {path.name} of"
            f" {' x '.join(map(str, size))} voxels and {reader.GetNumberOfComponents()}"
            " component(s): extract one volume."
        )
    image: sitk.Image = reader.Execute()
    return image


def _pixels_and_geometry(name: str, path: Path, image: sitk.Image, kind: int) -> sitk.Image:
    """A copy in three dimensions without metadata, its geometry checked."""
    if image.GetDimension() == 4:
        image = image[:, :, :, 0]
    _check_geometry(name, path, image)
    clean: sitk.Image = sitk.Cast(image, kind)
    for key in clean.GetMetaDataKeys():
        clean.EraseMetaData(key)
    return clean


def _check_geometry(name: str, path: Path, image: sitk.Image) -> None:
    spacing = np.array(image.GetSpacing())
    edges = spacing * image.GetSize()
    if (spacing < SPACING[0]).any() or (spacing > SPACING[1]).any() or edges.max() > FIELD[1]:
        raise InputError(_implausible(name, path, spacing, edges))
    if edges.min() < FIELD[0]:
        raise InputError(_implausible(name, path, spacing, edges))


def _implausible(name: str, path: Path, spacing: NDArray[Any], edges: NDArray[Any]) -> str:
    shown = " x ".join(f"{s:.3g}" for s in spacing)
    field = " x ".join(f"{e:.3g}" for e in edges)
    unit = " (metres?)" if spacing.max() < SPACING[0] else ""
    return (
        f"{name} must show {FIELD[0]:g} to {FIELD[1]:g} mm along each axis with voxels of"
        f" {SPACING[0]:g} to {SPACING[1]:g} mm, got {path.name} of {field} mm with voxels of"
        f" {shown} mm{unit}: correct the header's spacing or give an image of both breasts."
    )


def _check_values(path: Path, values: NDArray[Any]) -> None:
    if not np.isfinite(values).all():
        raise InputError(
            f"image must hold finite values, got {int((~np.isfinite(values)).sum())} NaN or"
            f" infinite voxels in {path.name}: replace them by 0 or export the image again."
        )
    if values.min() == values.max():
        raise InputError(
            f"image must show a patient, got {path.name} with the one value {values.max():g}:"
            " export it again."
        )


def _check_codes(path: Path, values: NDArray[Any]) -> None:
    known = {int(t): t.name.lower() for t in Tissue}
    found = np.unique(values[np.isfinite(values)]) if np.isnan(values).any() else np.unique(values)
    meaning = ", ".join(f"{code} {name}" for code, name in known.items())
    if unknown := [v for v in found if v not in known] or np.isnan(values).any():
        got = f"{unknown[:5]}" if isinstance(unknown, list) else "NaN"
        raise InputError(
            f"labels must hold {meaning}, got {got} in {path.name}: map them to these."
        )
    if not any(int(v) in BREAST for v in found):
        raise InputError(
            f"labels must hold breast tissue (1, 2 or 4), got {path.name} with only"
            f" {', '.join(known[int(v)] for v in found)}: label the breasts or leave labels out."
        )


def _same_grid(a: sitk.Image, b: sitk.Image) -> bool:
    return a.GetSize() == b.GetSize() and all(
        np.allclose(x, y, atol=1e-4)
        for x, y in (
            (a.GetSpacing(), b.GetSpacing()),
            (a.GetOrigin(), b.GetOrigin()),
            (a.GetDirection(), b.GetDirection()),
        )
    )
