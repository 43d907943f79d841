"""The surface scan of the supine patient: triangles with noise, holes and a frame of its own."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from supple.breast.phantom_anatomy import Array
from supple.breast.phantom_mesh import Box, Index
from supple.breast.phantom_skin import Skin, sample_skin


@dataclass(frozen=True)
class ScanSettings:
    """What the scanner sees.

    Attributes:
        each: a cell's face becomes each x each pairs of triangles.
        noise: standard deviation across the surface, m.
        holes: how many.
        hole_radius: smallest and largest, m.
        flank: azimuth, rad, up to which it sees around the flanks.
    """

    each: int = 3
    noise: float = 1e-3
    holes: int = 10
    hole_radius: tuple[float, float] = (5e-3, 14e-3)
    flank: float = 1.55


@dataclass(frozen=True)
class Scan:
    """A triangle surface: points (v, 3) m and triangles (t, 3), outward."""

    points: Array
    triangles: Index


def make_scan(
    box: Box, supine: Array, rng: np.random.Generator, settings: ScanSettings | None = None
) -> Scan:
    """Scan of the skin of the mesh whose nodes lie at ``supine`` (n, 3) m, in the same frame."""
    settings = settings or ScanSettings()
    skin = sample_skin(box, supine, settings.each)
    triangles = _triangles(skin.points.shape[0], skin.points.shape[1])
    seen = _seen(skin, rng, settings).ravel()
    noise = rng.normal(0.0, settings.noise, skin.points.shape[:2])
    points = skin.points + noise[..., None] * skin.normals
    return _compact(points.reshape(-1, 3), triangles[seen[triangles].all(axis=1)])


def _triangles(rows: int, columns: int) -> Index:
    """Two triangles for every square of a grid of points, counter-clockwise from outside."""
    ids = np.arange(rows * columns).reshape(rows, columns)
    a, b, c, d = ids[:-1, :-1], ids[1:, :-1], ids[1:, 1:], ids[:-1, 1:]
    first, second = np.stack([a, b, c], axis=-1), np.stack([a, c, d], axis=-1)
    return np.concatenate([first.reshape(-1, 3), second.reshape(-1, 3)])


def _seen(skin: Skin, rng: np.random.Generator, settings: ScanSettings) -> Array:
    """Mask of samples inside the ragged border and outside the holes."""
    azimuth, level = skin.zeta[..., 0], skin.zeta[..., 1]
    phases = rng.uniform(0.0, 2.0 * np.pi, 4)
    border = settings.flank + 0.04 * np.sin(90.0 * level + phases[0])
    seen = np.abs(azimuth) < border + 0.02 * np.sin(310.0 * level + phases[1])
    top = level.max() - 6e-3 + 4e-3 * np.sin(5.0 * azimuth + phases[2])
    bottom = level.min() + 6e-3 + 4e-3 * np.sin(7.0 * azimuth + phases[3])
    seen &= (level < top) & (level > bottom)
    inside = np.argwhere(seen)
    for _ in range(settings.holes):
        centre = skin.points[tuple(inside[rng.integers(len(inside))])]
        radius = rng.uniform(*settings.hole_radius)
        seen &= np.linalg.norm(skin.points - centre, axis=-1) > radius
    return np.asarray(seen)


def _compact(points: Array, triangles: Index) -> Scan:
    """The surface without points that no triangle uses."""
    used, numbers = np.unique(triangles, return_inverse=True)
    return Scan(points[used], numbers.reshape(-1, 3))
