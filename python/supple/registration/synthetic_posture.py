"""Postures drawn at random: a body's shape, and how it stands, lies or lifts its arms."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, get_args

import numpy as np
import numpy.typing as npt
from numpy.random import Generator

from supple.errors import ConvergenceError, InputError
from supple.registration.posture import Posture, attached, posed
from supple.registration.synthetic_overlap import arms_in_body
from supple.registration.synthetic_shape import random_blend
from supple.registration.template import Template

Floats = npt.NDArray[np.float64]
Pose = Literal["standing", "supine", "arms_up", "tilted"]
POSES: tuple[Pose, ...] = get_args(Pose)
_TRIES = 200


@dataclass(frozen=True)
class _Habit:
    """What a pose does to the bones: least and most of each; angles in degrees.

    ``spread`` and ``lift`` turn a breast to its side and upwards; ``breast`` scales it along x, y
    and z; ``flat`` scales chest and abdomen from front to back.
    """

    abduction: tuple[float, float]  #: of the upper arm, from hanging
    spread: tuple[float, float] = (-3.0, 3.0)
    lift: tuple[float, float] = (-4.0, 4.0)
    breast: tuple[tuple[float, float], ...] = ((0.96, 1.04),) * 3
    flat: tuple[float, float] = (0.98, 1.02)
    tilt: tuple[float, float] = (0.0, 0.0)


_HABITS: dict[str, _Habit] = {
    "standing": _Habit((14, 45)),
    "supine": _Habit((20, 75), (5, 20), (-2, 6), ((1.0, 1.15), (0.7, 0.9), (1.0, 1.1)),
                     (0.92, 0.98)),
    "arms_up": _Habit((105, 140), (-3, 3), (2, 12), ((0.96, 1.02), (0.88, 1.0), (1.0, 1.08))),
    "tilted": _Habit((14, 45), tilt=(25, 45)),
}  # fmt: skip


def random_posture(template: Template, pose: Pose, seed: int, shapes: float = 1.0) -> Posture:
    """A body of random shape in ``pose``, every bone attached to its parent at the joint.

    The shape is `random_blend`'s of standard deviation ``shapes``; the size is normal with 4 %.
    Drawn again while an arm would pass through the body. A supine posture is told by its bones
    alone; the table that flattens the back is `synthetic_scan`'s.

    Raises:
        InputError: an unknown pose, ``shapes`` below 0.
        ConvergenceError: no draw in 200 keeps the arms out of the body.
    """
    if pose not in _HABITS:
        raise InputError(f"pose must be one of {', '.join(POSES)}, got {pose!r}.")
    if shapes < 0:
        raise InputError(f"shapes must be ≥ 0 standard deviations, got {shapes}.")
    random = np.random.default_rng([seed, POSES.index(pose)])
    for _ in range(_TRIES):
        posture = _drawn(template, _HABITS[pose], random, shapes)
        if not arms_in_body(template, posed(template, posture)).any():
            tilt = random.uniform(*_HABITS[pose].tilt)
            return posture.moved(turned(random, tilt), np.zeros(3), template.joints)
    raise ConvergenceError(f"no {pose} posture of {template!r} in {_TRIES} keeps its arms apart.")


def turned(random: Generator, degrees: float) -> Floats:
    """Rotation (3, 3) by ``degrees`` about a random axis."""
    axis = random.normal(size=3)
    return _rotation(np.radians(degrees) * axis / np.linalg.norm(axis))


def _drawn(template: Template, habit: _Habit, random: Generator, shapes: float) -> Posture:
    """One draw, upright."""
    number = {bone.name: k for k, bone in enumerate(template.bones)}
    local = {name: np.eye(3) for name in number}
    scales = np.ones((len(number), 3)) * np.clip(random.normal(1.0, 0.04), 0.9, 1.1)
    trunk = random.normal(1.0, 0.02, 3) * (1.0, random.uniform(*habit.flat), 1.0)
    scales *= trunk
    for name, degrees in (("abdomen", 1.0), ("chest", 4.0), ("neck", 7.0)):
        if name in number:
            local[name] = _rotation(np.radians(random.normal(0.0, degrees, 3).clip(-15, 15)))
    for side, sign in (("left", 1.0), ("right", -1.0)):
        _pose_arm(template, habit, random, side, sign, local)
        _pose_breast(habit, random, side, sign, local)
    _pair_scales(habit, random, number, scales)
    rotations = _chained(template, local)
    return attached(template, rotations, scales, random_blend(template, random, shapes))


def _pose_arm(template: Template, habit: _Habit, random: Generator, side: str, sign: float,
              local: dict[str, Floats]) -> None:  # fmt: skip
    """Raise the arm from where it rests on the template, its shoulder by a fourth of that."""
    raised = np.radians(random.uniform(*habit.abduction)) - _abduction(template, f"arm_{side}")
    forward, twist = np.radians(random.normal(0.0, (6.0, 5.0)))
    shoulder = np.clip(raised / 4, -0.05, 0.45)
    local[f"shoulder_{side}"] = _rotation(np.array([0.0, -sign * shoulder, 0.0])) @ _rotation(
        np.radians(random.normal(0.0, 2.0, 3)))  # fmt: skip
    raise_it = _rotation(np.array([0.0, -sign * (raised - shoulder), 0.0]))
    local[f"arm_{side}"] = _rotation(np.array([-forward, 0.0, 0.0])) @ raise_it @ _rotation(
        np.array([0.0, 0.0, twist]))  # fmt: skip


def _pose_breast(habit: _Habit, random: Generator, side: str, sign: float,
                 local: dict[str, Floats]) -> None:  # fmt: skip
    """Turn the breast to its side and upwards."""
    spread = np.radians(random.uniform(*habit.spread))
    lift = np.radians(random.uniform(*habit.lift))
    local[f"breast_{side}"] = _rotation(np.array([-lift, 0.0, sign * spread]))


def _pair_scales(habit: _Habit, random: Generator, number: dict[str, int], scales: Floats) -> None:
    """Scale the other bones, left and right nearly alike; breasts as the pose asks."""
    for name in ("neck", "shoulder", "arm", "breast"):
        common = random.normal(1.0, 0.02, 3)
        if name == "breast":
            common = common * [random.uniform(*span) for span in habit.breast]
        for bone in (name, f"{name}_left", f"{name}_right"):
            if bone in number:
                scales[number[bone]] *= common * random.normal(1.0, 0.01, 3)


def _chained(template: Template, local: dict[str, Floats]) -> Floats:
    """Rotations (K, 3, 3) of bones from those that each adds to its parent's."""
    rotations: list[Floats] = []
    for bone in template.bones:
        above = rotations[bone.parent] if bone.parent >= 0 else np.eye(3)
        rotations.append(above @ local.get(bone.name, np.eye(3)))
    return np.array(rotations)


def _abduction(template: Template, arm: str) -> float:
    """Angle of an arm of the template from hanging, rad."""
    bone = next(k for k, b in enumerate(template.bones) if b.name == arm)
    along = template.weights[:, bone] @ (template.points - template.joints[bone])
    return float(np.arctan2(abs(along[0]), -along[2]))


def _rotation(turn: Floats) -> Floats:
    from scipy.spatial.transform import Rotation

    return np.asarray(Rotation.from_rotvec(turn).as_matrix())
