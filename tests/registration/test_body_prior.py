"""What is assumed of a body by how much of it a scan shows."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from supple.registration.body_prior import back_seen, body_prior
from supple.registration.posture import Posture
from supple.registration.procedural import torso
from supple.registration.rig import Rig
from supple.registration.synthetic import random_posture, synthetic_scan


@pytest.mark.parametrize("pose", ["standing", "supine"])
@pytest.mark.parametrize("view", ["around", "front"])
def test_a_back_is_seen_from_around_only(pose: Any, view: Any) -> None:
    """A third of the skin missing or not, any motion: cameras in front never see it."""
    template = torso()
    scan = synthetic_scan(template, random_posture(template, pose, 1007), 1007,
                          points=8000, view=view)  # fmt: skip
    rig = Rig(template)
    rig.set_scan(scan.surface)
    assert back_seen(rig, scan.truth.posture) == (view == "around")


def test_without_a_chest_nobody_is_taken_to_lie() -> None:
    """A template that names no chest, or whose chest moves no skin: the prior is the usual one."""
    template = torso()
    names = [bone.name for bone in template.bones]
    renamed = tuple(replace(bone, name=bone.name.replace("chest", "thorax"))
                    for bone in template.bones)  # fmt: skip
    bare = template.weights.copy()
    bare[:, names.index("abdomen")] += bare[:, names.index("chest")]
    bare[:, names.index("chest")] = 0.0
    for other in (replace(template, bones=renamed), replace(template, weights=bare)):
        assert back_seen(Rig(other), Posture.rest(other))


def test_breasts_fall_to_both_sides_alike() -> None:
    """Means of the two sides are each other's mirror image: a turn about z changes its sign."""
    template = torso()
    prior = body_prior(template, back=False)
    names = [bone.name for bone in template.bones]
    turns, scales = np.asarray(prior.rotation_mean), np.asarray(prior.scale_mean)
    for k, name in enumerate(names):
        other = names.index(
            name.replace("left", "?").replace("right", "left").replace("?", "right")
        )
        assert np.array_equal(turns[k], turns[other] * (1.0, -1.0, -1.0))
        assert np.array_equal(scales[k], scales[other])
    left = names.index("breast_left")
    assert turns[left, 2] > 0 > scales[left, 1]
