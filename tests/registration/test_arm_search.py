"""Arms that go elsewhere, and facings: what of a posture is tried again, and what is kept."""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from supple.registration.arm_search import lost_arms, settled_arms
from supple.registration.pose_presets import PRESETS, Preset, preset_posture
from supple.registration.posture import Posture, posed
from supple.registration.procedural import torso
from supple.registration.register_settings import RegisterSettings
from supple.registration.rivals import decided, turned_round
from supple.registration.synthetic import POSES, random_posture
from supple.registration.template import Template


@lru_cache(maxsize=1)
def _template() -> Template:
    return torso()


def _twisted(posture: Posture, side: str, degrees: float) -> Posture:
    """With one arm turned about x, through the trunk's front or back."""
    arm = [bone.name for bone in _template().bones].index(f"arm_{side}")
    c, s = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    turned = posture.rotations.copy()
    turned[arm] = np.array([[1, 0, 0], [0, c, -s], [0, s, c]]) @ turned[arm]
    return Posture(turned, posture.translations, posture.scales, posture.blend)


def _energy_by(truth: Posture) -> Any:
    """A fit that stays where it is told, with the mean square distance to ``truth`` as energy."""
    skin = posed(_template(), truth)

    def refit(start: Posture) -> Any:
        off = posed(_template(), start) - skin
        return SimpleNamespace(posture=start, energy={"data": float((off**2).sum(axis=1).mean())})

    return refit


@pytest.mark.parametrize("pose", POSES)
def test_arms_of_bodies_are_not_lost(pose: Any) -> None:
    """None of 10 random bodies in a pose, nor of the presets, however they are turned in space."""
    R = np.array([[0.0, 0, 1], [1, 0, 0], [0, 1, 0]])
    joints = _template().joints
    for posture in [
        *(random_posture(_template(), pose, seed) for seed in range(1000, 1010)),
        *(preset_posture(_template(), preset) for preset in PRESETS),
    ]:
        assert lost_arms(posture.moved(R, np.ones(3), joints), _template()) == []


@pytest.mark.parametrize("side", ["left", "right"])
def test_a_lost_arm_is_set_as_the_other(side: str) -> None:
    """One arm of a symmetric body turned by 70° comes back exactly: it is the other's image."""
    true = preset_posture(_template(), PRESETS[0])
    lost = _twisted(true, side, 70.0)
    assert lost_arms(lost, _template()) == [side]
    found = settled_arms(_energy_by(true)(lost), _template(), _energy_by(true))
    assert found is not None
    assert np.abs(posed(_template(), found) - posed(_template(), true)).max() < 1e-9


def test_two_lost_arms_are_set_as_in_presets() -> None:
    """Both turned by 70°, where the truth has them raised by 30°: that is one of the trials."""
    true = preset_posture(_template(), Preset("", 30.0))
    lost = _twisted(_twisted(true, "left", 70.0), "right", -70.0)
    assert lost_arms(lost, _template()) == ["left", "right"]
    found = settled_arms(_energy_by(true)(lost), _template(), _energy_by(true))
    assert found is not None
    assert np.abs(posed(_template(), found) - posed(_template(), true)).max() < 1e-9


def test_an_arm_that_the_scan_has_there_stays() -> None:
    """If the energy is least with the arm turned away, nothing is changed."""
    odd = _twisted(preset_posture(_template(), PRESETS[0]), "left", 70.0)
    assert settled_arms(_energy_by(odd)(odd), _template(), _energy_by(odd)) is None


@pytest.mark.parametrize(
    ("bone", "lost"), [("arm_right", ["left"]), ("shoulder_right", ["left"]), ("chest", [])]
)
def test_an_arm_without_another_like_it_stays(bone: str, lost: list[str]) -> None:
    """A template with one arm, or one shoulder, tells nothing of a lost arm; without a chest none
    is lost."""
    other = replace(_template(), bones=tuple(
        replace(one, name="other") if one.name == bone else one for one in _template().bones
    ))  # fmt: skip
    true = preset_posture(_template(), PRESETS[0])
    odd = _twisted(true, "left", 70.0)
    assert lost_arms(odd, other) == lost
    assert settled_arms(_energy_by(true)(odd), other, _energy_by(true)) is None


def test_an_arm_that_points_straight_ahead_is_lost() -> None:
    """At 90° to the front its direction sideways says nothing, and no rounding is in the way."""
    rest = Posture.rest(_template())
    arm = [bone.name for bone in _template().bones].index("arm_left")
    along = _template().weights[:, arm] @ (_template().points - _template().joints[arm])
    across = np.cross(along / np.linalg.norm(along), [0.0, -1.0, 0.0])
    turns = rest.rotations.copy()
    turns[arm] = Rotation.align_vectors([[0.0, -1, 0], across], [along, across])[0].as_matrix()
    ahead = Posture(turns, rest.translations, rest.scales, rest.blend)
    assert "left" in lost_arms(ahead, _template())


def test_the_facing_that_explains_the_scan_goes_on() -> None:
    """What is near the body's skin decides, whatever clutter a fit comes near to besides."""
    front = preset_posture(_template(), PRESETS[0])
    back = turned_round(front, _template(), np.zeros(3))
    near = SimpleNamespace(posture=front, used=np.full(10, 0.75), energy={"data": 75.0})
    wide = SimpleNamespace(posture=back, used=np.full(10, 0.95), energy={"data": 380.0})
    keep = RegisterSettings()
    rivals = decided([near, wide], _template(), lambda fit: fit, keep)  # type: ignore[list-item]
    assert [one.fit for one in rivals] == [near]
