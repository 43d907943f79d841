"""Landmarks told by the shape of a fitted body at rest."""

from __future__ import annotations

from functools import lru_cache
from pathlib import Path

import numpy as np
import pytest

from supple.registration.posture import Posture
from supple.registration.procedural import torso
from supple.registration.register import RegisterSettings, register
from supple.registration.rest_landmarks import TOLD, at_rest, evidence, kind, told
from supple.registration.synthetic import random_posture
from supple.registration.template import Floats, Template
from supple.studies.torso_cases import Case, scan_of, templates
from supple.surface import Surface


@lru_cache(maxsize=1)
def _template() -> Template:
    return torso()


def _slid(far: float) -> Floats:
    """The template's own surface, its vertices about the notch ``far`` m further down on it."""
    template = _template()
    notch = template.landmark_points()["sternal_notch"]
    near = np.exp(-((np.linalg.norm(template.points - notch, axis=1) / 0.1) ** 4))
    moved = template.points - near[:, None] * [0.0, 0.0, far]
    hit = Surface(template.points, template.triangles).closest(moved)
    corners = template.points[template.triangles[hit.triangle]]
    return np.asarray(np.einsum("kc,kcd->kd", hit.barycentric, corners))


def test_a_body_at_rest_does_not_depend_on_its_pose() -> None:
    """Carried away as a whole, arms up or down: the same skin, and its offset turns with it."""
    template, random = _template(), np.random.default_rng(0)
    assert np.allclose(at_rest(template, Posture.rest(template)), template.points, atol=1e-12)
    posture = random_posture(template, "arms_up", 0)
    c, s = np.cos(0.7), np.sin(0.7)
    R = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1.0]])
    offset = 1e-3 * random.normal(size=template.points.shape)
    moved = posture.moved(R, np.array([0.3, -0.2, 0.1]), template.joints)
    one, other = (at_rest(template, p, o) for p, o in ((posture, offset), (moved, offset @ R.T)))
    assert np.abs(one - other).max() < 1e-12


def test_the_rules_find_the_template_s_own_landmarks() -> None:
    """Each within what it is good for."""
    at, found = _template().landmark_points(), told(_template(), _template().points)
    assert {kind(name) for name in found} == set(TOLD)
    for name, place in found.items():
        assert np.linalg.norm(place - at[name]) < TOLD[kind(name)].doubt, name


@pytest.mark.parametrize("far", [-0.02, 0.02])
def test_a_notch_that_slid_is_told_by_the_corner_that_did_not(far: float) -> None:
    """The same surface under vertices that moved along it by 2 cm: less than half of it is left.

    The skin is told by its corners, and its edges are 13 to 30 mm long there.
    """
    template, skin = _template(), _slid(far)
    true = template.landmark_points()["sternal_notch"]
    apart = np.linalg.norm(template.landmark_points(skin)["sternal_notch"] - true)
    assert apart > 0.015
    assert np.linalg.norm(told(template, skin)["sternal_notch"] - true) < apart / 2
    found = evidence(template, skin, skin + 1.0, np.ones(len(skin), dtype=bool))
    place = found.places[found.names.index("sternal_notch")] - 1.0
    assert np.linalg.norm(place - true) < apart / 2


def test_what_the_scan_does_not_show_is_left_to_the_prior() -> None:
    """No skin seen: nothing is said; one nipple hidden: it is the mirror image of the other."""
    template = _template()
    nothing = np.zeros(len(template.points), dtype=bool)
    assert evidence(template, _slid(0.02), _slid(0.02), nothing).names == []
    at = template.landmark_points()
    hidden = np.linalg.norm(template.points - at["nipple_right"], axis=1) < 0.03
    found = evidence(template, template.points, template.points, ~hidden)
    image = at["nipple_left"] * [-1, 1, 1]
    assert np.linalg.norm(found.places[found.names.index("nipple_right")] - image) < 1e-6
    assert "nipple_left" not in found.names


@pytest.mark.parametrize("kind_of", ["flat", "noise", "point"])
def test_rules_that_find_nothing_say_nothing(kind_of: str) -> None:
    """On what is no body they neither raise nor invent numbers that are none."""
    template, random = _template(), np.random.default_rng(0)
    skin = {
        "flat": template.points * [1, 1e-9, 1],
        "noise": 0.1 * random.normal(size=template.points.shape),
        "point": 1e-6 * template.points,
    }[kind_of]
    assert all(np.isfinite(place).all() for place in told(template, skin).values())
    found = evidence(template, skin, skin, np.ones(len(skin), dtype=bool))
    assert np.isfinite(found.places).all()


@pytest.mark.slow
def test_across_templates_landmarks_come_nearer(shared: Path) -> None:
    """Scans of one template, the other fitted: errors over both fall by a fifth or more."""
    known = templates(shared / "data")
    off: dict[int, list[float]] = {0: [], 1: []}
    for pair in (("procedural", "makehuman"), ("makehuman", "procedural")):
        case = Case(*pair, "standing", 1000, 2e-3)
        scan = scan_of(case, known, points=25_000)
        for rounds, errors in off.items():
            settings = RegisterSettings(told=rounds)
            found = register(scan.surface, known[pair[1]], settings=settings).landmarks
            errors += [float(np.linalg.norm(found[k] - v)) for k, v in scan.truth.landmarks.items()]
    assert np.mean(off[1]) < 0.8 * np.mean(off[0])
