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
    points = _sheet()
    if far:  # so many voxels that they are looked up, not counted off
        points = np.vstack([points, points[:500] + far])
    assert np.allclose(_thinned(points), _means(points), rtol=0, atol=1e-9)


def test_a_scan_may_lie_anywhere_in_memory() -> None:
    points = _sheet(5_000)
    rig, wide = Rig(procedural.torso()), np.zeros((len(points), 5))
    wide[:, 1:4] = points
    clouds = []
    for given in (points, np.asfortranarray(points), wide[:, 1:4]):
        rig._fit.set_scan(given, np.empty((0, 3), dtype=np.int32), np.empty((0, 3)), VOXEL, True, 0)
        clouds.append(np.asarray(rig.cloud.points))
    assert np.array_equal(clouds[0], clouds[1])
    assert np.array_equal(clouds[0], clouds[2])


@pytest.mark.parametrize("size", [1, 47, 48, 49, 131])
def test_inverse_and_covariance_are_those_of_linear_algebra(size: int) -> None:
    random = np.random.default_rng(size)
    root = random.normal(size=(size, size))
    data, prior = root @ root.T, np.diag(0.5 + random.random(size))
    inverse = np.linalg.inv(data + prior)
    found = core().inverse_sum(data, prior)
    assert np.allclose(found, inverse, rtol=1e-9, atol=1e-12)
    wanted = inverse @ (1.7 * data + prior) @ inverse
    assert np.allclose(core().inflated(found, prior, 1.7), wanted, rtol=1e-8, atol=1e-11)
