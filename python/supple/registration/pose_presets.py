"""Postures that a search begins with: arms hanging, raised sideways or lifted."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any
from weakref import WeakKeyDictionary

import numpy as np

from supple.core import core
from supple.registration.posture import Posture, posed
from supple.registration.template import Floats, Ints, Template


@dataclass(frozen=True)
class Preset:
    """What a way of standing or lying does to the template."""

    name: str
    abduction: float  #: degrees, of the upper arms from hanging
    spread: float = 0.0  #: degrees, by which breasts fall to their sides
    flat: float = 1.0  #: depth of the breasts, in that of the template


#: From the commonest on.
PRESETS = (
    Preset("arms down", 25.0), Preset("supine", 60.0, 10.0, 0.85), Preset("arms up", 115.0),
)  # fmt: skip
#: Share of a raised arm that its shoulder does.
_SHOULDER = 0.25


def preset_posture(template: Template, preset: Preset) -> Posture:
    """The template in ``preset``: each bone attached to its parent, the root at rest."""
    number = {bone.name: k for k, bone in enumerate(template.bones)}
    turns = {name: np.zeros(3) for name in number}
    scales = np.ones((len(number), 3))
    for side, sign in (("left", 1.0), ("right", -1.0)):
        raised = np.radians(preset.abduction) - _hanging(template, number[f"arm_{side}"])
        shoulder = _SHOULDER * max(raised, 0.0)
        turns[f"shoulder_{side}"] = np.array([0.0, -sign * shoulder, 0.0])
        turns[f"arm_{side}"] = np.array([0.0, -sign * (raised - shoulder), 0.0])
        turns[f"breast_{side}"] = np.array([0.0, 0.0, sign * np.radians(preset.spread)])
        scales[number[f"breast_{side}"], 1] = preset.flat
    return chained(template, turns, scales)


def chained(template: Template, turns: dict[str, Floats], scales: Floats) -> Posture:
    """Bones turned (rad) against their parents, each joint where the parent carries it."""
    from scipy.spatial.transform import Rotation

    joints, rotations, shifts = template.joints, [], np.zeros_like(scales)
    for k, bone in enumerate(template.bones):
        own = Rotation.from_rotvec(turns[bone.name]).as_matrix()
        if bone.parent < 0:
            rotations.append(own)
            continue
        above = rotations[bone.parent]
        rotations.append(above @ own)
        arm = scales[bone.parent] * (joints[k] - joints[bone.parent])
        shifts[k] = above @ arm + joints[bone.parent] + shifts[bone.parent] - joints[k]
    return Posture(np.array(rotations), shifts, scales, np.zeros(len(template.blendshapes)))


def _hanging(template: Template, bone: int) -> float:
    """Angle of an arm of the template from hanging, rad."""
    along = template.weights[:, bone] @ (template.points - template.joints[bone])
    return float(np.arctan2(abs(along[0]), -along[2]))


@dataclass(frozen=True, eq=False)
class Shapes:
    """The presets of a template, with a table of the vertex that is nearest to each place.

    Attributes:
        postures: S of them.
        points, normals: (S, n, 3) m and unit.
        table: the same for the core's search.
    """

    postures: tuple[Posture, ...]
    points: Floats
    normals: Floats
    table: Any


_KNOWN: WeakKeyDictionary[Template, Shapes] = WeakKeyDictionary()


def shapes_of(template: Template, size: float = 0.03, margin: float = 0.12) -> Shapes:
    """Made once a template."""
    if template not in _KNOWN:
        _KNOWN[template] = _shapes(template, size, margin)
    return _KNOWN[template]


def _shapes(template: Template, size: float, margin: float) -> Shapes:
    from scipy.spatial import cKDTree

    postures = tuple(preset_posture(template, preset) for preset in PRESETS)
    points = np.array([posed(template, posture) for posture in postures])
    low, high = points.min(axis=(0, 1)) - margin, points.max(axis=(0, 1)) + margin
    counts = np.ceil((high - low) / size).astype(np.int64)
    axes = [low[i] + size * (0.5 + np.arange(counts[i])) for i in range(3)]
    centres = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
    nearest = np.array([cKDTree(shape).query(centres)[1] for shape in points])
    normals = np.array([vertex_normals(shape, template.triangles) for shape in points])
    table = core().PoseShapes(
        points.shape[1], points.reshape(-1, 3), normals.reshape(-1, 3),
        nearest.ravel().astype(np.int32), low, counts.astype(np.int32), size,
    )  # fmt: skip
    return Shapes(postures, points, normals, table)


def vertex_normals(points: Floats, triangles: Ints) -> Floats:
    """Unit outward normals (n, 3), weighted by area."""
    a, b, c = (points[triangles[:, i]] for i in range(3))
    cross = np.cross(b - a, c - a)
    total = np.stack([
        sum(np.bincount(triangles[:, i], cross[:, axis], len(points)) for i in range(3))
        for axis in range(3)
    ], axis=1)  # fmt: skip
    return np.asarray(total / np.maximum(np.linalg.norm(total, axis=1, keepdims=True), 1e-30))
