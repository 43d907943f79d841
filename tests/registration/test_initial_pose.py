"""The search for the initial pose."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from supple.errors import InputError
from supple.registration.initial_pose import candidates, rotations
from supple.registration.landmark_pose import posture_from_landmarks
from supple.registration.offset import matern
from supple.registration.pose_presets import PRESETS, preset_posture, vertex_normals
from supple.registration.posture import posed
from supple.registration.procedural import torso
from supple.registration.rig import Rig
from supple.surface import Surface


def _angle(R: np.ndarray) -> np.ndarray:
    return np.degrees(np.arccos(np.clip((np.trace(R, axis1=-2, axis2=-1) - 1) / 2, -1, 1)))


def test_no_rotation_is_far_from_the_net() -> None:
    """The icosahedral group covers SO(3) within 44.48° (its covering radius)."""
    some = Rotation.random(2000, random_state=np.random.default_rng(1)).as_matrix()
    nearest = _angle(rotations()[:, None] @ some).min(axis=0)
    assert nearest.max() <= 44.5
    assert len(rotations()) == 60


@pytest.mark.parametrize("preset", PRESETS, ids=lambda one: one.name)
def test_any_rotation_is_found(preset) -> None:  # type: ignore[no-untyped-def]
    """A preset turned any way and shifted by metres is found within 25 mm on average."""
    template, random = torso(), np.random.default_rng(3)
    still = posed(template, preset_posture(template, preset))
    normals = vertex_normals(still, template.triangles)
    for R in Rotation.random(4, random_state=random).as_matrix():
        t = random.uniform(-2, 2, 3)
        found = candidates(still @ R.T + t, normals @ R.T, template, True)
        off = np.linalg.norm(posed(template, found[0].posture) - still @ R.T - t, axis=1)
        assert off.mean() < 0.025
        assert found[0].preset == preset.name


def test_joints_hold_in_every_preset() -> None:
    """Each joint is where the parent carries it."""
    template = torso()
    for preset in PRESETS:
        p = preset_posture(template, preset)
        for k, parent in enumerate(template.parents):
            if parent >= 0:
                joint = template.joints[k]
                arm = p.scales[parent] * (joint - template.joints[parent])
                carried = p.rotations[parent] @ arm + template.joints[parent]
                assert np.allclose(
                    joint + p.translations[k], carried + p.translations[parent], atol=1e-12
                )


def test_landmarks_give_the_pose() -> None:
    """Landmarks of a preset that was moved rigidly give that motion to rounding."""
    template, random = torso(), np.random.default_rng(4)
    R = Rotation.random(random_state=random).as_matrix()
    still = posed(template, preset_posture(template, PRESETS[1]))
    marks = template.landmark_points(still @ R.T + 1.0)
    found = posture_from_landmarks(template, marks)[0]
    assert found.preset == "supine"
    assert np.allclose(posed(template, found.posture), still @ R.T + 1.0, atol=1e-9)


def test_wrong_landmarks_are_refused() -> None:
    """An unknown name, and a landmark that is no point; three on a line give no pose."""
    template = torso()
    with pytest.raises(InputError):
        posture_from_landmarks(template, {"elbow": np.zeros(3)})
    with pytest.raises(InputError):
        posture_from_landmarks(template, {"xiphoid": np.array([np.nan, 0, 0])})
    names = ("xiphoid", "sternal_notch", "nipple_left")
    line = {name: np.array([0.1 * k, 0, 0]) for k, name in enumerate(names)}
    assert posture_from_landmarks(template, line) == []


def test_small_pieces_are_left_out() -> None:
    """Of two lattices, and a speckle, the large ones stay."""
    lattice = np.stack(np.meshgrid(*[np.arange(10) * 0.01] * 2, [0.0]), -1).reshape(-1, 3)
    beside = lattice + np.array([0.2, 0.0, 0.0])
    points = np.vstack([lattice, beside, [[1.0, 1.0, 1.0]]])
    rig = Rig(torso())
    rig.set_scan(Surface(points), thin=False, gap=0.012)
    kept = np.asarray(rig.cloud.points)
    assert len(kept) == 200
    assert np.abs(kept[:, 0]).max() < 0.5


def test_the_smooth_field_has_its_standard_deviation() -> None:
    """In the middle of a wide sheet: the field's sd, and Matérn's correlation (ν = 1).

    At a distance r it is κr K₁(κr), κ = √8 / length; Lindgren et al. (2011), eq. 1.
    """
    from scipy.special import k1

    step, half, length, sd = 0.02, 20, 0.1, 3e-3
    side = 2 * half + 1
    x, y = np.meshgrid(np.arange(side), np.arange(side), indexing="ij")
    points = np.stack([x, y, 0 * x], -1).reshape(-1, 3) * step
    a = (x * side + y)[:-1, :-1].ravel()
    triangles = np.vstack(
        [np.stack([a, a + side, a + side + 1], 1), np.stack([a, a + side + 1, a + 1], 1)]
    )
    covariance = np.linalg.inv(matern(points, triangles, sd, length).toarray())
    middle = half * side + half
    assert abs(np.sqrt(covariance[middle, middle]) / sd - 1) < 0.1
    s = np.sqrt(8) / length * step * 3
    found = covariance[middle, middle + 3] / covariance[middle, middle]
    assert abs(found - s * k1(s)) < 0.05
