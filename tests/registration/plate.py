"""A template whose measures are known: two bumps on a plane or a parabolic cylinder."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from supple import Surface
from supple.registration.template import BONES, LANDMARKS, Bone, OnSurface, Template

WIDTH, HEIGHT = 0.32, 0.24
#: Centres of the bumps, left first: x, z; and their radius, m.
CENTRES, RADIUS = ((0.08, 0.0), (-0.08, 0.0)), 0.06


def cap(height: float = 0.03) -> Callable:
    """The spherical cap of ``height`` over the circle of radius RADIUS, over r."""
    ball = (RADIUS**2 + height**2) / (2 * height)

    def at(r: np.ndarray) -> np.ndarray:
        return np.where(r < RADIUS, np.sqrt(np.maximum(ball**2 - r**2, 0)) - (ball - height), 0.0)

    return at


def cap_volume(height: float = 0.03) -> float:
    return np.pi * height * (3 * RADIUS**2 + height**2) / 6


def plate(
    cells: int = 40, left: Callable | None = None, right: Callable | None = None, bend: float = 0.0
) -> Template:
    """A sheet that faces the front, with ``cells`` squares along x, bumps, curvature ``bend`` 1/m.

    The bend is that of a parabolic cylinder along z: y = bend x² / 2. The two
    blendshapes add a tenth of a bump's height each.
    """
    nx, nz = cells, round(cells * HEIGHT / WIDTH)
    x = np.linspace(-WIDTH / 2, WIDTH / 2, nx + 1)
    z = np.linspace(-HEIGHT / 2, HEIGHT / 2, nz + 1)
    grid = np.stack(np.meshgrid(x, z, indexing="ij"), axis=-1).reshape(-1, 2)
    step = WIDTH / nx
    for centre in CENTRES:  # vertices on the circles, where the caps' slope jumps
        r = np.hypot(*(grid - centre).T)[:, None]
        near = np.abs(r - RADIUS) < step / 2
        grid = np.where(near, centre + (grid - centre) * RADIUS / np.maximum(r, step), grid)
    bumps = [bump(np.hypot(*(grid - centre).T)) for bump, centre in
             zip((left or cap(), right or cap()), CENTRES, strict=True)]  # fmt: skip
    chest = bend * grid[:, 0] ** 2 / 2
    points = np.column_stack([grid[:, 0], chest - sum(bumps), grid[:, 1]])
    names = np.arange(len(grid)).reshape(nx + 1, nz + 1)
    a, b, c, d = (names[i : i + nx, j : j + nz].ravel() for i, j in
                  ((0, 0), (1, 0), (1, 1), (0, 1)))  # fmt: skip
    rising = grid[a, 0] < -1e-9  # diagonals mirrored, so that the sheet is
    for centre in CENTRES:  # and no diagonal across a circle
        beyond = np.hypot(*(grid - centre).T) - RADIUS
        beyond[np.abs(beyond) < 1e-9] = 0
        rising = np.where(beyond[a] * beyond[c] < 0, False, rising)
        rising = np.where(beyond[b] * beyond[d] < 0, True, rising)
    triangles = np.vstack([np.where(rising[:, None], np.stack(p, 1), np.stack(q, 1)) for p, q in
                           (((a, b, c), (a, b, d)), ((a, c, d), (b, c, d)))])  # fmt: skip
    shapes = np.zeros((2, len(grid), 3))
    shapes[0, :, 1], shapes[1, :, 1] = -0.1 * bumps[0], -0.1 * bumps[1]
    return _template(points, triangles, names, shapes)


def _template(
    points: np.ndarray, triangles: np.ndarray, names: np.ndarray, shapes: np.ndarray
) -> Template:
    surface = Surface(points, triangles)

    def front(flat: np.ndarray, closed: bool = False) -> OnSurface:
        """Places seen from the front at (k, 2) x, z."""
        sheet = Surface(points * [1, 0, 1], triangles)
        landed = sheet.closest(np.insert(np.atleast_2d(flat), 1, 0.0, axis=1))
        return OnSurface(landed.triangle.astype(np.int64), landed.barycentric, closed)

    turn = np.linspace(0, 2 * np.pi, 180, endpoint=False)
    circle = RADIUS * np.column_stack([np.cos(turn), np.sin(turn)])
    flat = {"sternum_notch": 0, "sternal_notch": (0, 0.1), "xiphoid": (0, -0.08)}
    for side, (x, z) in zip(("left", "right"), CENTRES, strict=True):
        out = np.sign(x)
        flat |= {f"nipple_{side}": (x, z), f"axilla_{side}": (x + 0.07 * out, z + 0.1),
                 f"breast_medial_{side}": (x - RADIUS * out, z),
                 f"breast_lateral_{side}": (x + RADIUS * out, z),
                 f"breast_inferior_{side}": (x, z - RADIUS)}  # fmt: skip
    down = np.linspace(0.1, 0.0, 20)[:, None] * [0, 1]
    curves = {"breast_left": front(circle + CENTRES[0], True),
              "breast_right": front(circle + CENTRES[1], True),
              "sternum_arrow_upper": front(down),
              "sternum_arrow_lower": front(down - [0, 0.08])}  # fmt: skip
    inside = {f"breast_{side}": np.hypot(*(points[:, [0, 2]] - centre).T) < RADIUS
              for side, centre in zip(("left", "right"), CENTRES, strict=True)}  # fmt: skip
    none = np.zeros(len(points), dtype=bool)
    weights = np.zeros((len(points), len(BONES)))
    weights[:, [name for name, _ in BONES].index("chest")] = 1
    assert len(surface.triangles)
    return Template(
        points, triangles, tuple(Bone(name, parent, (0.0, 0.0, 0.0)) for name, parent in BONES),
        weights, shapes, ("size_left", "size_right"), np.array([[-5.0, 5.0], [-5.0, 5.0]]),
        {name: front(np.array(flat[name])) for name in LANDMARKS}, curves,
        {**dict.fromkeys(("sternum", "back", "abdomen", "neck", "arm_left", "arm_right"), none),
         **inside}, names[::-1].ravel(), "plate",
    )  # fmt: skip
