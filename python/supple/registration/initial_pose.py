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
        for _ in range(steps):
            _step(poses, points[few], normals[few], shapes, oriented, reach, keep)
        score = _score(poses, points[few], normals[few], shapes, oriented)
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


def _matched(poses: _Poses, points: Floats, normals: Floats, shapes: Shapes,
             oriented: bool) -> tuple[Floats, Floats, Floats, Floats]:  # fmt: skip
    """Scan points in the template's frame, their offsets and normals, and the normals' cosine."""
    q = poses.a[:, None, None] * (points @ poses.R.transpose(0, 2, 1)) + poses.b[:, None]
    at = shapes.at(poses.shape, q)
    rows = poses.shape[:, None], at
    normal = shapes.normals[rows]
    cosine = np.einsum("cmi,cmi->cm", normals @ poses.R.transpose(0, 2, 1), normal)
    known = (normals != 0).any(axis=1)
    cosine = np.where(known, cosine if oriented else np.abs(cosine), 0.7)
    return q, shapes.points[rows] - q, normal, cosine


def _step(poses: _Poses, points: Floats, normals: Floats, shapes: Shapes, oriented: bool,
          reach: float, keep: SearchSettings) -> None:  # fmt: skip
    """One damped Gauss–Newton step of turn, shift and size for each candidate, in place."""
    q, offset, normal, cosine = _matched(poses, points, normals, shapes, oriented)
    square = np.einsum("cmi,cmi->cm", offset, offset)
    weight = np.clip(cosine, 0.05, None) / (1 + square / reach**2) ** 2
    weight /= weight.sum(axis=1, keepdims=True)
    middle = np.einsum("cm,cmi->ci", weight, q)
    arm = q - middle[:, None]
    plane = _rows(arm, normal) * np.sqrt(weight)[..., None]
    matrix = plane.transpose(0, 2, 1) @ plane
    right = np.einsum("cmp,cm->cp", plane,
                      np.sqrt(weight) * np.einsum("cmi,cmi->cm", normal, offset))  # fmt: skip
    # a share of point-to-point: planes alone let a flat or round part slide away
    along = np.einsum("cm,cmi->ci", weight, offset)
    second = np.einsum("cm,cmi,cmj->cij", weight, arm, arm)
    trace = np.trace(second, axis1=1, axis2=2)
    share = 0.15
    matrix[:, :3, :3] += share * (trace[:, None, None] * np.eye(3) - second)
    matrix[:, 3:6, 3:6] += share * np.eye(3)
    matrix[:, 6, 6] += share * trace + (0.02 / keep.size_sd) ** 2
    right[:, :3] += share * np.einsum("cm,cmi->ci", weight, np.cross(arm, offset))
    right[:, 3:6] += share * along
    right[:, 6] += share * np.einsum("cm,cmi,cmi->c", weight, arm, offset)
    right[:, 6] -= (0.02 / keep.size_sd) ** 2 * np.log(poses.a)
    matrix += 1e-7 * np.eye(7)
    _move(poses, np.linalg.solve(matrix, right[..., None])[..., 0], middle)


def _rows(arm: Floats, normal: Floats) -> Floats:
    """Derivative (C, m, 7) of the distance along ``normal`` by turn, shift and log of size."""
    return np.concatenate(
        [np.cross(arm, normal), normal, np.einsum("cmi,cmi->cm", arm, normal)[..., None]], axis=2
    )


def _move(poses: _Poses, motion: Floats, middle: Floats) -> None:
    from scipy.spatial.transform import Rotation

    length = np.linalg.norm(motion[:, :3], axis=1)
    motion[:, :3] *= np.minimum(1.0, 0.6 / np.maximum(length, 1e-12))[:, None]
    turn = Rotation.from_rotvec(motion[:, :3]).as_matrix()
    grow = np.exp(np.clip(motion[:, 6], -0.1, 0.1))
    grow = np.clip(poses.a * grow, 0.7, 1.4) / poses.a
    moved = np.einsum("cij,cj->ci", turn, poses.b - middle)
    poses.b = grow[:, None] * moved + middle + motion[:, 3:6]
    poses.R, poses.a = turn @ poses.R, poses.a * grow


def _score(poses: _Poses, points: Floats, normals: Floats, shapes: Shapes,
           oriented: bool) -> Floats:  # fmt: skip
    """Mean distance (C,) m, capped at 8 cm; a wrong side costs as much as 6 cm."""
    _, offset, _, cosine = _matched(poses, points, normals, shapes, oriented)
    away = np.linalg.norm(offset, axis=2) + 0.03 * (1 - np.clip(cosine, -1, 1))
    return np.asarray(np.minimum(away, 0.08).mean(axis=1) / np.sqrt(poses.a))


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
