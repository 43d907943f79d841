"""A scan is thinned to the means of its voxels, and large sums are what small ones are."""

from __future__ import annotations

import numpy as np
import pytest

from supple.core import core
from supple.registration import procedural
from supple.registration.rig import Rig
from supple.surface import Surface

VOXEL = 0.01


def _sheet(count: int = 20_000) -> np.ndarray:
    """Points (count, 3) m of a flat sheet, whose voxels' means lie on it too."""
    flat = np.random.default_rng(5).random((count, 2)) * [0.31, 0.53]
    return np.column_stack([flat[:, 0], flat[:, 1], 0.2 + 0.5 * flat[:, 0]])


def _thinned(points: np.ndarray) -> np.ndarray:
    rig = Rig(procedural.torso())
    rig.set_scan(Surface(points), voxel=VOXEL)
    return _sorted(np.asarray(rig.cloud.points))


def _sorted(points: np.ndarray) -> np.ndarray:
    return points[np.lexsort(np.round(points, 9).T)]


def _means(points: np.ndarray) -> np.ndarray:
    cell = np.floor((points - points.min(axis=0)) / VOXEL).astype(int)
    _, of, count = np.unique(cell, axis=0, return_inverse=True, return_counts=True)
    sums = np.stack([np.bincount(of.ravel(), points[:, d]) for d in range(3)], axis=1)
    return _sorted(sums / count[:, None])


@pytest.mark.parametrize("far", [0.0, 40.0])
def test_thinned_points_are_the_means_of_voxels_however_far_a_scan_reaches(far: float) -> None:
    """Those that NumPy takes over cells of a grid, with voxels in a table and looked up."""
    points = _sheet()
    if far:  # so many voxels that they are looked up, not counted off
        points = np.vstack([points, points[:500] + far])
    assert np.allclose(_thinned(points), _means(points), rtol=0, atol=1e-9)


def test_a_scan_may_lie_anywhere_in_memory() -> None:
    """By rows, by columns and cut out of a wider array: the same cloud to the bit."""
    points = _sheet(5_000)
    rig, wide = Rig(procedural.torso()), np.zeros((len(points), 5))
    wide[:, 1:4] = points
    clouds = []
    for given in (points, np.asfortranarray(points), wide[:, 1:4]):
        rig._fit.set_scan(given, np.empty((0, 3), dtype=np.int32), np.empty((0, 3)), VOXEL, True, 0)
        clouds.append(np.asarray(rig.cloud.points))
    assert np.array_equal(clouds[0], clouds[1])
    assert np.array_equal(clouds[0], clouds[2])


def test_triangles_and_points_may_be_of_any_kind_of_number() -> None:
    """Numbers that float32 holds, and triangles of int32, by columns or cut out: the same cloud."""
    skin = procedural.torso()
    points, faces = skin.points.astype(np.float32), skin.triangles
    wide = np.zeros((len(faces), 4), dtype=np.int32)
    wide[:, :3] = faces
    rig, clouds = Rig(skin), []
    for xyz, ids in (
        (points.astype(np.float64), faces),
        (points, faces.astype(np.int32)),
        (np.asfortranarray(points), np.asfortranarray(faces)),
        (np.repeat(points, 2, axis=0)[::2], wide[:, :3]),
    ):
        rig._fit.set_scan(xyz, ids, np.empty((0, 3)), VOXEL, True, 0)
        clouds.append((rig.cloud.points.copy(), rig.cloud.normals.copy()))
    for cloud in clouds[1:]:
        assert all(np.array_equal(a, b) for a, b in zip(cloud, clouds[0], strict=True))


@pytest.mark.parametrize("size", [1, 47, 48, 49, 131])
def test_inverse_and_covariance_are_those_of_linear_algebra(size: int) -> None:
    """(D + P)⁻¹ = X and X (f D + P) X by LAPACK, at sizes about the blocks' of the core."""
    random = np.random.default_rng(size)
    root = random.normal(size=(size, size))
    data, prior = root @ root.T, np.diag(0.5 + random.random(size))
    inverse = np.linalg.inv(data + prior)
    found = core().inverse_sum(data, prior)
    assert np.allclose(found, inverse, rtol=1e-9, atol=1e-12)
    wanted = inverse @ (1.7 * data + prior) @ inverse
    assert np.allclose(core().inflated(found, prior, 1.7), wanted, rtol=1e-8, atol=1e-11)
