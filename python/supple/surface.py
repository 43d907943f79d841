"""A triangulated surface or a cloud of points: scans, the chest wall, skin."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from supple.errors import InputError, MeshError
from supple.files import existing, metres, replacing
from supple.mesh_checks import checked_ids, checked_points, some
from supple.surface_files import load

Floats = npt.NDArray[np.float64]
Ints = npt.NDArray[np.int64]

#: Extents, in the file's numbers, that betray metres read as mm, and mm read as metres.
_LIKE_METRES = (0.02, 3.0)
_LIKE_MILLIMETRES = (20.0, 3000.0)


@dataclass(frozen=True, eq=False, repr=False)
class Surface:
    """A checked surface; its arrays are read-only.

    Attributes:
        points: (n, 3) m.
        triangles: (t, 3) point ids, counter-clockwise seen from outside; t = 0 is a point cloud.

    Raises:
        MeshError: wrong shapes or ids, NaN, no points, triangles without area.
    """

    points: Floats
    triangles: Ints = field(default_factory=lambda: np.empty((0, 3), dtype=np.int64))

    def __post_init__(self) -> None:
        points = checked_points(self.points)
        triangles = checked_ids(self.triangles, 3, len(points), "triangles")
        none = np.flatnonzero(flat(points, triangles))
        if len(none):
            raise MeshError(f"triangles {some(none)} have no area; remove them.")
        for name, array in (("points", points), ("triangles", triangles)):
            array.flags.writeable = False
            object.__setattr__(self, name, array)

    @classmethod
    def read(cls, path: str | Path, unit: str = "mm", points_only: bool = False) -> Surface:
        """Read a PLY, STL, OBJ or OFF file.

        Args:
            path: the file; polygons become triangles, triangles without area are left out.
            unit: the file's unit of length: "m", "mm", "cm", "dm", "um" or "in".
            points_only: take the points alone, so that a file without triangles is a point cloud.

        Raises:
            InputError: missing file, a unit that the extent contradicts (a scan of 0.6 "mm").
            MeshError: unreadable file, no points, NaN, no triangles.
        """
        file = Path(path)
        scale = metres(unit)
        raw_points, raw_triangles = load(existing(file))
        if not len(raw_points):
            raise MeshError(f"{file} holds no points; export the surface again.")
        points = checked_points(raw_points)
        triangles = checked_ids(raw_triangles, 3, len(points), "triangles")
        triangles = triangles[~flat(points, triangles)]
        if points_only:
            triangles = triangles[:0]
        elif not len(triangles):
            raise MeshError(
                f"{file} holds {len(points)} points and no triangles; "
                "mesh it, or pass points_only=True to use it as a point cloud."
            )
        check_unit(float(np.ptp(points, axis=0).max()), unit, file)
        return cls(points * scale, triangles)

    def write(
        self, path: str | Path, unit: str = "mm", frame: str = "LPS",
        values: Mapping[str, npt.ArrayLike] | None = None,
    ) -> Path:  # fmt: skip
        """Write a binary PLY file, whole or not at all; its header names ``unit`` and ``frame``.

        Args:
            values: name → (n,) a number of each point, written as they are: a scalar property.
        """
        file = Path(path)
        if file.suffix.lower() != ".ply":
            raise InputError(f"path must end in .ply, got {file.name!r}.")
        own = {name: np.asarray(one, dtype=np.float64) for name, one in (values or {}).items()}
        for name, one in own.items():
            if one.shape != (len(self.points),) or not name.isidentifier():
                raise InputError(f"values must be ({len(self.points)},) under a plain name, got "
                                 f"{one.shape} under {name!r}.")  # fmt: skip
        header, body = _ply(self, metres(unit), (f"unit {unit}", f"frame {frame}"), own)
        with replacing(file) as aside:
            aside.write_bytes(header + body)
        return file

    @property
    def size(self) -> float:
        """Largest extent along an axis, m."""
        return max(float(np.ptp(self.points[:, axis])) for axis in range(3))

    @property
    def areas(self) -> Floats:
        """Area (t,) of each triangle, m²."""
        return np.asarray(np.linalg.norm(area_vectors(self.points, self.triangles), axis=1) / 2)

    @property
    def normals(self) -> Floats:
        """Unit outward normal (t, 3) of each triangle."""
        cross = area_vectors(self.points, self.triangles)
        return np.asarray(cross / np.linalg.norm(cross, axis=1, keepdims=True))

    def closest(self, points: npt.ArrayLike) -> Any:
        """Where ``points`` (k, 3) m land on the surface.

        Returns:
            ``point`` (k, 3) m, ``triangle`` (k,), ``distance`` (k,) m, ``feature`` (k,) 0 in a
            face, 1 on an edge, 2 at a vertex, ``normal`` (k, 3), ``barycentric`` (k, 3).

        Raises:
            MeshError: the surface has no triangles.
        """
        from supple.core import core

        if len(self.triangles) == 0:
            raise MeshError("the surface has no triangles to land on; give one that has.")
        tree = core().SurfaceTree(self.points, self.triangles.astype(np.int32))
        return tree.closest(np.ascontiguousarray(points, dtype=np.float64))

    def __repr__(self) -> str:
        return f"Surface({len(self.points)} points, {len(self.triangles)} triangles)"


def check_unit(extent: float, unit: str, source: object) -> None:
    """Refuse a body scan whose largest ``extent`` (in ``unit``) fits another unit a thousand times.

    Raises:
        InputError: 0.02 to 3 "mm" (so metres), or 20 to 3000 "m" (so mm).
    """
    spans = {"mm": (_LIKE_METRES, "m"), "m": (_LIKE_MILLIMETRES, "mm")}
    if unit not in spans:
        return
    (low, high), other = spans[unit]
    if low <= extent <= high:
        raise InputError(
            f"{source} spans {extent:.4g} {unit}, which is no body: it is in {other}; "
            f"pass unit='{other}', or --scan-unit {other} on the command line."
        )


def area_vectors(points: Floats, triangles: Ints) -> Floats:
    """Twice the area times the normal (t, 3) of each triangle."""
    return np.asarray(_crossed(*_two_edges(points, triangles)).T)


def _two_edges(points: Floats, triangles: Ints) -> tuple[Floats, Floats]:
    """From the first corner of each triangle to its second and third, (3, t) each.

    A coordinate is in one row: several times faster than ``np.cross`` of millions of triangles.
    """
    x = np.ascontiguousarray(points.T)
    first, second, third = (np.ascontiguousarray(triangles[:, i]) for i in range(3))
    a = np.take(x, first, axis=1)
    return np.take(x, second, axis=1) - a, np.take(x, third, axis=1) - a


def _crossed(u: Floats, v: Floats) -> Floats:
    """Cross products of the columns of ``u`` and ``v`` (3, t)."""
    result = np.empty_like(u)
    for i in range(3):
        j, k = (i + 1) % 3, (i + 2) % 3
        np.multiply(u[j], v[k], out=result[i])
        result[i] -= u[k] * v[j]
    return result


def flat(points: Floats, triangles: Ints) -> npt.NDArray[np.bool_]:
    """Which triangles (t,) have no area beyond the rounding of their edges."""
    u, v = _two_edges(points, triangles)
    longest = np.maximum(_squared(u), _squared(v))
    return np.asarray(np.sqrt(_squared(_crossed(u, v))) <= 1e-12 * longest)


def _squared(u: Floats) -> Floats:
    return np.asarray(np.einsum("dt,dt->t", u, u))


def _ply(
    surface: Surface, scale: float, comments: tuple[str, ...], values: Mapping[str, Floats]
) -> tuple[bytes, bytes]:
    """Header and body of a little-endian PLY file in units of ``scale`` metres."""
    lines = [
        "ply",
        "format binary_little_endian 1.0",
        *(f"comment {comment}" for comment in comments),
        f"element vertex {len(surface.points)}",
        *(f"property double {name}" for name in (*"xyz", *values)),
    ]
    faces = np.zeros(len(surface.triangles), dtype=[("n", "u1"), ("ids", "<i4", 3)])
    faces["n"], faces["ids"] = 3, surface.triangles
    if len(faces):
        lines += [f"element face {len(faces)}", "property list uchar int vertex_indices"]
    header = "\n".join([*lines, "end_header", ""]).encode("ascii")
    points = np.column_stack([surface.points / scale, *values.values()])
    return header, points.astype("<f8").tobytes() + faces.tobytes()
