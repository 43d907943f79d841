"""Depth cameras around a body: what they see, their noise, the mesh of each one's view."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from numpy.random import Generator

from supple.registration.template import Floats, Ints

Bools = npt.NDArray[np.bool_]
#: m from a camera to the body's centre.
_DISTANCE = 1.0
#: Skin at a steeper angle to the ray than 78° is lost.
_GRAZING = np.cos(np.radians(78.0))
#: rad, a pixel of the depth buffer (6 mm at 1 m), and how far behind the front is still front, m.
_PIXEL, _BEHIND = 0.006, 0.02
#: m, over which noise is correlated, and of its sum of waves how many.
_CORRELATED, _WAVES = 0.012, 48


@dataclass(frozen=True, eq=False, repr=False)
class Samples:
    """Points (n, 3) m of a surface, their outward normals (n, 3) and triangles (n,), -1 of none."""

    points: Floats
    normals: Floats
    triangle: Ints

    def of(self, rows: Ints) -> Samples:
        """Those ``rows``."""
        return Samples(self.points[rows], self.normals[rows], self.triangle[rows])

    @classmethod
    def joined(cls, first: Samples, second: Samples) -> Samples:
        """One after the other."""
        return cls(
            np.vstack([first.points, second.points]), np.vstack([first.normals, second.normals]),
            np.concatenate([first.triangle, second.triangle]),
        )  # fmt: skip


@dataclass(frozen=True, eq=False, repr=False)
class Cameras:
    """Pinholes that all look at one point.

    Attributes:
        eyes: (c, 3) m.
        axes: (c, 3, 3), rows: to the right, up and along the view of each.
    """

    eyes: Floats
    axes: Floats

    @classmethod
    def around(cls, points: Floats, view: str) -> Cameras:
        """Six around a body of ``points`` (n, 3) m, or five in front of it (−y)."""
        centre = (points.min(axis=0) + points.max(axis=0)) / 2
        turns = np.radians(np.arange(6) * 60.0 if view == "around" else (-55, 0, 55, 0, 0))
        rises = np.array([0.3, -0.3] * 3 if view == "around" else (0.1, 0.0, 0.1, 0.7, -0.7))
        level = np.sqrt(1 - rises**2)
        away = np.column_stack([np.sin(turns) * level, -np.cos(turns) * level, rises])
        right = np.cross(-away, (0.0, 0.0, 1.0))
        right /= np.linalg.norm(right, axis=1, keepdims=True)
        axes = np.stack([right, np.cross(right, -away), -away], axis=1)
        return cls(centre + _DISTANCE * away, axes)

    def rays(self, points: Floats) -> Floats:
        """Unit directions (n, c, 3) from each camera to each point."""
        rays = points[:, None] - self.eyes
        return np.asarray(rays / np.linalg.norm(rays, axis=2, keepdims=True))

    def facing(self, points: Floats, normals: Floats) -> Bools:
        """Which points (n, c) turn their outside to a camera, hidden or not."""
        return np.asarray(self.cosines(points, normals) > _GRAZING)

    def cosines(self, points: Floats, normals: Floats) -> Floats:
        """Of the angle between normal and direction to the camera, (n, c)."""
        return np.column_stack([
            -np.einsum("ni,ni->n", normals, _unit(points - eye)) for eye in self.eyes
        ])  # fmt: skip

    def image(self, camera: int, points: Floats) -> Floats:
        """(n, 3): tangents to the right and up in a camera's image, and distance m."""
        local = (points - self.eyes[camera]) @ self.axes[camera].T
        return np.column_stack([local[:, :2] / local[:, 2:], np.linalg.norm(local, axis=1)])


def seen(cameras: Cameras, samples: Samples) -> Ints:
    """The camera (n,) that sees each sample most squarely; -1 where none does."""
    cosines = cameras.cosines(samples.points, samples.normals)
    for camera in range(len(cameras.eyes)):
        cosines[_hidden(cameras.image(camera, samples.points)), camera] = -1.0
    best = cosines.argmax(axis=1)
    return np.where(cosines.max(axis=1) > _GRAZING, best, -1)


def _hidden(image: Floats) -> Bools:
    """Which points (n,) lie behind others in the same pixel of an image (n, 3)."""
    pixels = np.floor(image[:, :2] / _PIXEL).astype(np.int64)
    _, pixel = np.unique(pixels @ (1, 1 << 20), return_inverse=True)
    front = np.full(pixel.max() + 1, np.inf)
    np.minimum.at(front, pixel, image[:, 2])
    return np.asarray(image[:, 2] > front[pixel] + _BEHIND)


def noisy(cameras: Cameras, points: Floats, camera: Ints, sd: float, random: Generator) -> Floats:
    """``points`` moved along the rays of their cameras by a normal error of ``sd`` m.

    Half of its variance is white, half correlated over 12 mm, other waves for each camera.
    """
    moved = points.copy()
    for number, eye in enumerate(cameras.eyes):
        ours = camera == number
        waves = random.normal(size=(3, _WAVES)) / _CORRELATED
        phases = random.uniform(0, 2 * np.pi, _WAVES)
        smooth = np.cos(points[ours] @ waves + phases).sum(axis=1) * np.sqrt(2 / _WAVES)
        error = sd * np.sqrt(0.5) * (smooth + random.normal(size=len(smooth)))
        moved[ours] += error[:, None] * _unit(points[ours] - eye)
    return moved


def triangulated(cameras: Cameras, points: Floats, camera: Ints) -> Ints:
    """Triangles (t, 3) between neighbours in each camera's image, none across a jump in depth."""
    parts = []
    for number in range(len(cameras.eyes)):
        ours = np.flatnonzero(camera == number)
        if len(ours) > 3:
            image = cameras.image(number, points[ours])[:, :2]
            parts.append(ours[_short(_delaunay(image), points[ours])])
    return np.vstack([np.empty((0, 3), dtype=np.int64), *parts])


def _delaunay(image: Floats) -> Ints:
    """Triangles (t, 3), counter-clockwise in the image: outside towards the camera."""
    from scipy.spatial import Delaunay

    found = Delaunay(image).simplices.astype(np.int64)
    a, b, c = (image[found[:, i]] for i in range(3))
    u, v = b - a, c - a
    turned = u[:, 0] * v[:, 1] < u[:, 1] * v[:, 0]
    found[turned] = found[turned][:, ::-1]
    return np.asarray(found)


def _short(triangles: Ints, points: Floats) -> Ints:
    """Those whose edges are at most six times the usual edge, and that have an area."""
    corners = points[triangles]
    edges = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).max(axis=1)
    area = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]),
                          axis=1)  # fmt: skip
    return np.asarray(triangles[(edges < 6 * np.median(edges)) & (area > 1e-9 * edges**2)])


def _unit(vectors: Floats) -> Floats:
    return np.asarray(vectors / np.linalg.norm(vectors, axis=-1, keepdims=True))
