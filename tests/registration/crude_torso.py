"""A torso of a few formulas, so that a test of the fit needs no file and no other template."""

from __future__ import annotations

import numpy as np

from supple.registration.posture import Posture
from supple.registration.template import (
    BONES,
    CURVES,
    LANDMARKS,
    REGIONS,
    Bone,
    OnSurface,
    Template,
)

#: x, y, z (m) of each bone's joint.
JOINTS = (
    (0, 0, -0.25), (0, 0, 0.0), (0, 0, 0.25), (0.12, 0, 0.2), (-0.12, 0, 0.2), (0.16, 0, 0.12),
    (-0.16, 0, 0.12), (0.07, -0.06, 0.05), (-0.07, -0.06, 0.05),
)  # fmt: skip


def crude_torso(around: int = 40, along: int = 30, shapes: int = 12, seed: int = 0) -> Template:
    """An elliptic tube, 0.34 m × 0.22 m × 0.6 m, with two bulges in front; z = ±0.3 m are open."""
    points, triangles = _tube(around, along)
    landmark = OnSurface(np.array([len(triangles) // 2]), np.array([[0.2, 0.3, 0.5]]))
    return Template(
        points, triangles, _bones(), _weights(points), _shapes(points, shapes, seed),
        tuple(f"shape_{a}" for a in range(shapes)), np.tile([-3.0, 3.0], (shapes, 1)),
        {name: _spread(landmark, i, len(triangles)) for i, name in enumerate(LANDMARKS)},
        dict.fromkeys(CURVES, landmark),
        {name: np.zeros(len(points), dtype=bool) for name in REGIONS},
        np.arange(len(points)), "tube",
    )  # fmt: skip


def some_posture(template: Template, seed: int, size: float = 1.0) -> Posture:
    """Every unknown at random: turns of 0.1 rad, shifts of 1 cm, scales of 5 %, blend of 0.7."""
    rng = np.random.default_rng(seed)
    bones, shapes = len(template.bones), len(template.blendshapes)
    per_bone = rng.standard_normal((bones, 3, 3)) * np.array([0.1, 0.01, 0.05])[:, None]
    blend = 0.7 * rng.standard_normal(shapes)
    return Posture.rest(template).stepped(size * np.concatenate([per_bone.ravel(), blend]))


def chained_posture(template: Template, seed: int, turn: float = 0.1) -> Posture:
    """Turns and scales at random, joints together, blend of about 1."""
    rng = np.random.default_rng(seed)
    rest = Posture.rest(template)
    bones = len(template.bones)
    step = np.zeros((bones, 3, 3))
    step[:, 0] = turn * rng.standard_normal((bones, 3))
    step[:, 2] = 0.04 * rng.standard_normal((bones, 3))
    free = rest.stepped(np.concatenate([step.ravel(), 0.7 * rng.standard_normal(len(rest.blend))]))
    shifts = np.zeros((bones, 3))
    for k, bone in enumerate(template.bones):
        if (p := bone.parent) >= 0:
            arm = template.joints[k] - template.joints[p]
            carried = free.rotations[p] @ (free.scales[p] * arm)
            shifts[k] = carried + template.joints[p] + shifts[p] - template.joints[k]
    return Posture(free.rotations, shifts, free.scales, free.blend)


def _tube(around: int, along: int) -> tuple[np.ndarray, np.ndarray]:
    angle = np.linspace(0, 2 * np.pi, around, endpoint=False)
    z, a = (grid.ravel() for grid in np.meshgrid(np.linspace(-0.3, 0.3, along), angle,
                                                 indexing="ij"))  # fmt: skip
    x, y = 0.17 * np.cos(a), 0.11 * np.sin(a)
    for side in (-0.07, 0.07):
        bulge = np.exp(-((x - side) ** 2 + (z - 0.05) ** 2) / 0.05**2)
        y = np.where(y < 0, y - 0.05 * bulge, y)
    y = y * (1 + 0.15 * np.sin(5 * z))
    i, j = (grid.ravel() for grid in np.meshgrid(np.arange(along - 1), np.arange(around),
                                                 indexing="ij"))  # fmt: skip
    p, right = i * around + j, i * around + (j + 1) % around
    lower = np.stack([p, right, right + around], axis=1)
    upper = np.stack([p, right + around, p + around], axis=1)
    return np.stack([x, y, z], axis=1), np.vstack([lower, upper])


def _bones() -> tuple[Bone, ...]:
    named = zip(BONES, JOINTS, strict=True)
    return tuple(Bone(name, parent, joint) for (name, parent), joint in named)


def _weights(points: np.ndarray) -> np.ndarray:
    distance = np.linalg.norm(points[:, None] - np.array(JOINTS), axis=2)
    weights = np.exp(-((distance / 0.1) ** 2)) + 1e-12
    weights[weights < np.sort(weights, axis=1)[:, -4:-3]] = 0  # four bones a vertex
    return np.asarray(weights / weights.sum(axis=1, keepdims=True))


def _shapes(points: np.ndarray, count: int, seed: int) -> np.ndarray:
    """Local bumps, 1 cm high."""
    rng = np.random.default_rng(seed)
    centres = points[rng.choice(len(points), count, replace=False)]
    distance = np.linalg.norm(points[None] - centres[:, None], axis=2)
    height = 0.01 * np.exp(-((distance / 0.06) ** 2))
    height[distance > 0.15] = 0
    outward = points * np.array([1, 1, 0])
    outward /= np.linalg.norm(outward, axis=1, keepdims=True)
    return np.asarray(height[:, :, None] * outward)


def _spread(landmark: OnSurface, i: int, triangles: int) -> OnSurface:
    return OnSurface((landmark.triangle + 131 * i) % triangles, landmark.barycentric)
