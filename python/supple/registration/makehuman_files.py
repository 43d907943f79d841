"""Files of MakeHuman's hm08 body: mesh, targets, rig and weights; metres and LPS from here on."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from supple.errors import InputError, MeshError
from supple.files import existing

Floats = npt.NDArray[np.float64]
Ints = npt.NDArray[np.int64]


@dataclass(frozen=True, eq=False, repr=False)
class BaseMesh:
    """The body that all of MakeHuman's targets and weights count in.

    Attributes:
        folder: laid out as MakeHuman's data: 3dobjs/, targets/, rigs/.
        points: (n, 3) m LPS, helpers and joint cubes among them.
        quads: (q, 4) of the body alone, counter-clockwise seen from outside.
        mirror: (n,) the vertex opposite in x = 0.
    """

    folder: Path
    points: Floats
    quads: Ints
    mirror: Ints

    def target(self, name: str) -> Floats:
        """Displacements (n, 3) m of ``targets/<name>.target``; zero where it is silent."""
        file = existing(self.folder / "targets" / f"{name}.target")
        rows = _rows(file, 4)
        moved = np.zeros_like(self.points)
        moved[self._checked(rows[:, 0], file)] = _lps(rows[:, 1:])
        return moved

    def weights(self) -> dict[str, Floats]:
        """Of each bone of the default rig, its weights (n,)."""
        file = self.folder / "rigs" / "default_weights.mhw"
        result = {}
        for bone, pairs in _json(file, "weights").items():
            result[bone] = np.zeros(len(self.points))
            ids, values = np.array(pairs, dtype=np.float64).reshape(-1, 2).T
            result[bone][self._checked(ids, file)] = values
        return result

    def joints(self) -> dict[str, Ints]:
        """Of each head of a bone of the default rig, the vertices whose mean it is."""
        file = self.folder / "rigs" / "default.mhskel"
        return {
            name.removesuffix("____head"): self._checked(np.array(ids), file)
            for name, ids in _json(file, "joints").items() if name.endswith("____head")
        }  # fmt: skip

    def _checked(self, ids: npt.NDArray[np.generic], file: Path) -> Ints:
        """Vertex ids as integers; MeshError where the mesh has no such vertex."""
        result = ids.astype(np.int64)
        if len(result) and not 0 <= result.min() <= result.max() < len(self.points):
            raise MeshError(f"{file} must name vertices 0 to {len(self.points) - 1} of base.obj, "
                            f"got {result.max()}; take both from one release.")  # fmt: skip
        return result


def read_base(folder: Path, mpfb: Path | None) -> BaseMesh:
    """The mesh of a MakeHuman folder; which vertex mirrors which from MPFB's table, or found.

    Raises:
        InputError: a file is missing or no such file as MakeHuman writes.
        MeshError: faces that are no quads, or a mesh that is not symmetric.
    """
    file = existing(folder / "3dobjs" / "base.obj")
    points, quads = _obj(file)
    if mpfb is None:
        mirror = _mirror(points, file)
    else:
        mirror = _mirror_table(mpfb / "mesh_metadata" / "hm08.mirror", len(points))
    body = np.unique(quads)
    if abs(points[mirror[body]] * (-1, 1, 1) - points[body]).max() > 1e-9:
        raise MeshError(f"{file} must be symmetric in x, as hm08 is; take the base mesh unchanged.")
    return BaseMesh(folder, points, quads, mirror)


def _lps(points: Floats) -> Floats:
    """From decimetres, y up and z to the front, to LPS metres."""
    return np.asarray(0.1 * points[:, [0, 2, 1]] * (1, -1, 1))


def _obj(file: Path) -> tuple[Floats, Ints]:
    points, quads, group = [], [], ""
    for line in _text(file).splitlines():
        word, *rest = line.split() or [""]
        if word == "v":
            points.append(rest[:3])
        elif word == "g":
            group = " ".join(rest)
        elif word == "f" and group == "body":
            quads.append([corner.split("/")[0] for corner in rest])
    try:
        faces = np.array(quads, dtype=np.int64).reshape(len(quads), 4) - 1
        places = _lps(np.array(points, dtype=np.float64).reshape(-1, 3))
        if not 0 <= faces.min() <= faces.max() < len(places):
            raise ValueError
        return places, faces
    except ValueError:
        raise MeshError(f"{file} must have a group 'body' of quads; take hm08 unchanged.") from None


def _mirror(points: Floats, file: Path) -> Ints:
    """The vertex nearest to each one's mirror image; of two at one place, each other."""
    from scipy.spatial import cKDTree

    distance, nearest = cKDTree(points).query(points * (-1, 1, 1))
    ids = np.arange(len(points))
    if (np.count_nonzero(nearest[nearest] != ids) > 0.01 * len(ids)) or np.median(distance) > 1e-6:
        raise MeshError(f"{file} must be symmetric in x, as hm08 is; take the base mesh unchanged.")
    return np.where(nearest[nearest] == ids, nearest, ids)


def _mirror_table(file: Path, n: int) -> Ints:
    pairs = [line.split()[:2] for line in _text(existing(file)).splitlines() if line]
    mirror = np.arange(n)
    try:
        ids = np.array(pairs, dtype=np.int64).reshape(-1, 2)
        mirror[ids[:, 0]] = ids[:, 1]
        mirror[mirror]
    except (ValueError, IndexError):
        raise InputError(f"{file} must hold two of {n} vertices a line; take hm08's.") from None
    return mirror


def _rows(file: Path, columns: int) -> Floats:
    words = [w for line in _text(file).splitlines() if line[:1] != "#" for w in line.split()]
    try:
        return np.fromiter(map(float, words), np.float64, len(words)).reshape(-1, columns)
    except ValueError:
        raise InputError(f"{file} must hold {columns} numbers a line; get it again.") from None


def _json(file: Path, key: str) -> dict[str, Any]:
    try:
        table = json.loads(_text(existing(file)))[key]
    except (json.JSONDecodeError, KeyError, TypeError):
        raise InputError(f"{file} must be JSON with {key!r} in it; get it again.") from None
    return dict(table)


def _text(file: Path) -> str:
    try:
        return file.read_text(encoding="utf-8")
    except UnicodeDecodeError:
        raise InputError(f"{file} must be text, got bytes that are none; get it again.") from None
