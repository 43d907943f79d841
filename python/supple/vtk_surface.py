"""Surfaces of VTK's files: legacy ``.vtk`` and XML ``.vtp`` polygons, and grids through meshio.

Source: VTK file formats, https://docs.vtk.org/en/latest/design_documents/VTKFileFormats.html.
"""

from __future__ import annotations

import re
from itertools import pairwise
from pathlib import Path

import numpy as np
import numpy.typing as npt

from supple.errors import InputError, MeshError

Floats = npt.NDArray[np.float64]
Ints = npt.NDArray[np.int64]

#: Data types of legacy files; binary ones are big-endian.
_TYPES = {
    "float": ">f4", "double": ">f8", "int": ">i4", "long": ">i8", "short": ">i2", "char": ">i1",
    "unsigned_char": ">u1", "unsigned_int": ">u4", "vtktypeint64": ">i8", "vtkidtype": ">i4",
}  # fmt: skip
_CELLS = ("VERTICES", "LINES", "POLYGONS", "TRIANGLE_STRIPS")


def load_vtk(path: Path) -> tuple[Floats, Ints]:
    """Points (n, 3) and triangles (t, 3); polygons and strips are cut, volumes are refused.

    Raises:
        MeshError: a file that cannot be read, or that holds volume cells alone.
    """
    try:
        if path.suffix.lower() == ".vtp":
            from supple.vtk_xml import load_vtp

            return load_vtp(path)
        data = path.read_bytes()
        if path.suffix.lower() == ".vtk" and re.search(rb"DATASET\s+POLYDATA", data[:2048], re.I):
            return _Legacy(data).read()
    except (ValueError, IndexError, KeyError, InputError) as error:
        raise MeshError(
            f"{path} is no VTK surface that can be read ({error}); save it as PLY."
        ) from None
    return _of_grid(path)


def fan(offsets: Ints, ids: Ints) -> Ints:
    """Triangles (t, 3) of polygons: the corners of polygon k are ids[offsets[k]:offsets[k + 1]]."""
    counts = np.diff(offsets)
    cut = np.maximum(counts - 2, 0)
    first = np.repeat(offsets[:-1], cut)
    step = np.arange(cut.sum()) - np.repeat(np.cumsum(cut) - cut, cut)
    return np.stack([ids[first], ids[first + step + 1], ids[first + step + 2]], axis=1)


def strips(offsets: Ints, ids: Ints) -> Ints:
    """Triangles (t, 3) of triangle strips, whose every second one is turned."""
    parts = [np.empty((0, 3), dtype=np.int64)]
    for a, b in pairwise(offsets):
        strip = np.stack([ids[a : b - 2], ids[a + 1 : b - 1], ids[a + 2 : b]], axis=1)
        strip[1::2] = strip[1::2, [1, 0, 2]]
        parts.append(strip)
    return np.vstack(parts)


def _of_grid(path: Path) -> tuple[Floats, Ints]:
    from supple.mesh_io import read_raw

    raw = read_raw(path)
    parts = [np.empty((0, 3), dtype=np.int64)]
    for block in raw.cells:
        if block.type in ("triangle", "quad", "polygon"):
            ids = np.asarray(block.data, dtype=np.int64)
            parts.append(fan(np.arange(len(ids) + 1) * ids.shape[1], ids.ravel()))
    triangles = np.vstack(parts)
    kinds = sorted({block.type for block in raw.cells if len(block.data)} - {"vertex"})
    if kinds and not len(triangles):
        raise MeshError(f"{path} holds {', '.join(kinds)} and no triangles; extract its surface.")
    return np.asarray(raw.points, dtype=np.float64), triangles


class _Legacy:
    """A cursor over a legacy file."""

    def __init__(self, data: bytes) -> None:
        lines = data.split(b"\n", 3)
        self.binary = lines[2].strip().upper() == b"BINARY"
        self.version5 = float(re.findall(rb"[\d.]+", lines[0])[-1]) >= 5
        self.data, self.at = data, len(data) - len(lines[3])

    def read(self) -> tuple[Floats, Ints]:
        points: Floats = np.empty((0, 3))
        parts = [np.empty((0, 3), dtype=np.int64)]
        while (words := self._line()) is not None:
            name = words[0].upper() if words else ""
            if name == "POINTS":
                points = (
                    self._numbers(3 * int(words[1]), words[2]).reshape(-1, 3).astype(np.float64)
                )
            elif name in _CELLS:
                offsets, ids = self._cells(int(words[1]), int(words[2]))
                if name == "POLYGONS":
                    parts.append(fan(offsets, ids))
                elif name == "TRIANGLE_STRIPS":
                    parts.append(strips(offsets, ids))
            elif name in ("POINT_DATA", "CELL_DATA"):
                break
        return points, np.vstack(parts)

    def _line(self) -> list[str] | None:
        """The words of the next line; None at the end."""
        if self.at >= len(self.data):
            return None
        end = self.data.find(b"\n", self.at)
        end = len(self.data) if end < 0 else end
        words = self.data[self.at : end].decode("latin-1").split()
        self.at = end + 1
        return words

    def _numbers(self, count: int, kind: str) -> npt.NDArray[np.generic]:
        dtype = np.dtype(_TYPES[kind.lower()])
        if self.binary:
            end = self.at + count * dtype.itemsize
            values = np.frombuffer(self.data[self.at : end], dtype)
            self.at = end
        else:
            values = np.array(self._words(count), dtype=np.float64)
        if len(values) != count:
            raise ValueError(f"it ends after {len(values)} of {count} numbers")
        return values

    def _words(self, count: int) -> list[bytes]:
        """The next ``count`` words of an ASCII file, over as many lines as they take."""
        words: list[bytes] = []
        while len(words) < count and self.at < len(self.data):
            end = self.data.find(b"\n", self.at)
            end = len(self.data) if end < 0 else end
            words += self.data[self.at : end].split()
            self.at = end + 1
        return words

    def _cells(self, first: int, second: int) -> tuple[Ints, Ints]:
        """Offsets (k + 1,) and ids; older files put the count before the corners of each cell."""
        if self.version5:
            offsets = self._numbers(first, str(self._named("OFFSETS"))).astype(np.int64)
            return offsets, self._numbers(second, self._named("CONNECTIVITY")).astype(np.int64)
        flat = self._numbers(second, "int").astype(np.int64)
        starts, at = [], 0
        for _ in range(first):
            starts.append(at)
            at += int(flat[at]) + 1
        counts = np.array(starts, dtype=np.int64)
        keep = np.ones(len(flat), dtype=bool)
        keep[counts] = False
        return np.append(counts, at) - np.arange(first + 1), flat[keep]

    def _named(self, name: str) -> str:
        words = self._line() or []
        while not words:
            words = self._line() or ["?"]
        if words[0].upper() != name:
            raise ValueError(f"{name} expected, got {words[0]}")
        return words[1]
