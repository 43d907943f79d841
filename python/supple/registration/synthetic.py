"""Scans that a depth camera would make of a posed template, with the truth beside them.

Stages: press the back on the table → sample the skin → add clutter → what the cameras see → cut
holes → noise along the rays → triangulate → carry it away by a rigid motion.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

import numpy as np
import numpy.typing as npt
from numpy.random import Generator

from supple.errors import InputError
from supple.registration.posture import Posture, posed
from supple.registration.synthetic_camera import Cameras, Samples, noisy, seen, triangulated
from supple.registration.synthetic_clutter import stray
from supple.registration.synthetic_posture import POSES, Pose, random_posture, turned
from supple.registration.template import Floats, Ints, Template
from supple.surface import Surface

__all__ = ["POSES", "Pose", "SyntheticScan", "Truth", "View", "random_posture", "synthetic_scan"]

Bools = npt.NDArray[np.bool_]
#: From all around, or from the front only: of somebody who lies or sits against something.
View = Literal["around", "front"]
#: The scanner's origin is as far away as this, m.
_AWAY = 0.8


@dataclass(frozen=True, eq=False, repr=False)
class Truth:
    """What a scan is of, in the scan's frame.

    Attributes:
        vertices: (n, 3) m, of the template as it was posed (and pressed on the table).
        posture: that poses the template there, but for what the table presses.
        R, t: (3, 3) and (3,) m of the rigid motion from the posture asked for to the scan.
        landmarks: name → (3,) m.
        curves: name → (k, 3) m.
        points: (k, 3) m even samples of the skin that the view shows, also where it is missing.
        triangle: (k,) of the template that each of ``points`` lies in.
    """

    vertices: Floats
    posture: Posture
    R: Floats
    t: Floats
    landmarks: Mapping[str, Floats]
    curves: Mapping[str, Floats]
    points: Floats
    triangle: Ints


@dataclass(frozen=True, eq=False, repr=False)
class SyntheticScan:
    """A scan with its truth.

    Attributes:
        surface: the scan, triangles where they were asked for.
        skin: (m,) bool: which of its points are the body's and not clutter.
        clean: (m, 3) m, its points without noise.
        truth: what it is of.
    """

    surface: Surface
    skin: Bools
    clean: Floats
    truth: Truth


def synthetic_scan(
    template: Template, posture: Posture, seed: int, *, points: int = 100_000,
    noise: float = 2e-3, missing: float = 0.3, clutter: float = 0.05, rotation: float = 45.0,
    view: View = "around", triangles: bool = True, press: float = 0.0,
    motion: tuple[Floats, Floats] | None = None,
) -> SyntheticScan:  # fmt: skip
    """A scan of ``template`` in ``posture``.

    Args:
        seed: of all that is drawn.
        points: about how many the scan has.
        noise: m, standard deviation along the rays, half its variance correlated over 12 mm.
        missing: share of the skin that the view shows and the scan lacks: hidden, or in holes.
        clutter: share of the points that are no skin: table or chair, blobs, speckles.
        rotation: degrees, the largest angle of the rigid motion that carries the scan away by up
            to 0.8 m an axis; 0: it stays where it is.
        view: cameras all around, or in front (−y) only.
        triangles: a mesh by camera; otherwise a cloud of points.
        press: m, how deep a table presses the back (+y) flat.
        motion: R (3, 3) and t (3,) m of the rigid motion, in place of a random one.

    Raises:
        InputError: numbers out of range; more hidden than may be missing is no error.
    """
    _check(points, noise, missing, clutter, view)
    random = np.random.default_rng(seed)
    body = Surface(pressed(posed(template, posture), press), template.triangles)
    cameras = Cameras.around(body.points, view)
    skin = _sampled(body, int(4 * points), random)
    shown = np.asarray(cameras.facing(skin.points, skin.normals).any(axis=1))
    density = points / (body.areas.sum() * shown.mean() * (1 - missing))
    others = stray(body, cameras, int(2 * points * clutter), density, view, random)
    found = seen(cameras, Samples.joined(skin, others))
    kept = _kept(skin, shown, found, points, missing, clutter, random)
    samples = Samples.joined(skin, others).of(kept)
    measured = noisy(cameras, samples.points, found[kept], noise, random)
    faces = triangulated(cameras, measured, found[kept]) if triangles else np.empty((0, 3), int)
    R, t = motion or _carried(rotation, random)
    even = random.choice(np.flatnonzero(shown), min(20_000, int(shown.sum())), replace=False)
    truth = _truth(template, posture, body, R, t, skin.of(even))
    return SyntheticScan(
        Surface(measured @ R.T + t, faces), kept < len(skin.points), samples.points @ R.T + t, truth
    )


def _carried(rotation: float, random: Generator) -> tuple[Floats, Floats]:
    R = turned(random, random.uniform(0.0, rotation))
    return R, random.uniform(-_AWAY, _AWAY, 3) * (rotation > 0)


def pressed(points: Floats, depth: float) -> Floats:
    """``points`` (n, 3) m lying on a table that flattens their back (+y) by ``depth`` m."""
    if depth <= 0:
        return points
    table, soft = points[:, 1].max() - depth, depth / 2
    flat = table - soft * np.logaddexp(0.0, (table - points[:, 1]) / soft)
    return np.column_stack([points[:, 0], flat, points[:, 2]])


def _check(points: int, noise: float, missing: float, clutter: float, view: str) -> None:
    if points < 100:
        raise InputError(f"points must be ≥ 100, got {points}.")
    if noise < 0:
        raise InputError(f"noise must be ≥ 0 m, got {noise}.")
    for name, value in (("missing", missing), ("clutter", clutter)):
        if not 0 <= value < 0.95:
            raise InputError(f"{name} must be a share, 0 to 0.95, got {value}.")
    if view not in ("around", "front"):
        raise InputError(f"view must be 'around' or 'front', got {view!r}.")


def _sampled(body: Surface, count: int, random: Generator) -> Samples:
    """``count`` points spread evenly over the triangles, none at a vertex."""
    areas = body.areas
    triangle = np.sort(random.choice(len(areas), count, p=areas / areas.sum()))
    root, v = np.sqrt(random.uniform(size=count)), random.uniform(size=count)
    weights = np.column_stack([1 - root, root * (1 - v), root * v])
    points = np.einsum("kc,kcd->kd", weights, body.points[body.triangles[triangle]])
    return Samples(points, body.normals[triangle], triangle)


def _kept(skin: Samples, shown: Bools, found: Ints, points: int, missing: float, clutter: float,
          random: Generator) -> Ints:  # fmt: skip
    """Numbers of the samples that the scan holds, skin before clutter."""
    count = len(skin.points)
    visible = found[:count] >= 0
    holes = _holes(skin.points, shown, visible, missing, random)
    ours = np.flatnonzero(visible & ~holes)
    theirs = count + np.flatnonzero(found[count:] >= 0)
    stray_points = min(len(theirs), int(points * clutter))
    return np.concatenate([
        np.sort(random.choice(ours, min(len(ours), points - stray_points), replace=False)),
        np.sort(random.choice(theirs, stray_points, replace=False)),
    ])  # fmt: skip


def _holes(points: Floats, shown: Bools, visible: Bools, missing: float,
           random: Generator) -> Bools:  # fmt: skip
    """Which points fall in holes: patches of 20 to 60 mm, until ``missing`` of the shown lack.

    A third of them lie beside what is hidden from the cameras, where scanners lose skin first.
    """
    from scipy.spatial import cKDTree

    tree, lost = cKDTree(points), shown & ~visible
    holes, want = np.zeros(len(points), dtype=bool), int(missing * shown.sum())
    while lost.sum() < want:
        edge = random.uniform() < 1 / 3 and lost.any()
        start = random.choice(np.flatnonzero(lost if edge else shown))
        radii = random.uniform(0.02, 0.06) * random.uniform(0.5, 1.0, 4)
        reach = random.normal(0.0, 0.02, (4, 3)) + points[start]
        for centre, radius in zip(reach, radii, strict=True):
            patch = np.asarray(tree.query_ball_point(centre, radius), dtype=np.int64)
            patch = patch[shown[patch] & ~lost[patch]][: max(want - int(lost.sum()), 0)]
            holes[patch] = lost[patch] = True
    return holes


def _truth(template: Template, posture: Posture, body: Surface, R: Floats, t: Floats,
           even: Samples) -> Truth:  # fmt: skip
    vertices = body.points @ R.T + t
    return Truth(
        vertices, posture.moved(R, t, template.joints), R, t, template.landmark_points(vertices),
        template.curve_points(vertices), even.points @ R.T + t, even.triangle,
    )  # fmt: skip
