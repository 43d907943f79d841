"""What a prediction says, as result.json: lengths in mm, LPS; and where that is in the breast."""

from __future__ import annotations

import json
import os
import tempfile
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from supple.errors import InputError

Array = NDArray[np.float64]
Point = tuple[float, float, float]


#: The estimate was up to 20 mm off on images whose nipples are known.
NIPPLE_ESTIMATED = (
    "The nipple was estimated from the breast's shape and may be 20 mm off, and with it clock and "
    "distance from it: give its place to be sure."
)


@dataclass(frozen=True)
class SkinPoint:
    """A point that the skin carries along: a triangle and barycentric coordinates in it."""

    triangle: int
    weights: Point

    def on(self, points: ArrayLike, triangles: ArrayLike) -> Array:
        """Its place (3,) on the moved skin: points (n, 3), triangles (t, 3)."""
        corners = np.asarray(points, dtype=float)[np.asarray(triangles)[self.triangle]]
        return np.asarray(np.asarray(self.weights) @ corners)


def closest_on_skin(
    point: ArrayLike, points: ArrayLike, triangles: ArrayLike
) -> tuple[float, SkinPoint]:
    """Distance and place of the skin point closest to ``point`` (3,), in the unit of ``points``.

    Raises:
        InputError: no triangles.

    Source: the plane's foot where it lies inside, else the nearest of the three edges.
    """
    tri = np.asarray(triangles)
    if not len(tri):
        raise InputError("triangles must hold the skin, got none; give the model's skin facets.")
    a, b, c = np.moveaxis(np.asarray(points, dtype=float)[tri], 1, 0)
    p = np.asarray(point, dtype=float)
    weights = np.stack([_foot(p, a, b, c), *_edges(p, a, b, c)], axis=1)  # (t, 4, 3)
    places = np.einsum("tkw,wtd->tkd", weights, np.stack([a, b, c]))
    distance = np.linalg.norm(places - p, axis=2)
    distance[:, 0] = np.where((weights[:, 0] >= 0).all(axis=1), distance[:, 0], np.inf)
    row, way = np.unravel_index(int(distance.argmin()), distance.shape)
    w = weights[row, way]
    return float(distance[row, way]), SkinPoint(int(row), (float(w[0]), float(w[1]), float(w[2])))


def _foot(p: Array, a: Array, b: Array, c: Array) -> Array:
    """Barycentric coordinates (t, 3) of the foot of p on each plane; -1 where there is no plane."""
    u, v, w = b - a, c - a, p - a
    uu, uv, vv = (np.einsum("td,td->t", s, t) for s, t in ((u, u), (u, v), (v, v)))
    wu, wv = np.einsum("td,td->t", w, u), np.einsum("td,td->t", w, v)
    area = uu * vv - uv**2
    flat = area <= 1e-14 * uu * vv
    area = np.where(flat, 1.0, area)
    s, t = (vv * wu - uv * wv) / area, (uu * wv - uv * wu) / area
    return np.where(flat[:, None], -1.0, np.stack([1 - s - t, s, t], axis=1))


def _edges(p: Array, a: Array, b: Array, c: Array) -> list[Array]:
    """Barycentric coordinates (t, 3) of the closest point on each of the three edges."""
    found = []
    for first, second, (i, j) in ((a, b, (0, 1)), (b, c, (1, 2)), (c, a, (2, 0))):
        edge = second - first
        length = np.maximum(np.einsum("td,td->t", edge, edge), 1e-300)
        along = np.clip(np.einsum("td,td->t", p - first, edge) / length, 0.0, 1.0)
        weights = np.zeros_like(a)
        weights[:, i], weights[:, j] = 1.0 - along, along
        found.append(weights)
    return found


def breast_side(point: ArrayLike, midline_x: float = 0.0) -> str:
    """Which breast of the patient, "left" or "right": +x is the patient's left of ``midline_x``."""
    return "left" if float(np.asarray(point, dtype=float)[0]) > midline_x else "right"


def estimate_nipple(
    points: ArrayLike, triangles: ArrayLike, side: str, midline_x: float = 0.0
) -> SkinPoint:
    """The most anterior (least y) skin node of one breast of the prone skin.

    Raises:
        InputError: no skin on that side of the midline.
    """
    p, tri = np.asarray(points, dtype=float), np.asarray(triangles)
    corners = p[tri]
    there = corners[..., 0] > midline_x if side == "left" else corners[..., 0] <= midline_x
    if not there.any():
        raise InputError(f"the {side} breast must have skin, got none; check midline_x.")
    row, corner = np.unravel_index(np.where(there, corners[..., 1], np.inf).argmin(), there.shape)
    w = np.eye(3)[corner]
    return SkinPoint(int(row), (float(w[0]), float(w[1]), float(w[2])))


def clock_position(point: ArrayLike, nipple: ArrayLike) -> tuple[str, float]:
    """Clock face and distance from the nipple, for a surgeon who faces the patient.

    12 is towards the head, 3 towards the patient's left (+x): outer in the left breast, inner in
    the right one. To the nearest half hour.

    Args:
        point: (3,) m, LPS.
        nipple: (3,) m, LPS.

    Returns:
        "10:30", or "central" within 5 mm of the nipple; and the distance in mm as seen from the
        front (in the x, z plane).
    """
    dx, _, dz = 1e3 * (np.asarray(point, dtype=float) - np.asarray(nipple, dtype=float))
    distance = float(np.hypot(dx, dz))
    if distance < 5.0:
        return "central", distance
    halves = round(float(np.degrees(np.arctan2(dx, dz))) % 360.0 / 15.0) % 24
    return f"{halves // 2 or 12}:{'30' if halves % 2 else '00'}", distance


@dataclass(frozen=True)
class Tumour:
    """Where the centre of the tumour is; mm, LPS."""

    prone_mm: Point
    supine_mm: Point
    depth_mm: float  #: from the supine skin, shortest way
    clock: str  #: see ``clock_position``
    nipple_distance_mm: float  #: as seen from the front
    breast: str  #: "left" or "right", the patient's
    ellipsoid95_mm: None = None
    ellipsoid95_reason: str = "no covariance of the parameters was computed"

    @classmethod
    def locate(
        cls,
        prone: ArrayLike,
        supine: ArrayLike,
        nipple: ArrayLike,
        skin: tuple[ArrayLike, ArrayLike],
        midline_x: float = 0.0,
    ) -> Tumour:
        """From the centres (3,) m in both poses, the supine nipple (3,) m and the supine skin.

        ``skin`` is (points (n, 3) m, triangles (t, 3)).
        """
        clock, distance = clock_position(supine, nipple)
        depth, _ = closest_on_skin(supine, *skin)
        side = breast_side(nipple, midline_x)
        return cls(_mm(prone), _mm(supine), 1e3 * depth, clock, distance, side)


@dataclass(frozen=True)
class Parameter:
    """A value that the prediction used; ``sd`` when it was identified."""

    value: float
    unit: str
    sd: float | None = None


@dataclass(frozen=True)
class MeshFigures:
    """Size and quality (1 = regular tetrahedron) of the mesh."""

    nodes: int
    cells: int
    min_quality: float
    volume_ml: float


@dataclass(frozen=True)
class Check:
    """Whether a check passed, and the figure that decided it."""

    passed: bool
    figure: float | str


@dataclass(frozen=True)
class Truth:
    """The errors that are known because the patient is synthetic."""

    tumour_error_mm: float
    rigid_error_mm: float


@dataclass(frozen=True)
class Result:
    """All that result.json holds."""

    tumour: Tumour
    parameters: dict[str, Parameter]
    mesh: MeshFigures
    seconds: dict[str, float]  #: by stage; ``total`` included
    checks: dict[str, Check]
    versions: dict[str, str]
    warnings: list[str] = field(default_factory=list)
    skin_mae_mm: float | None = None  #: with a scan
    truth: Truth | None = None  #: of a synthetic patient
    frame: str = "LPS"
    unit: str = "mm"

    def to_dict(self) -> dict[str, Any]:
        """Plain dicts, lists and numbers; ``truth`` only where there is one."""
        plain = asdict(self)
        if self.truth is None:
            del plain["truth"]
        return plain

    def write(self, path: str | Path) -> None:
        """Write JSON aside, then rename: ``path`` is the old file or the whole new one.

        Raises:
            InputError: a figure is NaN or infinite, which JSON cannot hold.
        """
        try:
            text = json.dumps(self.to_dict(), indent=2, allow_nan=False, ensure_ascii=False)
        except ValueError as error:
            raise InputError(
                f"result must hold finite numbers for {path}, got NaN or infinity; "
                "leave an unknown figure out or give None."
            ) from error
        write_aside(path, text + "\n")


def write_aside(path: str | Path, text: str) -> None:
    """Write UTF-8 ``text`` beside ``path`` and rename; an interruption leaves no half file."""
    target = Path(path)
    handle, name = tempfile.mkstemp(prefix=f".{target.name}.", suffix=".part", dir=target.parent)
    try:
        with os.fdopen(handle, "w", encoding="utf-8") as stream:
            stream.write(text)
        os.chmod(name, 0o644)
        os.replace(name, target)
    except BaseException:
        Path(name).unlink(missing_ok=True)
        raise


def _mm(point: ArrayLike) -> Point:
    x, y, z = (1e3 * float(value) for value in np.asarray(point, dtype=float))
    return x, y, z
