"""Where a torso stands in a scan: a search over all rotations and a few ways to hold the arms.

1. starts    60 rotations that no rotation is further than 45° from, times the presets, each with
             the middles of scan and template together
2. descend   all of them at once: few points, partners from a table, robust point-to-plane steps
3. halve     the worse are left out, the better go on with more points
4. rank      by robust distance; poses that are alike count once

Source: groups of rotations as a net on SO(3), Yershova et al. (2010), IJRR 29(7); the steps are
Chen & Medioni's (1992).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from supple.core import core
from supple.registration.pose_presets import PRESETS, Shapes, shapes_of
from supple.registration.posture import Posture
from supple.registration.template import Floats, Ints, Template


@dataclass(frozen=True)
class SearchSettings:
    """How thoroughly the initial pose is sought; lengths in m."""

    points: tuple[int, ...] = (80, 160, 320)  #: of the scan, in each round
    steps: tuple[int, ...] = (5, 6, 8)  #: of each round
    kept: tuple[int, ...] = (40, 12, 6)  #: candidates after each round
    reach: tuple[float, ...] = (0.12, 0.08, 0.05)  #: residual that counts a quarter
    apart: float = 0.04  #: candidates closer than this on average are one
    size_sd: float = 0.08  #: of bodies against the template
    seed: int = 0  #: of the points that are drawn


@dataclass(frozen=True, eq=False)
class Candidate:
    """A posture to begin with."""

    posture: Posture
    preset: str
    score: float  #: m, mean robust distance of scan to template


@dataclass(eq=False)
class _Poses:
    """C similarities q = a R x + b from the scan to the shape, m."""

    R: Floats  # (C, 3, 3)
    b: Floats  # (C, 3)
    a: Floats  # (C,)
    shape: Ints  # (C,)

    def of(self, rows: Ints) -> _Poses:
        return _Poses(self.R[rows], self.b[rows], self.a[rows], self.shape[rows])


def candidates(
    points: Floats, normals: Floats, template: Template, oriented: bool,
    settings: SearchSettings | None = None,
) -> list[Candidate]:  # fmt: skip
    """Postures that the scan may show, best first.

    Args:
        points: (c, 3) m, evenly spread over the scan.
        normals: (c, 3) unit, of a sign that means something if ``oriented``; 0 where unknown.
    """
    keep, shapes = settings or SearchSettings(), shapes_of(template)
    random = np.random.default_rng(keep.seed)
    order = random.permutation(len(points))
    poses = _starts(np.median(points, axis=0), shapes)
    score: Floats = np.zeros(len(poses.a))
    for count, steps, kept, reach in zip(
        keep.points, keep.steps, keep.kept, keep.reach, strict=True
    ):
        few = order[:count]
        poses.R, poses.b, poses.a, score = core().descend(
            shapes.table, points[few], normals[few], oriented, steps, reach, keep.size_sd,
            poses.R, poses.b, poses.a, poses.shape.astype(np.int32),
        )  # fmt: skip
        best = _different(poses, shapes, np.argsort(score), kept, keep.apart)
        poses, score = poses.of(best), score[best]
    return [_candidate(poses, i, score[i], shapes, template) for i in range(len(score))]


@lru_cache(maxsize=1)
def rotations() -> Floats:
    """The rotations (60, 3, 3) of an icosahedron: none of SO(3) is further than 44.5° from one."""
    from scipy.spatial.transform import Rotation

    return np.asarray(Rotation.create_group("I").as_matrix())


def _starts(middle: Floats, shapes: Shapes) -> _Poses:
    turns, count = rotations(), len(shapes.postures)
    R = np.tile(turns, (count, 1, 1))
    shape = np.repeat(np.arange(count), len(turns))
    b = np.median(shapes.points, axis=1)[shape] - R @ middle
    return _Poses(R, b, np.ones(len(R)), shape)


def _different(poses: _Poses, shapes: Shapes, order: Ints, most: int, apart: float) -> Ints:
    """The first of ``order`` that place the torso differently, at most ``most``."""
    some = shapes.points[0][:: max(1, shapes.points.shape[1] // 40)]
    back = np.einsum("cji,cmj->cmi", poses.R, some - poses.b[:, None]) / poses.a[:, None, None]
    kept: list[int] = []
    for i in order:
        alike = [
            k for k in kept if poses.shape[k] == poses.shape[i]
            and np.linalg.norm(back[k] - back[i], axis=1).mean() < apart
        ]  # fmt: skip
        if not alike:
            kept.append(int(i))
        if len(kept) == most:
            break
    return np.array(kept)


def _candidate(
    poses: _Poses, i: int, score: float, shapes: Shapes, template: Template
) -> Candidate:
    """The posture that carries the template to the scan: the inverse of the similarity."""
    shape, size = shapes.postures[poses.shape[i]], 1 / poses.a[i]
    R, t = poses.R[i].T, -poses.R[i].T @ poses.b[i] * size
    shifts = size * (template.joints + shape.translations) @ R.T + t - template.joints
    posture = Posture(R @ shape.rotations, shifts, size * shape.scales, shape.blend)
    return Candidate(posture, PRESETS[poses.shape[i]].name, float(score))
