"""Triangles on the procedural torso: marching cubes of one half, cut, remeshed and mirrored."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from supple.errors import InputError
from supple.registration import procedural_body as body
from supple.signals import signals_kept

Floats = npt.NDArray[np.float64]
Ints = npt.NDArray[np.int64]

ARM_END, NECK_END, WAIST_END = 0.164, 0.092, -0.300  #: cuts: along arm and neck, and a height, m
_CELL = 0.010  # of marching cubes, m
_NOTCH = np.array([0.0, -0.037, 0.150])  # where the profile turns sharply, m
_ARMPIT = np.array([0.148, 0.022, 0.036])  # where weights change within few edges, m
_LOW, _HIGH = (-0.17, -0.32), (0.15, 0.28)  # the box in y and z; x from 0 to 0.33


@dataclass(frozen=True, eq=False)
class Skin:
    """Both halves: the left vertices and triangles come first, those on the midline before all."""

    points: Floats
    triangles: Ints
    mirror: Ints


def skin(spacing: float) -> Skin:
    """The cut torso, edges at most ``spacing`` m, finer on the breasts, a vertex on each nipple."""
    if not 0.004 <= spacing <= 0.04:
        raise InputError(f"spacing must be 0.004 to 0.04 m, got {spacing}.")
    points, triangles = _marched()
    for height, normal in cuts():
        points, triangles = _clipped(points, triangles, height(points), normal)
    points = settled(points)
    points, triangles = _remeshed(points, triangles, spacing)
    return _both_halves(_evened(settled(points), triangles), triangles)


def sizes(points: Floats, spacing: float) -> Floats:
    """Wanted edge length (n,) m: ``spacing``, less on the front of the chest, least on a breast."""
    q = (points - body.BREAST) @ body.BREAST_AXES.T
    far = np.linalg.norm(q / (0.085, 0.085, 0.085), axis=1)
    near = 1 / (1 + np.exp((far - 1.15) / 0.12))
    near = np.maximum(near, 0.9 * np.exp(-((points - _ARMPIT) ** 2).sum(axis=1) / 0.05**2))
    near = np.maximum(near, 1.1 * np.exp(-((points - _NOTCH) ** 2).sum(axis=1) / 0.03**2))
    tip = np.exp(-(((q[:, :2] - body.NIPPLE[:2]) ** 2).sum(axis=1) / 0.014**2)) * (q[:, 2] > 0)
    return np.asarray(spacing * (1 - 0.47 * near) * (1 - 0.50 * tip))


def _marched() -> tuple[Floats, Ints]:
    """The uncut left half, its vertices on the level set, its edge at x = 0 exactly."""
    from skimage.measure import marching_cubes

    axes = [
        np.arange(a, b + _CELL, _CELL) for a, b in zip((0.0, *_LOW), (0.33, *_HIGH), strict=True)
    ]
    grid = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1)
    values = body.level(grid.reshape(-1, 3)).reshape(grid.shape[:3])
    # a crossing next to a corner would make a sliver; the vertices move to the zero later
    values = np.copysign(np.maximum(np.abs(values), 0.1 * _CELL), values)
    draw: Any = marching_cubes
    at, triangles, _, _ = draw(values, 0.0, allow_degenerate=False)
    return at.astype(np.float64) * _CELL + (0.0, *_LOW), triangles.astype(np.int64)


def cuts() -> tuple[tuple[Callable[[Floats], Floats], Floats], ...]:
    """The planes where arm, neck and hip end: height (n,) m above each (inside), unit normal."""
    return (
        (_above_arm_end, -body.ARM),
        (lambda p: NECK_END - (p - body.NECK) @ body.NECK_AXIS, -body.NECK_AXIS),
        (lambda p: p[:, 2] - WAIST_END, np.array([0.0, 0.0, 1.0])),
    )


def _above_arm_end(p: Floats) -> Floats:
    below = (p - body.SHOULDER) @ body.ARM - ARM_END
    return np.asarray(np.maximum(-below, body.arm(p) - 0.03))


def settled(points: Floats, steps: int = 4) -> Floats:
    """``points`` moved onto the level set by Newton's method; those on a plane slide in it."""
    points = points.copy()
    midline = np.abs(points[:, 0]) < 1e-4
    points[midline, 0] = 0.0
    held = [(midline, np.array([1.0, 0.0, 0.0]))]
    held += [(np.abs(height(points)) < 1e-4, normal) for height, normal in cuts()]
    for _ in range(steps):
        slope = body.slope(points)
        way = slope.copy()
        for _ in range(8):  # alternating projections meet both planes at a corner
            for on, normal in held:
                way[on] -= np.outer(way[on] @ normal, normal)
        points -= (body.level(points) / np.einsum("nd,nd->n", way, slope))[:, None] * way
        points[midline, 0] = 0.0
    return points


def _clipped(
    points: Floats, triangles: Ints, height: Floats, normal: Floats
) -> tuple[Floats, Ints]:
    """The part above a plane; vertices close to it are moved into it, so that no sliver is left."""
    close = np.abs(height) < 0.3 * _CELL
    points = points - np.where(close, height, 0.0)[:, None] * normal
    height = np.where(close, 0.0, height)
    sign = np.sign(height)[triangles]
    whole = (sign >= 0).all(axis=1) & (sign > 0).any(axis=1)
    cut = (sign > 0).any(axis=1) & (sign < 0).any(axis=1)
    made: dict[tuple[int, int], int] = {}
    extra: list[Floats] = []
    pieces: list[tuple[int, int, int]] = []

    def crossing(i: int, j: int) -> int:
        key = (min(i, j), max(i, j))
        if key not in made:
            s = height[key[0]] / (height[key[0]] - height[key[1]])
            made[key] = len(points) + len(extra)
            extra.append(points[key[0]] + s * (points[key[1]] - points[key[0]]))
        return made[key]

    for corners in triangles[cut].tolist():
        kept: list[int] = []
        for i, j in zip(corners, corners[1:] + corners[:1], strict=True):
            kept += [i] if height[i] >= 0 else []
            kept += [crossing(i, j)] if height[i] * height[j] < 0 else []
        pieces += [(kept[0], kept[k], kept[k + 1]) for k in range(1, len(kept) - 1)]
    all_points = np.vstack([points, *extra])
    all_triangles = np.vstack([triangles[whole], np.array(pieces, dtype=np.int64).reshape(-1, 3)])
    used, renamed = np.unique(all_triangles, return_inverse=True)
    return all_points[used], renamed.reshape(-1, 3)


@signals_kept()
def _remeshed(points: Floats, triangles: Ints, spacing: float) -> tuple[Floats, Ints]:
    """By Mmg; the border keeps its place, since Mmg holds open edges as ridges."""
    from mmgpy import MmgMeshS

    mesh = MmgMeshS(points, triangles.astype(np.int32))
    mesh["metric"] = np.ascontiguousarray(sizes(points, spacing)[:, None])
    mesh.remesh(hausd=0.01, hmin=spacing / 4, hmax=spacing, hgrad=1.5, verbose=-1)
    return mesh.get_vertices(), mesh.get_triangles().astype(np.int64)


def border(triangles: Ints) -> Ints:
    """Edges (e, 2) of one triangle only, in its sense."""
    edges = np.concatenate([triangles[:, [i, (i + 1) % 3]] for i in range(3)])
    _, first, count = np.unique(
        np.sort(edges, axis=1), axis=0, return_index=True, return_counts=True
    )
    return np.asarray(edges[first[count == 1]])


def _evened(points: Floats, triangles: Ints) -> Floats:
    """A vertex put on the nipple; the others, but for the border's, moved among their neighbours.

    Three damped steps of Laplace's smoothing, each followed by the way back to the level set.
    """
    tip = body.nipple()
    nearest = np.linalg.norm(points - tip, axis=1).argmin()
    points[nearest] = tip
    edges = np.unique(
        np.sort(triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1), axis=0
    )
    a, b = np.vstack([edges, edges[:, ::-1]]).T
    count = np.bincount(a, minlength=len(points))[:, None]
    free = np.ones(len(points), dtype=bool)
    free[border(triangles)] = free[nearest] = False
    for _ in range(3):
        summed = np.stack([np.bincount(a, x[b], len(points)) for x in points.T], axis=1)
        points[free] += 0.5 * (summed / count - points)[free]
        points = settled(points, 2)
    return settled(points)


def _both_halves(points: Floats, triangles: Ints) -> Skin:
    order = np.argsort(points[:, 0] != 0, kind="stable")
    rank = np.empty_like(order)
    rank[order] = np.arange(len(order))
    left, faces = points[order], rank[triangles]
    shared = int((left[:, 0] == 0).sum())
    opposite = np.arange(len(left))
    opposite[shared:] += len(left) - shared
    right = left[shared:] * (-1, 1, 1)
    mirror = np.concatenate([opposite, np.arange(shared, len(left))])
    return Skin(np.vstack([left, right]), np.vstack([faces, opposite[faces][:, [0, 2, 1]]]), mirror)
