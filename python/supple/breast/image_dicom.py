"""DICOM series from a folder or an archive: pixels, geometry and how the patient lies."""

from __future__ import annotations

import lzma
import tarfile
import tempfile
import zipfile
from pathlib import Path

import numpy as np
import SimpleITK as sitk

from supple.errors import InputError

_ARCHIVES = (".tar", ".tar.xz", ".txz", ".tar.gz", ".tgz", ".zip")
_POSITION = "0018|5100"
_POSITIONS = ("HFP", "FFP", "HFS", "FFS", "HFDR", "FFDR", "HFDL", "FFDL")
#: Refuse to unpack more than this, bytes.
_MOST = 8 << 30

Series = tuple[sitk.Image, str | None, tuple[str, ...]]


def is_archive(path: Path) -> bool:
    """Whether the name is that of a tar or zip."""
    return path.name.lower().endswith(_ARCHIVES)


def read_archive(path: Path) -> Series:
    """The largest series in a tar or zip, unpacked in a temporary folder."""
    with tempfile.TemporaryDirectory(prefix="supple-") as folder:
        try:
            _unpack(path, folder)
        except (tarfile.TarError, zipfile.BadZipFile, lzma.LZMAError, EOFError, OSError) as error:
            raise InputError(
                f"image must be a whole archive of a DICOM series, got {path.name} ({error}): copy"
                " or pack it again."
            ) from None
        return read_folder(Path(folder), path.name)


def read_folder(folder: Path, name: str | None = None) -> Series:
    """The series with most slices in a folder or below it; the others are named in a warning.

    Raises:
        InputError: no DICOM image, a single slice, or slices missing between others.
    """
    name = name or folder.name
    series = [files for place in _folders(folder) for files in _series_in(place)]
    if not series:
        raise InputError(
            f"image must be a folder with a DICOM series, got {name} without one: give the folder"
            " of the slices, or convert them to NIfTI."
        )
    files = max(series, key=len)
    if len(files) < 2:
        raise InputError(
            f"image must be a DICOM series of slices, got {name} with a single one: give the whole"
            " series."
        )
    image = _stack(files, name)
    return image, _position(files[0]), _chosen(series, files)


def _unpack(path: Path, folder: str) -> None:
    if path.name.lower().endswith(".zip"):
        with zipfile.ZipFile(path) as archive:
            _check_size(path, sum(item.file_size for item in archive.infolist()))
            archive.extractall(folder)
        return
    with tarfile.open(path) as archive:
        _check_size(path, sum(item.size for item in archive.getmembers()))
        archive.extractall(folder, filter="data")


def _check_size(path: Path, size: int) -> None:
    if size > _MOST:
        raise InputError(
            f"image must unpack to less than {_MOST >> 30} GiB, got {size >> 30} GiB in"
            f" {path.name}: give the series alone."
        )


def _folders(folder: Path) -> list[Path]:
    return [folder, *sorted(p for p in folder.rglob("*") if p.is_dir())]


def _series_in(folder: Path) -> list[tuple[str, ...]]:
    reader = sitk.ImageSeriesReader
    return [
        tuple(reader.GetGDCMSeriesFileNames(str(folder), uid))
        for uid in reader.GetGDCMSeriesIDs(str(folder))
    ]


def _stack(files: tuple[str, ...], name: str) -> sitk.Image:
    """The slices as one image; ITK takes one distance for all, so a missing slice is refused."""
    reader = sitk.ImageSeriesReader()
    reader.SetFileNames(files)
    image: sitk.Image = reader.Execute()
    places = np.array([_header(file).GetOrigin() for file in files])
    steps = np.linalg.norm(np.diff(places, axis=0), axis=1)
    if steps.size and np.ptp(steps) > 0.1 * np.median(steps):
        raise InputError(
            f"image must be a whole DICOM series, got {name}, whose slices lie {steps.min():.3g} to"
            f" {steps.max():.3g} mm apart: add the missing slices."
        )
    return image


def _header(file: str) -> sitk.ImageFileReader:
    reader = sitk.ImageFileReader()
    reader.SetFileName(file)
    reader.ReadImageInformation()
    return reader


def _position(file: str) -> str | None:
    """PatientPosition, if it is one of the standard's words (PS3.3 C.7.3.1.1.2)."""
    reader = _header(file)
    value = reader.GetMetaData(_POSITION).strip() if reader.HasMetaDataKey(_POSITION) else ""
    return value if value in _POSITIONS else None


def _chosen(series: list[tuple[str, ...]], files: tuple[str, ...]) -> tuple[str, ...]:
    if len(series) == 1:
        return ()
    return (f"The largest of {len(series)} DICOM series is used, with {len(files)} slices.",)
