"""What a user is told: names exchanged, landmarks misplaced, no body's size, too little of a scan.

The truth is that of synthetic scans: bodies of the shipped template, posed at random.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from functools import lru_cache
from itertools import combinations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from supple.errors import ConvergenceError, InputError
from supple.registration import register as register_module
from supple.registration.body_size import body_size
from supple.registration.landmark_check import check_on_scan
from supple.registration.landmark_doubts import left_out
from supple.registration.landmark_exchange import exchanged
from supple.registration.posture import Posture, posed
from supple.registration.procedural import torso
from supple.registration.register import register
from supple.registration.registration import Registration
from supple.registration.synthetic import POSES, SyntheticScan, random_posture, synthetic_scan
from supple.registration.template import LANDMARKS, Template
from supple.surface import Surface

FEW = ("sternal_notch", "nipple_left", "xiphoid")


@lru_cache(maxsize=1)
def _template() -> Template:
    return torso()


@lru_cache(maxsize=1)
def _scan() -> SyntheticScan:
    given = {"points": 12_000, "noise": 1e-3, "missing": 0.1, "clutter": 0.0}
    posture = random_posture(_template(), "standing", 1003)
    return synthetic_scan(_template(), posture, 1003, rotation=15.0, **given)


@lru_cache(maxsize=1)
def _fit() -> Registration:
    return register(_scan().surface, _template(), _scan().truth.landmarks)


def _body(pose: str, seed: int) -> tuple[dict[str, np.ndarray], np.ndarray]:
    """Landmarks and front of a random body that lies anyhow."""
    points = posed(_template(), random_posture(_template(), pose, seed))
    turn = Rotation.random(random_state=seed).as_matrix()
    marks = {k: turn @ v + [1, 2, 3] for k, v in _template().landmark_points(points).items()}
    return marks, turn @ [0.0, -1.0, 0.0]


@pytest.mark.parametrize("names", [FEW, LANDMARKS[:4], LANDMARKS])
@pytest.mark.parametrize("pose", POSES)
def test_landmarks_by_their_own_names_are_never_called_exchanged(
    names: Iterable[str], pose: str
) -> None:
    for seed in (1000, 1001):
        marks, front = _body(pose, seed)
        assert exchanged({name: marks[name] for name in names}, front, _template()) is None


@pytest.mark.parametrize("pose", POSES)
def test_two_that_are_exchanged_are_named(pose: str) -> None:
    """Of all landmarks each pair that is 10 cm apart; of three, notch and xiphoid."""
    marks, front = _body(pose, 1000)
    for a, b in combinations(marks, 2):
        if np.linalg.norm(marks[a] - marks[b]) > 0.1:
            found = exchanged({**marks, a: marks[b], b: marks[a]}, front, _template())
            assert found is not None
            assert set(found.names) == {a, b}
    three = {name: marks[name] for name in FEW}
    three["sternal_notch"], three["xiphoid"] = three["xiphoid"], three["sternal_notch"]
    found = exchanged(three, front, _template())
    assert found is not None
    assert set(found.names) == {"sternal_notch", "xiphoid"}


@pytest.mark.parametrize("names", [FEW, LANDMARKS[:4], LANDMARKS])
@pytest.mark.parametrize("pose", POSES)
def test_a_mirrored_body_is_told_by_three_landmarks(names: Iterable[str], pose: str) -> None:
    """Mirrored in any plane: what the names call left is on the right."""
    for seed in (1000, 1001):
        marks, front = _body(pose, seed)
        turn = Rotation.random(random_state=seed + 1).as_matrix() @ np.diag([1.0, 1.0, -1.0])
        found = exchanged({name: turn @ marks[name] for name in names}, turn @ front, _template())
        assert found is not None
        assert found.names == ("left", "right")


def test_exchanged_names_are_refused_before_the_fit() -> None:
    marks = dict(_scan().truth.landmarks)
    marks["sternal_notch"], marks["xiphoid"] = marks["xiphoid"], marks["sternal_notch"]
    with pytest.raises(InputError, match="looks as if sternal_notch and xiphoid are exchanged"):
        check_on_scan(marks, _scan().surface, _template())


@pytest.mark.parametrize("wrong", ["axilla_left", "nipple_right", "sternal_notch"])
def test_a_landmark_slid_along_the_skin_is_named_with_its_distance(wrong: str) -> None:
    """6 cm off the truth, and as far as said (8 mm) from where a fit to the other eleven has it,
    before its skin slides to them."""
    marks, skin = dict(_scan().truth.landmarks), _scan().surface.points
    away = np.linalg.norm(skin - marks[wrong], axis=1)
    marks[wrong] = skin[np.argmin(np.abs(away - 0.06))]
    found = register(_scan().surface, _template(), marks)
    said = [w for w in found.warnings if w.startswith("Landmark")]
    assert len(said) == 1
    assert said[0].startswith(f"Landmark {wrong} was given ")
    others = {name: at for name, at in marks.items() if name != wrong}
    without = register(_scan().surface, _template(), others)
    there = _template().landmark_points(without.fit.points)[wrong]
    off = np.linalg.norm(marks[wrong] - there)
    assert abs(float(said[0].split()[4]) - 1e3 * off) < 8
    assert not found.trustworthy


def test_two_landmarks_alone_that_are_exchanged_are_told_by_the_scan() -> None:
    """Notch and xiphoid make no triangle: only a fit without them knows which is above."""
    marks = _scan().truth.landmarks
    given = {"sternal_notch": marks["xiphoid"], "xiphoid": marks["sternal_notch"]}
    found = register(_scan().surface, _template(), given)
    assert found.warnings[0].startswith("It looks as if sternal_notch and xiphoid are exchanged")
    assert not [w for w in found.warnings if "too small" in w or "too large" in w]
    assert not found.trustworthy


def test_leaving_one_out_on_paper_is_leaving_it_out() -> None:
    """The closed form comes most of the way to a fit without that landmark: it is linear."""
    marks = dict(_scan().truth.landmarks)
    marks["nipple_left"] = marks["nipple_left"] + [0.0, 0.0, 0.03]
    settled = register(_scan().surface, _template(), marks, start=_fit().posture)
    on_paper = dict(zip(marks, left_out(settled, marks, 5e-3), strict=True))["nipple_left"]
    others = {name: at for name, at in marks.items() if name != "nipple_left"}
    without = register(_scan().surface, _template(), others, start=_fit().posture)
    true = np.linalg.norm(without.landmarks["nipple_left"] - marks["nipple_left"])
    seen = np.linalg.norm(settled.landmarks["nipple_left"] - marks["nipple_left"])
    assert seen < 0.6 * true
    assert abs(on_paper - true) < 0.5 * (true - seen)


def test_true_landmarks_are_not_doubted() -> None:
    assert not [w for w in _fit().warnings if "Landmark" in w or "body would be" in w]


def test_sizes_are_what_a_tape_measures() -> None:
    """Of the skin at rest: the hull of its vertices near the folds; and sizes scale with it."""
    from scipy.spatial import ConvexHull

    template, rest = _template(), Posture.rest(_template())
    found = replace(_fit(), posture=rest, points=template.points)
    size, marks = body_size(found), template.landmark_points(template.points)
    fold = marks["breast_inferior_left"][2]
    assert size.length_cm == pytest.approx(100 * (marks["sternal_notch"][2] - fold), abs=1e-9)
    near = template.points[np.abs(template.points[:, 2] - fold) < 8e-3]
    near = near[np.abs(near[:, 0]) < 0.19]  # no arms
    assert size.girth_cm == pytest.approx(100 * ConvexHull(near[:, :2]).area, rel=0.04)
    twice = body_size(replace(found, points=2 * template.points))
    assert twice.girth_cm == pytest.approx(2 * size.girth_cm, rel=1e-9)
    assert twice.length_cm == pytest.approx(2 * size.length_cm, rel=1e-9)


@pytest.mark.parametrize(("scale", "word"), [(1.5, "large"), (0.6, "small")])
def test_a_scan_of_another_size_is_said_in_centimetres(scale: float, word: str) -> None:
    """The true body's length, 20 cm, times the factor."""
    scan = _scan().surface
    found = register(Surface(scale * scan.points, scan.triangles), _template())
    said = [w for w in found.warnings if f"too {word}" in w]
    assert len(said) == 1
    assert f"{body_size(found).length_cm:.0f} cm from the sternal notch" in said[0]
    assert not found.trustworthy


def test_a_fit_without_hold_tells_how_little_the_scan_shows(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """A square of 30 cm: 900 cm², and its share of the template's own area."""

    def lost(*_: object) -> Registration:
        raise ConvergenceError("got 7 pairs within 120 mm")

    monkeypatch.setattr(register_module, "_stages", lost)
    x, y = (g.ravel() for g in np.meshgrid(*[np.linspace(0, 0.3, 20)] * 2))
    corner = np.arange(400).reshape(20, 20)
    p, q, r, s = (corner[i : 19 + i, j : 19 + j].ravel() for i in (0, 1) for j in (0, 1))
    two = [np.stack(t, axis=1) for t in ((p, q, s), (p, s, r))]
    square = Surface(np.stack([x, y, 0 * x], axis=1), np.vstack(two))
    share = 0.09 / Surface(_template().points, _template().triangles).areas.sum()
    said = f"900 cm² of skin, {share:.0%} of a torso's, on 30 × 30 × 0 cm; scan the front from neck"
    with pytest.raises(ConvergenceError, match=said) as caught:
        register(square, _template())
    assert "7 pairs" in caught.value.cause


def test_a_start_from_far_away_is_told_so() -> None:
    far = _fit().posture.moved(np.eye(3), np.array([3.0, 0, 0]), _template().joints)
    with pytest.raises(ConvergenceError, match="must be near the scan"):
        register(_scan().surface, _template(), start=far)
