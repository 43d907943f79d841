"""Segmentation against bodies whose tissue is known at every point from a formula.

The body: an elliptic thorax with lung inside a muscular wall, a layer of fat around it, two
half-ellipsoidal breasts that hang towards -y, each with an ellipsoid of gland and a nipple.
Signals are those of T1-weighted MRI with and without fat suppression, with fall-off and noise.
"""

from __future__ import annotations

import time
from functools import cache
from pathlib import Path

import numpy as np
import pytest
import SimpleITK as sitk

from supple.breast.image import read_image
from supple.breast.segment import segment
from supple.breast.tissues import Tissue
from supple.errors import InputError

MRI = Path(__file__).resolve().parents[3] / "shared" / "data" / "mri_mimbcd"
#: Centre x and semi-axes x, y, z of each breast; y of its base; mm.
BREASTS = ((-75.0, (50.0, 95.0, 65.0)), (72.0, (48.0, 90.0, 62.0)))
BASE = -20.0
#: Semi-axes x, y of the skin around the thorax, of the wall and of the lung; y of their axis.
SKIN, WALL, LUNG, AXIS = (150.0, 100.0), (135.0, 87.0), (120.0, 72.0), 60.0
SIGNALS = {
    "bright fat": {"air": 0, "fat": 800, "gland": 300, "muscle": 260, "lung": 40, "rim": 400},
    "fat-suppressed": {"air": 0, "fat": 260, "gland": 480, "muscle": 400, "lung": 60, "rim": 450},
}
AXIAL = np.eye(3)
#: Columns: the directions of rows, columns and slices of a sagittal acquisition.
SAGITTAL = np.array([[0.0, 0.0, -1.0], [1.0, 0.0, 0.0], [0.0, -1.0, 0.0]])


def ellipse(x, y, axes):
    return (x / axes[0]) ** 2 + ((y - AXIS) / axes[1]) ** 2


def nipple(side):
    x, (_, depth, _) = BREASTS[side]
    return np.array([x, BASE - depth, 0.0])


def tissue(x, y, z):
    """Names' indices: 0 air, 1 fat, 2 gland, 3 muscle, 4 lung, 5 rim (skin of 2 mm)."""

    shape = np.broadcast_shapes(x.shape, y.shape, z.shape)

    def body(grow):
        inside = np.broadcast_to(ellipse(x, y, (SKIN[0] + grow, SKIN[1] + grow)) < 1, shape).copy()
        for side, (cx, axes) in enumerate(BREASTS):
            a, b, c = (s + grow for s in axes)
            inside |= (((x - cx) / a) ** 2 + ((y - BASE) / b) ** 2 + (z / c) ** 2 < 1) & (y < BASE)
            inside |= (((x - cx) / a) ** 2 + (z / c) ** 2 < 1) & (y >= BASE) & (y < AXIS)
            tip = nipple(side)
            inside |= (x - tip[0]) ** 2 + (y - tip[1]) ** 2 + (z - tip[2]) ** 2 < (6.0 + grow) ** 2
        return inside

    code = np.zeros(shape, np.uint8)
    code[body(0.0)] = 5
    code[body(-2.0)] = 1
    for cx, (a, b, c) in BREASTS:
        at = ((x - cx) / a) ** 2 + ((y - BASE + 0.5 * b) / (0.6 * b)) ** 2 + (z / c) ** 2
        code[at < 0.36] = 2
    code[np.broadcast_to(ellipse(x, y, WALL) < 1, code.shape)] = 3
    code[np.broadcast_to(ellipse(x, y, LUNG) < 1, code.shape)] = 4
    return code


@cache
def patient(contrast, sagittal=False, turn=0):
    """An image; `turn` = 2 puts the breasts at +y, as a wrong header does."""
    spacing = np.array([1.5, 1.5, 2.5])
    direction = SAGITTAL if sagittal else AXIAL
    low, high = np.array([-165.0, -135.0, -100.0]), np.array([165.0, 90.0, 100.0])
    start = np.where(direction.sum(axis=1) > 0, low, high)
    size = np.round(np.abs(direction.T @ (high - low)) / spacing).astype(int)
    index = np.meshgrid(*(np.arange(n) for n in size[::-1]), indexing="ij", sparse=True)[::-1]
    x, y, z = (
        start[i] + sum(direction[i, j] * spacing[j] * index[j] for j in range(3) if direction[i, j])
        for i in range(3)
    )
    code = tissue(x, y, z)
    values = np.array(list(SIGNALS[contrast].values()), np.float32)[code]
    values = values * np.exp(-(y + 40) / 250).astype(np.float32)
    rng = np.random.default_rng(3)
    noise = rng.standard_normal((2, *values.shape), np.float32) * 8
    image = sitk.GetImageFromArray(np.hypot(values + noise[0], noise[1]))
    image.SetSpacing(spacing.tolist())
    if turn:
        image = sitk.Flip(image, (False, True, False))
        image.SetDirection(np.eye(3).ravel().tolist())
    else:
        image.SetDirection(direction.ravel().tolist())
    image.SetOrigin(start.tolist())
    return image


@cache
def result(contrast, sagittal=False):
    return segment(patient(contrast, sagittal))


def truth(labels):
    """Tissue codes of the formula at the voxels of a label image, and their coordinates."""
    axes = [labels.GetOrigin()[i] + labels.GetSpacing()[i] * np.arange(n)
            for i, n in enumerate(labels.GetSize())]  # fmt: skip
    z, y, x = np.meshgrid(*axes[::-1], indexing="ij", sparse=True)
    codes = np.array([0, 1, 2, 3, 3, 1], np.uint8)[tissue(x, y, z)]
    return codes, np.broadcast_arrays(x, y, z)


def dice(a, b):
    return 2 * (a & b).sum() / (a.sum() + b.sum())


@pytest.mark.parametrize("sagittal", [False, True], ids=["axial", "sagittal"])
@pytest.mark.parametrize("contrast", list(SIGNALS))
def test_body_and_chest_are_those_of_the_formula(contrast, sagittal):
    """Breasts and chest wall agree with the known body, whatever contrast and voxel axes."""
    labels = result(contrast, sagittal).labels
    found = sitk.GetArrayFromImage(labels)
    known, (_, y, z) = truth(labels)
    front = (y < 30) & (np.abs(z) < 90)
    assert dice((found > 0) & front, (known > 0) & front) > 0.985
    assert dice((found == Tissue.CHEST) & front, (known == Tissue.CHEST) & front) > 0.96
    breast = (known > 0) & (known != Tissue.CHEST) & (y < -45)
    assert abs(((found > 0) & (y < -45)).sum() / breast.sum() - 1) < 0.03


@pytest.mark.parametrize("contrast", list(SIGNALS))
def test_surfaces_lie_within_a_voxel(contrast):
    """Skin: 95 % within a voxel (2 mm), bias at most a quarter of it; 95 % of the wall: 4 mm."""
    labels = result(contrast).labels
    found = sitk.GetArrayFromImage(labels)
    known, (x, y, z) = truth(labels)
    from scipy import ndimage

    def distance(mask):
        inner = ndimage.distance_transform_edt(mask, sampling=2.0)
        return np.where(
            mask, inner - 1.0, 1.0 - ndimage.distance_transform_edt(~mask, sampling=2.0)
        )

    near = (y < -25) & (np.abs(z) < 90)
    inside = distance(known > 0)[rim(found > 0) & near]
    outside = distance(known > 0)[rim(found == 0) & near]
    assert np.percentile(np.abs(inside), 95) <= 2.0
    assert abs(0.5 * (inside.mean() + outside.mean())) <= 0.5
    behind = (np.abs(x) < 110) & (np.abs(z) < 60) & (y < 40)
    wall = distance(known == Tissue.CHEST)[rim(found == Tissue.CHEST) & behind]
    assert np.percentile(np.abs(wall), 95) <= 4.0


def rim(mask):
    from scipy import ndimage

    return mask & ~ndimage.binary_erosion(mask, border_value=1)


def test_gland_is_found_where_fat_is_bright():
    """Gland overlaps with the ellipsoids that it was drawn from."""
    done = result("bright fat")
    found = sitk.GetArrayFromImage(done.labels)
    known, (_, y, _) = truth(done.labels)
    assert done.tissues_told_apart
    assert dice((found == Tissue.GLAND) & (y < -25), (known == Tissue.GLAND) & (y < -25)) > 0.9


def test_suppressed_fat_is_one_tissue_and_said_to_be():
    """No gland label, and a warning with the reason."""
    done = result("fat-suppressed")
    assert not done.tissues_told_apart
    assert not (sitk.GetArrayFromImage(done.labels) == Tissue.GLAND).any()
    assert any("fat is suppressed" in text for text in done.warnings)


@pytest.mark.parametrize("contrast", list(SIGNALS))
def test_nipples_are_at_the_tips(contrast):
    """Right first, then left, each within 8 mm of the bump that was drawn; they are estimates."""
    done = result(contrast)
    for side, found in enumerate(done.nipples_mm):
        assert np.linalg.norm(np.array(found) - nipple(side) + [0.0, 6.0, 0.0]) < 8.0, side
    assert any("nipples are estimated" in text for text in done.warnings)


def test_breasts_at_the_back_are_refused():
    """The same body turned by its header, breasts towards +y: refused, with the direction named."""
    with pytest.raises(InputError, match="orientation"):
        segment(patient("bright fat", turn=2))


def test_body_without_breasts_is_refused():
    """A thorax alone: nothing hangs, and the message asks whether the patient is prone."""
    image = patient("bright fat")
    array = sitk.GetArrayFromImage(image).copy()
    y = image.GetOrigin()[1] + 1.5 * np.arange(array.shape[1])
    array[:, y < AXIS - SKIN[1]] = 5.0
    x = image.GetOrigin()[0] + 1.5 * np.arange(array.shape[2])
    array[:, ellipse(x[None, :], y[:, None], SKIN) > 1] = 5.0
    flat = sitk.GetImageFromArray(array)
    flat.CopyInformation(image)
    with pytest.raises(InputError, match="prone"):
        segment(flat)


def test_seeds_move_the_wall_and_grow_gland():
    """CHEST in front of the wall pulls it there; GLAND seeds label bright tissue by hand."""
    place = (72.0, -45.0, 0.0)
    plain = result("fat-suppressed").labels
    assert plain[plain.TransformPhysicalPointToIndex(place)] == Tissue.FAT
    done = segment(patient("fat-suppressed"), {Tissue.CHEST: [place]})
    assert done.labels[done.labels.TransformPhysicalPointToIndex(place)] == Tissue.CHEST
    middle = (72.0, BASE - 45.0, 0.0)
    done = segment(patient("fat-suppressed"), {Tissue.GLAND: [middle]})
    found = sitk.GetArrayFromImage(done.labels)
    known, (x, y, _) = truth(done.labels)
    left = (x > 10) & (y < -25)
    assert done.tissues_told_apart
    assert dice((found == Tissue.GLAND) & left, (known == Tissue.GLAND) & left) > 0.8


@pytest.mark.parametrize(
    "seeds", [{Tissue.FAT: [(900.0, 0.0, 0.0)]}, {Tissue.FAT: [(0.0, 0.0)]}, {9: [(0.0, 0.0, 0.0)]}]
)
def test_wrong_seeds_are_refused(seeds):
    """Outside of the image, not three numbers, no such tissue: a sentence that says so."""
    with pytest.raises(InputError, match=r"seeds .*must be"):
        segment(patient("bright fat"), seeds)


REAL = {
    "uta11_69b91dc2_prone_T1tse_nonFS.nii.gz": (True, None),
    "uta4_case3_prone_T1.nii.gz": (False, None),
    "uta4_case1_dicom_scrubbed.tar.xz": (False, "HFP"),
}


@pytest.mark.slow
@pytest.mark.parametrize("name", list(REAL))
def test_real_prone_images_need_no_hand(name):
    """Breasts hang in front of the chest, alike in size left and right, the wall mostly seen."""
    if not (MRI / name).exists():
        pytest.skip("shared data are absent")
    told_apart, position = REAL[name]
    prone = read_image(MRI / name)
    start = time.process_time()
    done = segment(prone.image)
    assert time.process_time() - start < 40
    assert prone.position == position
    assert done.tissues_told_apart == told_apart
    assert done.chest_seen > 0.5
    found = sitk.GetArrayFromImage(done.labels)
    origin, h = np.array(done.labels.GetOrigin()), done.labels.GetSpacing()[0]
    right, left = (np.array(tip) for tip in done.nipples_mm)
    assert 80 < left[0] - right[0] < 250
    assert np.abs(left - right)[1:].max() < 45
    middle = 0.5 * (right[0] + left[0])
    x = origin[0] + h * np.arange(found.shape[2])
    chest = np.argwhere(found == Tissue.CHEST)
    sternum = origin[1] + h * np.percentile(chest[:, 1], 1)
    breast = (found > 0) & (found != Tissue.CHEST)
    breast &= (origin[1] + h * np.arange(found.shape[1]) < sternum)[None, :, None]
    sides = [breast[..., side].sum() * h**3 / 1e3 for side in (x < middle, x >= middle)]
    assert 200 < min(sides) < max(sides) < 4000, sides
    assert max(sides) < 1.4 * min(sides), sides
