"""Skin that moves along itself to landmarks."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from supple.registration.posture import Posture, posed
from supple.registration.procedural import torso
from supple.registration.register import register
from supple.registration.rest_landmarks import at_rest
from supple.registration.slide import field, slide
from supple.registration.synthetic import random_posture
from supple.registration.template import Floats, Ints, Template
from supple.studies.torso_cases import Case, scan_of, templates
from supple.studies.torso_score import rim_vertices, score
from supple.surface import Surface


def _slid(template: Template, posture: Posture, marks: dict[str, Floats], sd: float) -> Floats:
    points = posed(template, posture)
    return slide(template, posture, points, np.zeros_like(points), marks, sd)


def _areas(points: Floats, triangles: Ints) -> Floats:
    """(t, 3) m², twice the area times the normal."""
    a, b, c = points[triangles.T]
    return np.cross(b - a, c - a)


def _up(template: Template, posture: Posture, far: float) -> dict[str, Floats]:
    """Landmarks on the skin of ``posture``, moved up along it at rest by ``far`` m."""
    skin, points = at_rest(template, posture), posed(template, posture)
    at = np.add(list(template.landmark_points(skin).values()), [0.0, 0.0, far])
    hit = Surface(skin, template.triangles).closest(at)
    places = np.einsum("kc,kcd->kd", hit.barycentric, points[template.triangles[hit.triangle]])
    return dict(zip(template.landmarks, places, strict=True))


def test_the_field_is_the_mean_of_its_process() -> None:
    """One place on the midline: d s²/(s² + σ²) there, nothing far away; across it cancels."""
    place, step = np.zeros((1, 3)), np.array([[0.01, 0.02, -0.01]])
    moved = field(np.array([[0.0, 0.0, 0.0], [0.0, 0.0, 2.0]]), place, step, 5e-3)
    whole = 12.0**2 / (12.0**2 + 5.0**2)
    assert np.allclose(moved[0, 1:], whole * step[0, 1:], rtol=1e-12)
    own = 0.2 * 12.0**2  # of x, what both sides have in common cancels at the midline
    assert moved[0, 0] == pytest.approx(own / (own + 25.0) * step[0, 0], rel=1e-12)
    assert np.abs(moved[1]).max() < 1e-12


def test_one_side_moves_the_other_as_its_mirror_image() -> None:
    """By the share that sides have in common, 0.4 / 0.6 of its own step."""
    place = np.array([[0.3, 0.0, 0.0]])  # far from its image
    step = np.array([[0.01, 0.02, -0.01]])
    own, other = field(np.array([[0.3, 0.0, 0.0], [-0.3, 0.0, 0.0]]), place, step, 1e-3)
    assert np.allclose(other, own * np.array([-1, 1, 1]) * (0.4 / 0.6), rtol=1e-3)


@pytest.mark.parametrize("pose", ["standing", "supine", "arms_up", "tilted"])
def test_landmarks_arrive_and_the_surface_stays(pose: str) -> None:
    """Moved 8 mm along the skin: a third of it is left, on a skin that has not moved.

    No triangle turns over, and the rim stays where it is.
    """
    template = torso()
    posture = random_posture(template, pose, 1000)  # type: ignore[arg-type]
    points, marks = posed(template, posture), _up(template, posture, 8e-3)
    moved = points + _slid(template, posture, marks, 2e-3)
    before, after = template.landmark_points(points), template.landmark_points(moved)
    off = [[np.linalg.norm(at[name] - place) for name, place in marks.items()]
           for at in (before, after)]  # fmt: skip
    assert np.mean(off[1]) < np.mean(off[0]) / 3
    home = Surface(points, template.triangles)
    assert np.abs(home.closest(moved).distance).max() < 1e-9
    rim = rim_vertices(template.triangles, len(points))
    assert np.abs(moved - points)[rim].max() < 1e-12
    before, after = (_areas(skin, template.triangles) for skin in (points, moved))
    assert (before * after).sum(axis=1).min() > 0


def test_landmarks_far_from_their_place_neither_fold_nor_tear_the_skin() -> None:
    """Random steps of 4 cm: the skin is still one of triangles with an area."""
    template, random = torso(), np.random.default_rng(0)
    posture = random_posture(template, "standing", 1001)
    points = posed(template, posture)
    marks = {name: place + 0.04 * random.normal(size=3)
             for name, place in template.landmark_points(points).items()}  # fmt: skip
    moved = points + _slid(template, posture, marks, 5e-3)
    Surface(moved, template.triangles)  # raises where a triangle has none
    assert np.linalg.norm(moved - points, axis=1).max() < 0.1


def test_nothing_given_nothing_moves() -> None:
    """No landmarks, or landmarks where they already are: exactly, and nearly, zero."""
    template = torso()
    rest = Posture.rest(template)
    assert not _slid(template, rest, {}, 5e-3).any()
    assert not _slid(template, rest, template.landmark_points(), 5e-3).any()


@pytest.mark.slow
def test_a_body_unlike_the_template_lands_on_landmarks_that_are_given(shared: Path) -> None:
    """All 12 given exactly: 4 mm off on the mean, none by 20 mm, the surface within 2.3 mm."""
    known = templates(shared / "data")
    for pair in (("procedural", "makehuman"), ("makehuman", "procedural")):
        scan = scan_of(Case(*pair, "standing", 1000, 2e-3), known, points=25_000)
        found = register(scan.surface, known[pair[1]], landmarks=scan.truth.landmarks)
        of = score(found, scan, known[pair[0]])
        assert of.landmark < 4.0
        assert of.worst_landmark[1] < 20.0
        assert of.surface < 2.3
