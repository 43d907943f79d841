"""Reading images: what comes in is what was written, and nothing else; each fault is one sentence.

Independent answers: images made here voxel by voxel, written with SimpleITK, damaged on purpose.
"""

from __future__ import annotations

import gzip
import io
import locale
import tarfile
import zipfile
from pathlib import Path

import numpy as np
import pytest
import SimpleITK as sitk

from supple.breast.image import read_image, read_labels
from supple.errors import InputError

SHARED = Path(__file__).resolve().parents[3] / "shared" / "data"
#: Columns are the directions of a sagittal acquisition: slices run right to left.
SAGITTAL = (0.0, 0.0, -1.0, 1.0, 0.0, 0.0, 0.0, -1.0, 0.0)
#: Hounsfield-free noise that every test may spoil: (z, y, x).
VALUES = np.random.default_rng(0).integers(1, 900, (36, 40, 44)).astype(np.int16)


def make(values=VALUES, spacing=(2.0, 2.5, 3.0), direction=SAGITTAL):
    image = sitk.GetImageFromArray(values)
    image.SetSpacing(spacing)
    image.SetOrigin((140.0, -120.0, 90.0))
    image.SetDirection(direction)
    return image


def write(image, path):
    sitk.WriteImage(image, str(path))
    return path


def write_dicom(folder: Path, slices=30, series="1.2.3.4", position="HFP"):
    """An axial series with a patient's name in it; slice k is k + 1 everywhere but one voxel."""
    folder.mkdir(parents=True, exist_ok=True)
    writer = sitk.ImageFileWriter()
    writer.KeepOriginalImageUIDOn()
    for k in range(slices):
        values = np.full((1, 40, 44), k + 1, np.int16)
        values[0, 3, 5] = 1000
        image = sitk.GetImageFromArray(values)
        image.SetSpacing((2.0, 2.0, 4.0))
        tags = {
            "0008|0008": "ORIGINAL\\PRIMARY",
            "0008|0060": "MR",
            "0010|0010": "Doe^Jane",
            "0010|0020": "SECRET-42",
            "0018|5100": position,
            "0018|0050": "4",
            "0020|000d": "1.2.3",
            "0020|000e": series,
            "0020|0032": f"-50\\-60\\{4.0 * k}",
            "0020|0037": "1\\0\\0\\0\\1\\0",
            "0020|0013": str(k + 1),
            "0008|0018": f"{series}.{k + 1}",
        }
        for tag, value in tags.items():
            image.SetMetaData(tag, value)
        writer.SetFileName(str(folder / f"{series}_{k:03}.dcm"))
        writer.Execute(image)
    return folder


def assert_sentence(error, *words):
    text = str(error.value)
    assert "\n" not in text
    assert text.endswith(".")
    for word in words:
        assert word in text, text


@pytest.mark.parametrize("suffix", [".nii", ".nii.gz", ".mha", ".mhd", ".nrrd"])
def test_pixels_and_geometry_survive_every_format(tmp_path, capfd, suffix):
    """A voxel's value and its place in LPS mm are those that were written; nothing is printed."""
    source = make()
    prone = read_image(write(source, tmp_path / f"image{suffix}"))
    assert prone.image.GetPixelID() == sitk.sitkFloat32
    assert np.array_equal(sitk.GetArrayFromImage(prone.image), VALUES)
    for index in ((0, 0, 0), (43, 0, 7), (11, 39, 35)):
        place = source.TransformIndexToPhysicalPoint(index)
        assert np.allclose(prone.image.TransformIndexToPhysicalPoint(index), place, atol=1e-3)
    assert prone.position is None
    assert "prone is assumed" in prone.warnings[0]
    assert capfd.readouterr() == ("", "")


def test_dicom_folder_gives_pixels_position_and_no_tag(tmp_path, capfd):
    """A series comes in slice order with its geometry; no tag of the file is in the image."""
    prone = read_image(write_dicom(tmp_path / "series"))
    array = sitk.GetArrayFromImage(prone.image)
    assert array.shape == (30, 40, 44)
    assert np.array_equal(array[:, 0, 0], np.arange(1, 31))
    assert prone.image.GetSpacing() == pytest.approx((2.0, 2.0, 4.0))
    assert prone.image.GetOrigin() == pytest.approx((-50.0, -60.0, 0.0))
    assert prone.position == "HFP"
    assert prone.image.GetMetaDataKeys() == ()
    assert prone.warnings == ()
    sitk.WriteImage(prone.image, str(tmp_path / "out.mha"))
    assert b"Doe" not in (tmp_path / "out.mha").read_bytes()
    assert capfd.readouterr() == ("", "")


def test_reading_dicom_leaves_the_locale_as_it_was(tmp_path):
    """GDCM sets the C locale; files opened afterwards must not turn to ASCII."""
    folder = write_dicom(tmp_path / "series")
    locale.setlocale(locale.LC_CTYPE, "C.UTF-8")
    read_image(folder)
    assert locale.setlocale(locale.LC_CTYPE) == "C.UTF-8"


def test_largest_of_several_series_is_taken_and_said(tmp_path):
    """Of series with 12 and 30 slices the one with 30 is read, and a warning says so."""
    write_dicom(tmp_path / "d", slices=12, series="1.2.3.9")
    prone = read_image(write_dicom(tmp_path / "d", slices=30))
    assert prone.image.GetSize()[2] == 30
    assert "largest of 2" in prone.warnings[0]


def test_missing_slice_is_refused(tmp_path):
    """One slice out of 30 removed: distances no longer agree, and no image is made up."""
    folder = write_dicom(tmp_path / "series")
    (folder / "1.2.3.4_014.dcm").unlink()
    with pytest.raises(InputError) as error:
        read_image(folder)
    assert_sentence(error, "missing")


def test_archives_equal_the_folder(tmp_path):
    """tar.xz, tar and zip of a series hold the same image as its folder."""
    folder = write_dicom(tmp_path / "series")
    expected = sitk.GetArrayFromImage(read_image(folder).image)
    with zipfile.ZipFile(tmp_path / "s.zip", "w") as archive:
        for file in folder.iterdir():
            archive.write(file, f"series/{file.name}")
    for name, mode in (("s.tar", "w"), ("s.tar.xz", "w:xz")):
        with tarfile.open(tmp_path / name, mode) as archive:
            archive.add(folder, "series")
    for name in ("s.zip", "s.tar", "s.tar.xz"):
        prone = read_image(tmp_path / name)
        assert np.array_equal(sitk.GetArrayFromImage(prone.image), expected), name
        assert prone.position == "HFP"


def test_archive_that_leaves_its_folder_is_refused(tmp_path):
    """A tar with a member ../../evil writes nothing outside and is an InputError."""
    with tarfile.open(tmp_path / "s.tar", "w") as archive:
        member = tarfile.TarInfo("../../supple_evil")
        member.size = 4
        archive.addfile(member, io.BytesIO(b"evil"))
    with pytest.raises(InputError) as error:
        read_image(tmp_path / "s.tar")
    assert_sentence(error, "archive")


def test_supine_series_is_refused(tmp_path):
    """PatientPosition HFS: the patient lies on her back."""
    with pytest.raises(InputError) as error:
        read_image(write_dicom(tmp_path / "series", position="HFS"))
    assert_sentence(error, "HFS", "prone")


def test_missing_file_and_empty_folder(tmp_path):
    """Neither exists as an image; each says what to give."""
    with pytest.raises(InputError) as error:
        read_image(tmp_path / "nothing.nii")
    assert_sentence(error, "not there")
    (tmp_path / "empty").mkdir()
    with pytest.raises(InputError) as error:
        read_image(tmp_path / "empty")
    assert_sentence(error, "DICOM")


@pytest.mark.parametrize("suffix", [".nii", ".nii.gz", ".mha", ".nrrd"])
def test_truncated_file_is_refused(tmp_path, capfd, suffix):
    """Two thirds of a file's bytes are no image, whatever ITK would make of them."""
    path = write(make(), tmp_path / f"image{suffix}")
    path.write_bytes(path.read_bytes()[: path.stat().st_size * 2 // 3])
    with pytest.raises(InputError) as error:
        read_image(path)
    assert_sentence(error, "export it again")
    assert capfd.readouterr() == ("", "")


def test_shortened_then_packed_nifti_is_refused(tmp_path):
    """A sound gzip stream around too few bytes is truncated too: bytes are counted unpacked."""
    raw = write(make(), tmp_path / "image.nii").read_bytes()
    (tmp_path / "short.nii.gz").write_bytes(gzip.compress(raw[:-2000]))
    with pytest.raises(InputError) as error:
        read_image(tmp_path / "short.nii.gz")
    assert_sentence(error, "truncated", str(len(raw)), str(len(raw) - 2000))


def test_gzip_in_disguise_is_named():
    """VICTRE's header says uncompressed, its file is gzip."""
    path = SHARED / "phantom_victre" / "p_1.mhd"
    if not path.exists():
        pytest.skip("shared data are absent")
    with pytest.raises(InputError) as error:
        read_image(path)
    assert_sentence(error, "gzip", "gunzip")


@pytest.mark.parametrize(
    ("image", "word"),
    [
        (sitk.GetImageFromArray(VALUES[0]), "3-D"),
        (sitk.JoinSeries([make(), make()]), "3-D"),
        (sitk.GetImageFromArray(np.stack([VALUES] * 3, -1), isVector=True), "component"),
        (make(np.where(VALUES == 7, np.nan, VALUES).astype(np.float32)), "NaN"),
        (make(np.full_like(VALUES, 5)), "one value"),
        (make(spacing=(0.002, 0.0025, 0.003)), "metres"),
        (make(spacing=(2000.0, 2500.0, 3000.0)), "mm"),
        (make(VALUES[:10]), "mm"),
    ],
    ids=["2-D", "4-D", "vector", "nan", "constant", "metres", "micrometres", "slab"],
)
def test_unusable_image_is_refused(tmp_path, capfd, image, word):
    """What is not one 3-D scalar image of a torso in mm is refused with the reason."""
    with pytest.raises(InputError) as error:
        read_image(write(image, tmp_path / "image.mha"))
    assert_sentence(error, word)
    assert capfd.readouterr() == ("", "")


def test_other_file_is_refused(tmp_path):
    """A text file is no image."""
    (tmp_path / "notes.txt").write_text("not an image")
    with pytest.raises(InputError) as error:
        read_image(tmp_path / "notes.txt")
    assert_sentence(error, ".nii", "notes.txt")


def label_values():
    values = np.zeros(VALUES.shape, np.uint8)
    values[:, 20:] = 3
    values[10:26, 10:20, 10:30] = 1
    values[14:20, 12:18, 15:22] = 2
    return values


def test_labels_on_the_image_grid_are_kept(tmp_path):
    """Same geometry: voxel for voxel what was written, uint8."""
    path = write(make(label_values()), tmp_path / "labels.nii.gz")
    labels = read_labels(path, make())
    assert labels.GetPixelID() == sitk.sitkUInt8
    assert np.array_equal(sitk.GetArrayFromImage(labels), label_values())


def test_labels_on_another_grid_keep_their_place(tmp_path):
    """Labels at half the voxel size, other axes: each image voxel gets the code at its centre."""
    source = make(label_values())
    fine = sitk.Resample(
        source, (200, 260, 240), sitk.Transform(), sitk.sitkNearestNeighbor,
        (10.0, -130.0, -10.0), (0.7, 0.7, 0.7), (1, 0, 0, 0, 1, 0, 0, 0, 1), 0,
    )  # fmt: skip
    labels = read_labels(write(fine, tmp_path / "labels.mha"), make())
    got, expected = sitk.GetArrayFromImage(labels), label_values()
    assert np.mean(got != expected) < 0.01
    assert labels.GetDirection() == SAGITTAL


@pytest.mark.parametrize(
    ("values", "word"),
    [
        (np.zeros_like(VALUES), "breast tissue"),
        (label_values() * 7, "7"),
        (label_values() * 0.5, "0.5"),
    ],
    ids=["empty", "unknown", "fraction"],
)
def test_wrong_labels_are_refused(tmp_path, values, word):
    """Only codes of tissues, and some breast among them."""
    with pytest.raises(InputError) as error:
        read_labels(write(make(values), tmp_path / "labels.mha"), make())
    assert_sentence(error, word)


def test_labels_elsewhere_are_refused(tmp_path):
    """Labels a metre away from the image cover none of it."""
    image = make(label_values())
    image.SetOrigin((1140.0, -120.0, 90.0))
    with pytest.raises(InputError) as error:
        read_labels(write(image, tmp_path / "labels.mha"), make())
    assert_sentence(error, "frame")
