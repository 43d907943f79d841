"""The part of a skin by which a scan is aligned: a box, what was painted, or around the sternum.

Each gives the mask that `align(..., region=)` takes.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike, NDArray

from supple.errors import InputError
from supple.files import existing, metres
from supple.registration.still_skin import Body, Mask, still_skin
from supple.surface import Surface

Array = NDArray[np.float64]


def box_region(points: ArrayLike, low: ArrayLike, high: ArrayLike) -> Mask:
    """(v,) mask of the ``points`` (v, 3) m in the box from ``low`` to ``high``, (3,) m each.

    Raises:
        InputError: a box without extent, or without points.
    """
    at, a, b = (np.asarray(one, dtype=np.float64) for one in (points, low, high))
    if a.shape != (3,) or b.shape != (3,) or not (a < b).all():
        raise InputError(f"low must be three numbers below those of high, got {a} and {b}.")
    return _some(np.asarray(((at >= a) & (at <= b)).all(axis=1)), "the box", at)


def brush_region(
    points: ArrayLike, path: str | Path, radius: float = 8e-3, unit: str = "mm"
) -> Mask:
    """(v,) mask of the ``points`` (v, 3) m that a brush painted.

    Args:
        path: the brush's strokes: a CSV file with columns x, y, z and, where it differs from
            ``radius``, radius; or the painted part itself as PLY, STL, OBJ or OFF.
        radius: m.
        unit: of the file's lengths.

    Raises:
        InputError: no such file, columns that are missing or hold no numbers, nothing painted.
    """
    from scipy.spatial import cKDTree

    file, at = existing(Path(path)), np.asarray(points, dtype=np.float64)
    if file.suffix.lower() == ".csv":
        strokes, reach = _strokes(file, metres(unit), radius)
    else:
        strokes = Surface.read(file, unit, points_only=True).points
        reach = np.full(len(strokes), radius)
    mask = np.zeros(len(at), dtype=bool)
    for near in cKDTree(at).query_ball_point(strokes, reach):
        mask[near] = True
    return _some(mask, f"the brush of {file.name}", at)


def sternum_region(points: ArrayLike, triangles: ArrayLike) -> Mask:
    """(v,) mask of the skin between the breasts and above them, which does not move.

    What `align` takes without ``region``. Args: (v, 3) m, LPS; (t, 3).
    """
    at = np.asarray(points, dtype=np.float64)
    return _some(still_skin(Body.build(at, triangles))[0], "the sternum's region", at)


def _some(mask: Mask, what: str, points: Array) -> Mask:
    if not mask.any():
        low, high = points.min(axis=0), points.max(axis=0)
        raise InputError(
            f"{what} must hold points of the skin, which spans {np.round(low, 3).tolist()} to "
            f"{np.round(high, 3).tolist()} m, got none; check its place and unit."
        )
    return np.asarray(mask, dtype=np.bool_)


def _strokes(file: Path, scale: float, radius: float) -> tuple[Array, Array]:
    """Middles (k, 3) m and radii (k,) m of a CSV file's rows."""
    import csv

    with file.open(encoding="utf-8-sig", newline="") as lines:
        rows = list(csv.DictReader(lines, skipinitialspace=True))
    if not rows or not {"x", "y", "z"} <= rows[0].keys():
        raise InputError(f"{file} must be rows under the columns x, y, z (and radius).")
    try:
        middles = [[float(row[axis]) for axis in "xyz"] for row in rows]
        radii = [float(row["radius"]) if row.get("radius") else radius / scale for row in rows]
    except (TypeError, ValueError) as error:
        raise InputError(f"{file} must hold numbers under x, y, z, radius: {error}.") from None
    if not (np.isfinite(middles).all() and np.isfinite(radii).all() and min(radii) > 0):
        raise InputError(f"{file} must hold finite numbers, and radii above 0.")
    return scale * np.array(middles), scale * np.array(radii)
