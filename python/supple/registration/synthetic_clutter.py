"""What a scan holds beside the body: a table or a chair, blobs, speckles."""

from __future__ import annotations

from functools import reduce

import numpy as np
from numpy.random import Generator

from supple.registration.synthetic_camera import Cameras, Samples
from supple.registration.template import Floats
from supple.surface import Surface

#: Shares of the clutter: furniture, blobs; the rest are speckles.
_FURNITURE, _BLOBS = 0.6, 0.3


def stray(body: Surface, cameras: Cameras, count: int, density: float, view: str,
          random: Generator) -> Samples:  # fmt: skip
    """``count`` samples of things about a ``body``, about ``density`` a m², as on skin.

    From the front these are pieces of a table under it, else a piece of a chair's back.
    """
    furniture = _table if view == "front" else _chair
    large, middle = int(_FURNITURE * count), int(_BLOBS * count)
    parts = [furniture(body.points, large, large / density, random)]
    number = int(random.integers(1, 4))
    parts += [_blob(body, middle // number, random) for _ in range(number)]
    parts += [_speckles(body.points, cameras, max(count - large - middle, 0), random)]
    return reduce(Samples.joined, parts)


def _table(points: Floats, count: int, area: float, random: Generator) -> Samples:
    """Pieces of a table's top on either side of the back that lies on it."""
    low, high = points.min(axis=0), points.max(axis=0)
    sides = random.choice([-1.0, 1.0], count)[:, None]
    half = _rectangle(area / 2, random)
    beside = np.array([(high[0] - low[0]) / 4 + half[0], 0.0, random.uniform(-0.2, 0.1)])
    on = (low + high) / 2 + sides * (1.0, 0.0, 0.0) * beside + (0.0, 0.0, beside[2])
    on = on + random.uniform(-1, 1, (count, 3)) * half
    on[:, 1] = high[1] + 1e-3
    return Samples(on, np.tile((0.0, -1.0, 0.0), (count, 1)), np.full(count, -1))


def _chair(points: Floats, count: int, area: float, random: Generator) -> Samples:
    """A piece of a chair's back behind the body, seen from both sides."""
    low, high = points.min(axis=0), points.max(axis=0)
    on = (low + high) / 2 + (random.uniform(-0.1, 0.1), 0.0, random.uniform(-0.25, 0.0))
    on = on + random.uniform(-1, 1, (count, 3)) * _rectangle(area, random)
    on[:, 1] = high[1] + random.uniform(0.04, 0.15)
    normals = np.where(random.uniform(size=(count, 1)) < 0.5, -1.0, 1.0) * (0.0, 1.0, 0.0)
    return Samples(on, normals, np.full(count, -1))


def _rectangle(area: float, random: Generator) -> Floats:
    """Half its sides along x and z, m."""
    aspect = random.uniform(0.6, 1.6)
    return np.sqrt(area * np.array([aspect, 0.0, 1 / aspect])) / 2


def _blob(body: Surface, count: int, random: Generator) -> Samples:
    """A ball of 2 to 6 cm that floats 3 to 20 cm off the skin."""
    from scipy.spatial import cKDTree

    radius, tree = random.uniform(0.02, 0.06), cKDTree(body.points)
    for _ in range(100):
        start = random.integers(len(body.triangles))
        foot = body.points[body.triangles[start]].mean(axis=0)
        centre = foot + (radius + random.uniform(0.03, 0.2)) * body.normals[start]
        if tree.query(centre)[0] > radius + 0.02:
            break
    normals = random.normal(size=(count, 3))
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    return Samples(centre + radius * normals, normals, np.full(count, -1))


def _speckles(points: Floats, cameras: Cameras, count: int, random: Generator) -> Samples:
    """Single points anywhere about the body, each seen by some camera."""
    low, high = points.min(axis=0) - 0.1, points.max(axis=0) + 0.1
    at = random.uniform(low, high, (count, 3))
    eyes = cameras.eyes[random.integers(len(cameras.eyes), size=count)]
    normals = eyes - at
    return Samples(at, normals / np.linalg.norm(normals, axis=1, keepdims=True),
                   np.full(count, -1))  # fmt: skip
