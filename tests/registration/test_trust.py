"""Which fits are not trusted: another facing as plausible, a body unlike the template, no body."""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache

import numpy as np
import pytest

from supple.registration.procedural import torso
from supple.registration.register import RegisterSettings, register
from supple.registration.registration import Registration
from supple.registration.rivals import Rival, apart, turned_round
from supple.registration.synthetic import SyntheticScan, random_posture, synthetic_scan
from supple.registration.template import Template
from supple.registration.trust import doubts
from supple.surface import Surface


@lru_cache(maxsize=1)
def _template() -> Template:
    return torso()


@lru_cache(maxsize=1)
def _scan() -> SyntheticScan:
    given = {"points": 15_000, "noise": 1e-3, "missing": 0.0}
    return synthetic_scan(_template(), random_posture(_template(), "standing", 3), 3, **given)


@lru_cache(maxsize=1)
def _found() -> Registration:
    return register(_scan().surface, _template())


def _doubts(**changes: object) -> list[str]:
    from supple.registration.register import rig_of

    found = _found()
    given = {"offset": found.offset, "rivals": [], "covariance": found.covariance,
             "limits": RegisterSettings().doubts, "fit": found.fit} | changes  # fmt: skip
    return doubts(rig_of(_template()), **given)


def test_a_plain_scan_is_trusted() -> None:
    """Of the template itself, 1 mm of noise."""
    assert _found().trustworthy, _found().warnings
    assert _doubts() == []


def test_turned_round_faces_backwards_in_the_same_place() -> None:
    """Half a turn about a point of the body: π apart; twice is the pose again."""
    posture, middle = _found().posture, np.array([0.1, -0.2, 0.3])
    back = turned_round(posture, _template(), middle)
    assert apart(posture, back, _template()) == pytest.approx(np.pi, abs=1e-6)
    again = turned_round(back, _template(), middle)
    assert np.abs(again.rotations - posture.rotations).max() < 1e-12
    assert np.abs(again.translations - posture.translations).max() < 1e-12


def test_a_rival_that_is_as_plausible_is_said() -> None:
    """The same energy in two facings: none can be told; 1.5 times it: one can."""
    fit = _found().fit
    two = [Rival(fit, 10.0), Rival(fit, 11.0)]
    assert any("faces another way" in text for text in _doubts(rivals=two))
    assert _doubts(rivals=[Rival(fit, 10.0), Rival(fit, 15.0)]) == []


def test_a_large_offset_is_said() -> None:
    """4 mm everywhere is more than a body that the template knows needs."""
    away = np.full_like(_found().offset, 4e-3 / np.sqrt(3))
    assert any("4.0 mm" in text for text in _doubts(offset=away))


@pytest.mark.parametrize(
    ("term", "word"), [("blendshape", "shapes"), ("scale", "sizes"), ("rotation", "turned")]
)
def test_an_implausible_body_is_said(term: str, word: str) -> None:
    """A prior's energy that a thousandth of bodies do not reach."""
    fit = _found().fit
    unlike = replace(fit, energy=fit.energy | {term: 200.0})
    assert any(word in text for text in _doubts(fit=unlike))


def test_a_body_unlike_the_template_is_said_unless_all_landmarks_hold_it() -> None:
    """Skin half the scan's noise away from what the template can become, in one direction."""
    away = np.zeros_like(_found().offset)
    away[:, 1] = 0.5 * max(_found().fit.residual_sd, 5e-4)
    assert [text for text in _doubts(offset=away) if "0.50 of the scan's noise" in text]
    assert _doubts(offset=away, held=True) == []


def test_a_nipple_elsewhere_is_said() -> None:
    """Where the scan surely shows one 30 mm away."""
    assert any("nipple" in text for text in _doubts(astray=0.03))


@pytest.mark.slow
@pytest.mark.parametrize("crop", [(0.58, 0.86, 0.24), (0.58, 0.86, 0.6), (0.58, 0.9, 0.6)])
def test_a_real_torso_faces_its_front(shared, crop: tuple[float, float, float]) -> None:  # type: ignore[no-untyped-def]
    """The Visible Human female's skin stands along z and faces −y, cut out in several ways."""
    from supple.registration.scan_file import read_scan

    files = sorted((shared / "data" / "skin_vhf").glob("*.glb"))
    if not files:
        pytest.skip("no Visible Human skin")
    whole, (low, high, aside) = read_scan(files[0]).surface, crop
    points = whole.points
    height = (points[:, 2] - points[:, 2].min()) / np.ptp(points[:, 2])
    kept = (height > low) & (height < high)
    kept &= np.abs(points[:, 0] - np.median(points[:, 0])) < aside
    used, new = np.unique(whole.triangles[kept[whole.triangles].all(axis=1)], return_inverse=True)
    found = register(Surface(points[used], new.reshape(-1, 3)), _template())
    marks = found.landmarks
    assert marks["nipple_left"][1] < np.median(points[used, 1]) - 0.05
    assert marks["nipple_left"][0] > marks["nipple_right"][0] + 0.1
    assert marks["sternal_notch"][2] > marks["xiphoid"][2] + 0.1
