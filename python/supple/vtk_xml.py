"""VTK's XML polygons (.vtp): ASCII, base64 or raw arrays, plain or compressed."""

from __future__ import annotations

import base64
import lzma
import re
import zlib
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from supple.files import parsed_xml

if TYPE_CHECKING:
    from xml.etree.ElementTree import Element

Floats = npt.NDArray[np.float64]
Ints = npt.NDArray[np.int64]

_TYPES = {
    "Float32": "f4", "Float64": "f8", "Int8": "i1", "Int16": "i2", "Int32": "i4", "Int64": "i8",
    "UInt8": "u1", "UInt16": "u2", "UInt32": "u4", "UInt64": "u8",
}  # fmt: skip
_UNPACK: dict[str, Callable[[bytes], bytes]] = {
    "vtkZLibDataCompressor": zlib.decompress,
    "vtkLZMADataCompressor": lzma.decompress,
}


def load_vtp(path: Path) -> tuple[Floats, Ints]:
    """Points (n, 3) and triangles (t, 3) of every piece.

    Raises:
        ValueError, KeyError, InputError: a file that is no such XML.
    """
    from supple.vtk_surface import fan, strips

    file = _File(path.read_bytes(), path)
    points, triangles, count = [np.empty((0, 3))], [np.empty((0, 3), dtype=np.int64)], 0
    for piece in file.root.iter("Piece"):
        own = file.array(piece.find("Points/DataArray")).reshape(-1, 3)
        for place, cut in (("Polys", fan), ("Strips", strips)):
            named = {a.get("Name"): file.array(a) for a in piece.findall(f"{place}/DataArray")}
            if len(named.get("offsets", ())):
                ends = named["offsets"].astype(np.int64)
                ids = named["connectivity"].astype(np.int64)
                triangles.append(cut(np.insert(ends, 0, 0), ids) + count)
        points.append(own.astype(np.float64))
        count += len(own)
    return np.vstack(points), np.vstack(triangles)


class _File:
    """The tree of a file, and its appended data."""

    def __init__(self, data: bytes, path: Path) -> None:
        self.appended, self.raw = b"", False
        found = re.search(rb"<AppendedData[^>]*>\s*_", data)
        if found:
            end = data.rindex(b"</AppendedData>")
            self.appended = data[found.end() : end]
            self.raw = b'"raw"' in found.group() or b"'raw'" in found.group()
            data = data[: found.end() - 1] + data[end:]
        self.root = parsed_xml(data, path)
        if self.root.get("type") != "PolyData":
            raise ValueError(f"type {self.root.get('type')!r} instead of 'PolyData'")
        self.order = "<" if self.root.get("byte_order", "LittleEndian") == "LittleEndian" else ">"
        self.header = np.dtype(self.order + _TYPES[self.root.get("header_type", "UInt32")])
        self.compressor = self.root.get("compressor")

    def array(self, entry: Element | None) -> npt.NDArray[np.generic]:
        """The numbers of a DataArray; none where there is no such entry."""
        if entry is None:
            return np.empty(0)
        kind = np.dtype(self.order + _TYPES[entry.get("type", "")])
        form, text = entry.get("format", "ascii"), entry.text or ""
        if form == "ascii":
            return np.array(text.split(), dtype=np.float64)
        if form == "appended":
            data, raw = self.appended[int(entry.get("offset", 0)) :], self.raw
        else:
            data, raw = text.strip().encode(), False
        return np.frombuffer(self._unpacked(data, raw), kind)

    def _unpacked(self, data: bytes, raw: bool) -> bytes:
        size = self.header.itemsize
        if self.compressor is None:
            count = self._numbers(data, raw, 1)[0]
            return _bytes(data, raw, size + count)[size:]
        blocks = self._numbers(data, raw, 1)[0]
        head = self._numbers(data, raw, 3 + blocks)
        start = size * (3 + blocks)
        body = data[start if raw else _encoded(start) :]  # the header is encoded by itself
        packed, parts, at = _bytes(body, raw, sum(head[3:])), [], 0
        for length in head[3:]:
            parts.append(_UNPACK[self.compressor](packed[at : at + length]))
            at += length
        return b"".join(parts)

    def _numbers(self, data: bytes, raw: bool, count: int) -> list[int]:
        part = _bytes(data, raw, count * self.header.itemsize)
        return [int(v) for v in np.frombuffer(part, self.header)]


def _encoded(count: int) -> int:
    """Characters of base64 that ``count`` bytes take, padding included."""
    return 4 * ((count + 2) // 3)


def _bytes(data: bytes, raw: bool, count: int) -> bytes:
    part = data[:count] if raw else base64.b64decode(data[: _encoded(count)])[:count]
    if len(part) != count:
        raise ValueError(f"it ends after {len(part)} of {count} bytes")
    return part
