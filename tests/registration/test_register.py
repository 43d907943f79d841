"""Registration of the procedural torso to scans of it, with the truth known."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from functools import lru_cache
from typing import Any

import numpy as np
import pytest

from supple.errors import InputError
from supple.registration.posture import posed
from supple.registration.procedural import torso
from supple.registration.register import RegisterSettings, register
from supple.registration.registration import Registration
from supple.registration.synthetic import POSES, SyntheticScan, random_posture, synthetic_scan
from supple.registration.template import Template
from supple.surface import Surface


@lru_cache(maxsize=1)
def _template() -> Template:
    return torso()


@lru_cache(maxsize=4)
def _scan(pose: Any = "standing", seed: int = 0, **options: Any) -> SyntheticScan:
    supine = {"view": "front", "press": 0.012} if pose == "supine" else {}
    given = {"points": 15_000, "noise": 2e-3} | supine | options
    return synthetic_scan(_template(), random_posture(_template(), pose, seed), seed, **given)


@lru_cache(maxsize=1)
def _found() -> Registration:
    return register(_scan().surface, _template())


def _off(found: Registration, scan: SyntheticScan) -> tuple[float, float]:
    """Mean distance (mm) of the true skin to the registered; of landmarks."""
    surface = float(found.skin.closest(scan.clean[scan.skin]).distance.mean())
    marks = [np.linalg.norm(found.landmarks[k] - v) for k, v in scan.truth.landmarks.items()]
    return 1e3 * surface, 1e3 * float(np.mean(marks))


def test_a_scan_is_registered_without_landmarks() -> None:
    """Turned by up to 45°, 2 mm of noise, 30 % missing, clutter: skin 1.2 mm, landmarks 6 mm."""
    surface, marks = _off(_found(), _scan())
    assert surface < 1.2
    assert marks < 6.0
    assert _found().surface_mae_mm < 2.5
    assert not _found().used[~_scan().skin].mean() > 0.5


def test_threads_may_register_scans_at_the_same_time() -> None:
    """Two scans and one template: each to the bits that it has alone."""
    scans = [_scan("standing", seed, points=6_000).surface for seed in (1000, 1001)]
    alone = [register(scan, _template()).points for scan in scans]
    with ThreadPoolExecutor(2) as pool:
        found = list(pool.map(lambda scan: register(scan, _template()).points, scans))
    assert all(np.array_equal(one, other) for one, other in zip(found, alone, strict=True))


def test_its_points_are_those_of_its_posture_and_offset() -> None:
    """What is stored is one thing: vertices, triangles, drawing, distances."""
    found = _found()
    again = posed(found.template, found.posture) + found.offset
    assert np.abs(again - found.points).max() < 1e-12
    assert found.sd.shape == (len(found.points),)
    assert (found.sd > 0).all()
    assert found.distance.shape == found.used.shape == (len(_scan().surface.points),)
    assert set(found.curves) == set(found.template.curves)
    assert found.seconds["total"] >= sum(v for k, v in found.seconds.items() if k != "total") - 1e-3


def test_the_answer_moves_with_the_scan() -> None:
    """A scan carried elsewhere by a quarter turn is registered as well there."""
    scan, R = _scan(), np.array([[0.0, 0, 1], [1, 0, 0], [0, 1, 0]])
    moved = Surface(scan.surface.points @ R.T + 3.0, scan.surface.triangles)
    found = register(moved, _template())
    back = Surface((found.points - 3.0) @ R, found.triangles)
    assert back.closest(scan.clean[scan.skin]).distance.mean() < 1.2e-3


def test_the_next_frame_starts_from_the_last() -> None:
    """5 mm and 1° on, the fit follows without a search."""
    scan, turn = _scan(), 0.02
    R = np.array([[np.cos(turn), -np.sin(turn), 0], [np.sin(turn), np.cos(turn), 0], [0, 0, 1]])
    middle = scan.surface.points.mean(axis=0)
    place = lambda x: (x - middle) @ R.T + middle + 3e-3  # noqa: E731
    moved = Surface(place(scan.surface.points), scan.surface.triangles)
    found = register(moved, _template(), start=_found().posture)
    assert found.skin.closest(place(scan.clean[scan.skin])).distance.mean() < 1.5e-3
    assert found.iterations <= 4


def test_landmarks_that_are_given_are_kept_to() -> None:
    """All twelve at their true places: they end within 5 mm on average."""
    marks = dict(_scan().truth.landmarks)
    found = register(_scan().surface, _template(), marks)
    assert _off(found, _scan())[1] < 5.0


def test_a_back_alone_is_not_trusted() -> None:
    """The half of a scan that faces backwards shows no breast."""
    scan = _scan(rotation=0.0, clutter=0.0)
    normals, middle = scan.surface.normals, scan.surface.points[scan.surface.triangles].mean(axis=1)
    back = (normals[:, 1] > 0.2) & (middle[:, 1] > np.median(middle[:, 1]))
    used, new = np.unique(scan.surface.triangles[back], return_inverse=True)
    found = register(Surface(scan.surface.points[used], new.reshape(-1, 3)), _template())
    assert not found.trustworthy
    assert any("breast" in warning for warning in found.warnings), found.warnings


def test_a_ball_is_no_torso() -> None:
    """A sphere of a torso's size is fitted badly, and that is said."""
    random = np.random.default_rng(0).normal(size=(4000, 3))
    ball = 0.22 * random / np.linalg.norm(random, axis=1, keepdims=True)
    assert not register(Surface(ball), _template()).trustworthy


def test_the_last_stage_can_be_left_out() -> None:
    """Without it the skin is exactly what bones and shapes make."""
    found = register(_scan().surface, _template(), settings=RegisterSettings(offset=None))
    assert not found.offset.any()
    assert found.offset_precision is None


def test_what_is_no_scan_is_refused() -> None:
    """Too few points; a body in millimetres; an unknown landmark."""
    few = Surface(np.random.default_rng(0).normal(size=(50, 3)))
    with pytest.raises(InputError, match="200"):
        register(few, _template())
    with pytest.raises(InputError, match="metres"):
        register(Surface(1e3 * _scan().surface.points), _template())
    with pytest.raises(InputError, match="landmark"):
        register(_scan().surface, _template(), {"elbow": (0, 0, 0)})


@lru_cache(maxsize=4)
def _three_fits(pose: str) -> list[tuple[SyntheticScan, Registration]]:
    """Three shapes in a pose, and what was found."""
    scans = [_scan(pose, 10 + seed, rotation=0.0 if pose == "tilted" else 45.0)
             for seed in range(3)]  # fmt: skip
    return [(scan, register(scan.surface, _template())) for scan in scans]


@pytest.mark.slow
@pytest.mark.parametrize("pose", POSES)
def test_no_pose_loses_the_skin(pose: str) -> None:
    """Within 2 mm on average; trusted or it says why."""
    for scan, found in _three_fits(pose):
        assert found.skin.closest(scan.clean[scan.skin]).distance.mean() < 2e-3
        assert found.trustworthy == (not found.warnings)


@pytest.mark.slow
@pytest.mark.parametrize("pose", POSES)
def test_no_pose_loses_a_landmark(pose: str) -> None:
    """Each within 20 mm."""
    for seed, (scan, found) in enumerate(_three_fits(pose)):
        apart = [np.linalg.norm(found.landmarks[k] - v) for k, v in scan.truth.landmarks.items()]
        assert max(apart) < 0.02, (pose, seed, max(apart))
