"""Surface files in: points and triangles as they stand in the file, with no unit or frame yet."""

from __future__ import annotations

import io
import warnings
from collections.abc import Sequence
from contextlib import redirect_stderr, redirect_stdout, suppress
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from supple.errors import MeshError

Floats = npt.NDArray[np.float64]
Ints = npt.NDArray[np.int64]

#: What triangles are written in, and what a scanner or 3D Slicer may write besides.
PLAIN = (".ply", ".stl", ".obj", ".off")
GLTF = (".gltf", ".glb")
VTK = (".vtk", ".vtp", ".vtu")
EVERY = PLAIN + GLTF + VTK


def load(path: Path, formats: Sequence[str] = PLAIN) -> tuple[Floats, Ints]:
    """Points (n, 3) and triangles (t, 3) of a file; polygons are cut into triangles.

    The nodes of a glTF scene are placed by their transforms. t = 0 is a point cloud.

    Raises:
        MeshError: a suffix that is not in ``formats``, or a file that cannot be read.
    """
    suffix = path.suffix.lower()
    if suffix not in formats:
        raise MeshError(f"{path} must be one of {', '.join(formats)}; save it as PLY.")
    if suffix in VTK:
        from supple.vtk_surface import load_vtk

        return load_vtk(path)
    return _by_trimesh(path, suffix)


def _by_trimesh(path: Path, suffix: str) -> tuple[Floats, Ints]:
    import trimesh

    keep_ids: dict[str, Any] = {"maintain_order": True} if suffix == ".obj" else {}
    said = io.StringIO()
    try:
        with redirect_stdout(said), redirect_stderr(said), warnings.catch_warnings():
            warnings.simplefilter("ignore")
            loaded: Any = trimesh.load(path, process=False, **keep_ids)
            parts = loaded.dump() if isinstance(loaded, trimesh.Scene) else [loaded]
    except Exception as error:  # trimesh raises what its parsers happen to raise
        return _polygons(path, suffix, error)
    points, faces = _joined(parts)
    if suffix != ".stl":
        return points, faces
    points, same = np.unique(points, axis=0, return_inverse=True)  # STL repeats each corner
    return points, same.ravel()[faces]


def _polygons(path: Path, suffix: str, error: Exception) -> tuple[Floats, Ints]:
    """Of a PLY with polygons of several sizes, which trimesh takes for a broken one.

    Raises:
        MeshError: with what trimesh said, of any other file.
    """
    from supple.ply_polygons import load_polygons

    if suffix == ".ply":
        with suppress(ValueError, LookupError):
            return load_polygons(path)
    again = " again" if suffix == ".ply" else ""
    raise MeshError(
        f"{path} is no surface that can be read ({error}); save it as PLY{again}."
    ) from None


def _joined(parts: Sequence[Any]) -> tuple[Floats, Ints]:
    """Points and triangles of trimesh objects, of which some may be clouds; lines are left out."""
    points, triangles = [np.empty((0, 3))], [np.empty((0, 3), dtype=np.int64)]
    count = 0
    for part in parts:
        if hasattr(part, "entities"):
            continue
        own = np.asarray(part.vertices, dtype=np.float64).reshape(-1, 3)
        faces = np.asarray(getattr(part, "faces", ()), dtype=np.int64).reshape(-1, 3)
        if len(parts) > 1 and len(faces):  # each object of an OBJ holds the points of all
            used, faces = np.unique(faces, return_inverse=True)
            own, faces = own[used], faces.reshape(-1, 3)
        triangles.append(faces + count)
        points.append(own)
        count += len(own)
    return np.vstack(points), np.vstack(triangles)
