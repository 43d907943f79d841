"""Landmarks from shape alone, against marks set by others and bodies whose marks are known."""

from __future__ import annotations

import time

import numpy as np
import pytest

from supple.registration.auto_landmarks import propose
from supple.registration.height_map import curvatures, seen_along
from supple.registration.midline import FRONT, square_up
from supple.registration.posture import posed
from supple.registration.procedural import torso
from supple.registration.refine_landmarks import refine
from supple.registration.synthetic import random_posture
from supple.surface import Surface

SIDES = ("left", "right")


def turn(degrees, axis):
    """Rotation (3, 3) about ``axis`` (Rodrigues)."""
    a = np.asarray(axis, dtype=float) / np.linalg.norm(axis)
    K = np.cross(np.eye(3), a)
    angle = np.radians(degrees)
    return np.eye(3) - np.sin(angle) * K + (1 - np.cos(angle)) * K @ K


@pytest.fixture(scope="module")
def template():
    return torso()


def sampled(points, triangles, count, seed=0):
    """``count`` even points (n, 3) m of a skin."""
    surface, rng = Surface(points, triangles), np.random.default_rng(seed)
    t = rng.choice(len(surface.areas), count, p=surface.areas / surface.areas.sum())
    a, b = np.sqrt(rng.uniform(size=count)), rng.uniform(size=count)
    weights = np.stack([1 - a, a * (1 - b), a * b], axis=1)
    return np.einsum("nc,ncd->nd", weights, surface.points[surface.triangles[t]])


@pytest.fixture(scope="module")
def body(template):
    return sampled(template.points, template.triangles, 40_000)


@pytest.fixture(scope="module")
def mean_torso(shared):
    """The mean of 110 real torsos in LPS, m, and the marks that its authors set on it."""
    folder = shared / "data" / "torso_irbsm"
    data = (folder / "lirbsm_mean_points.ply").read_bytes()
    raw = np.frombuffer(data[data.index(b"end_header\n") + 11 :], "<f4").reshape(-1, 3)
    marks = np.loadtxt(folder / "average_anchors.txt")
    # y up, z to the front; 1 ≈ 0.29 m gives the chest a girth of about 0.95 m.
    points, marks = (0.29 * p[:, [0, 2, 1]] * [1, -1, 1] for p in (raw.astype(float), marks))
    return points, dict(zip(("sternal_notch", "navel", "nipple_left", "nipple_right"), marks[:4],
                            strict=True))  # fmt: skip


@pytest.mark.parametrize("noise", [0.0, 2e-3])
@pytest.mark.parametrize("degrees", [0, 15])
def test_nipples_and_notch_of_a_mean_torso_are_where_its_authors_marked_them(
    mean_torso, noise, degrees
):
    """Nipples within 10 mm and sure of it, the notch within 20 mm, also noisy and turned.

    A turn of 15° about this axis pitches the torso by 7.5°, which moves the foremost place of a
    breast of radius 60 mm by 8 mm.
    """
    points, marks = mean_torso
    R = turn(degrees, [0.5, 0.5, 0.7])
    scan = points + np.random.default_rng(0).normal(0, noise, points.shape)
    found = propose(Surface(scan @ R.T))
    for side in SIDES:
        proposal = found[f"nipple_{side}"]
        assert np.linalg.norm(R.T @ proposal.point - marks[f"nipple_{side}"]) < (
            18e-3 if degrees else 10e-3
        )
        assert proposal.confidence > 0.7
    assert np.linalg.norm(R.T @ found["sternal_notch"].point - marks["sternal_notch"]) < 20e-3


def test_a_moved_scan_with_its_frame_gives_the_same_landmarks(body):
    """Any rigid motion that the frame undoes: the points that are looked at are the same."""
    R, t = turn(130, [1, 2, -1]), np.array([3.0, -2.0, 1.0])
    still = propose(Surface(body))
    moved = propose(Surface(body @ R.T + t), (R.T, -R.T @ t))
    assert set(moved) == set(still)
    assert {"nipple_left", "nipple_right"} <= set(still)
    for name, proposal in still.items():
        np.testing.assert_allclose(moved[name].point, R @ proposal.point + t, atol=1e-9)
        assert moved[name].confidence == pytest.approx(proposal.confidence)


def test_the_mirror_image_has_the_mirrored_landmarks(body):
    """x → -x swaps left and right; the grids fall differently, by less than two pixels."""
    lopsided = body + np.array([0.03, 0, 0])
    found, mirrored = propose(Surface(lopsided)), propose(Surface(lopsided * [-1, 1, 1]))
    for side, other in (SIDES, SIDES[::-1]):
        a, b = found[f"nipple_{side}"].point, mirrored[f"nipple_{other}"].point
        assert np.linalg.norm(a * [-1, 1, 1] - b) < 8e-3


@pytest.mark.parametrize(("tilt", "yaw"), [(0, 0), (12, 0), (0, 15), (-10, 12)])
def test_the_plane_of_symmetry_is_found_again_after_tilt_and_yaw(body, tilt, yaw):
    """The template is symmetric about x = 0: the plane is met to 2°, its place to 5 mm."""
    R = turn(tilt, [0, 1, 0]) @ turn(yaw, [0, 0, 1])
    plane = square_up(body @ R.T + [0.05, -0.1, 0.2])
    whole = plane.R @ R
    assert np.degrees(np.arcsin(np.abs(whole[0, 1:]))).max() < 2.0
    centre = whole @ np.zeros(3) + plane.R @ [0.05, -0.1, 0.2] + plane.t
    assert abs(centre[0]) < 5e-3
    assert plane.likeness > 0.8


def test_curvature_of_a_dome_is_that_of_its_sphere():
    """Radius 60 mm: mean curvature -1/r at the top and Gaussian 1/r², to the grid's error."""
    r, pixel = 0.06, 1e-3
    x = np.arange(-20, 21) * pixel
    height = np.sqrt(r**2 - x[:, None] ** 2 - x[None, :] ** 2)
    mean, gauss = curvatures(height, pixel)
    np.testing.assert_allclose(mean[5:-5, 5:-5], -1 / r, rtol=2e-3)
    np.testing.assert_allclose(gauss[5:-5, 5:-5], 1 / r**2, rtol=4e-3)


def test_the_far_side_is_not_seen_through_a_hole(body):
    """A hole of 100 mm over the breastbone: no pixel shows the back, 0.2 m deeper."""
    hole = np.linalg.norm(body - [0, -0.11, 0.03], axis=1) < 0.05
    whole, cut = (seen_along(p, FRONT) for p in (body, body[~hole]))
    assert cut.height[cut.seen].min() > whole.height[whole.seen].min() - 1e-12
    row, column = (int(k) for k in np.rint(cut.at(0.0, 0.03)))
    assert not cut.seen[row - 5 : row + 6, column - 5 : column + 6].any()


def test_what_is_no_torso_gives_nothing_to_be_sure_of():
    """A ball, a plate and a handful of points."""
    rng = np.random.default_rng(1)
    ball = rng.normal(size=(20_000, 3))
    ball = 0.3 * ball / np.linalg.norm(ball, axis=1, keepdims=True)
    plate = rng.uniform(-0.3, 0.3, (20_000, 3)) * [1, 0.001, 1]
    for points in (ball, plate):
        assert all(p.confidence < 0.5 for p in propose(Surface(points)).values())
    assert propose(Surface(ball[:100])) == {}


@pytest.mark.slow
def test_confidence_tells_the_error_on_noisy_shapes_with_holes(template):
    """16 random shapes in four poses, 2 mm of noise, ten holes of 80 mm, the frame off by 8°.

    Of the nipples that have skin and a confidence above 0.6, four in five are within 20 mm; they
    are at least half of all that have skin.
    """
    chest = [bone.name for bone in template.bones].index("chest")
    rng = np.random.default_rng(5)
    errors, seen = [], 0
    for k, pose in enumerate(("standing", "supine", "arms_up", "tilted") * 4):
        posture = random_posture(template, pose, k)
        vertices = posed(template, posture)
        points = sampled(vertices, template.triangles, 40_000, k)
        points += rng.normal(0, 2e-3, points.shape)
        for centre in points[rng.integers(0, len(points), 10)]:
            points = points[np.linalg.norm(points - centre, axis=1) > 0.04]
        frame = turn(8, rng.normal(size=3)) @ posture.rotations[chest].T
        found = propose(Surface(points), (frame, np.zeros(3)))
        for side in SIDES:
            truth = template.landmark_points(vertices)[f"nipple_{side}"]
            if np.linalg.norm(points - truth, axis=1).min() < 0.01:
                seen += 1
                if f"nipple_{side}" in found and found[f"nipple_{side}"].confidence > 0.6:
                    errors.append(np.linalg.norm(found[f"nipple_{side}"].point - truth))
    assert len(errors) >= seen / 2
    assert np.mean(np.array(errors) < 20e-3) >= 0.8, np.round(np.array(errors) * 1e3)


def _breast(tip, noise, turned):
    """Points of a dome of radius 60 mm with a tip 4 mm high and 5 mm wide at 10° off its top."""
    rng = np.random.default_rng(2)
    n = rng.normal(size=(30_000, 3))
    n = n[n[:, 1] < 0]
    n /= np.linalg.norm(n, axis=1, keepdims=True)
    axis = np.array([np.sin(np.radians(10)), -np.cos(np.radians(10)), 0.0])
    away = 0.06 * np.arccos(np.clip(n @ axis, -1, 1))
    radius = 0.06 + tip * np.exp(-(away**2) / (2 * 5e-3**2)) + rng.normal(0, noise, len(n))
    return (n * radius[:, None]) @ turned.T, turned @ axis * (0.06 + tip)


@pytest.mark.parametrize("noise", [0.0, 1e-3])
@pytest.mark.parametrize("degrees", [0, 70])
@pytest.mark.parametrize("aside", [0.0, 5e-3, 10e-3])
def test_a_nipples_tip_is_found_near_its_guess(noise, degrees, aside):
    """The tip's place is known; met to 2.5 mm from guesses up to 10 mm off."""
    R = turn(degrees, [1, 0.3, 0.2])
    points, tip = _breast(4e-3, noise, R)
    guess = tip + R @ [0, 0, aside]
    found = refine(Surface(points), {"nipple_left": guess})["nipple_left"]
    assert np.linalg.norm(found.point - tip) < 2.5e-3
    assert found.confidence > 0.6


def test_without_a_tip_the_guess_goes_to_the_skin_and_is_not_sure():
    points, top = _breast(0.0, 1e-3, np.eye(3))
    found = refine(Surface(points), {"nipple_left": top * 1.1, "axilla_left": top * 1.1})
    for proposal in found.values():
        assert np.linalg.norm(proposal.point - top) < 2e-3
        assert proposal.confidence <= 0.5
    assert refine(Surface(points), {"nipple_left": top - np.array([0, 0.05, 0])}) == {}


def test_proposing_on_100000_points_takes_a_fraction_of_a_second(body):
    """CPU seconds, best of three."""
    scan = Surface(np.vstack([body, body + 1e-4, body[:20_000] - 1e-4]))
    seconds = []
    for _ in range(3):
        start = time.process_time()
        propose(scan)
        seconds.append(time.process_time() - start)
    assert min(seconds) < 0.3, seconds
