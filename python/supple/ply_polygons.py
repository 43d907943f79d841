"""Binary PLY whose faces have different numbers of corners: triangles beside quads and polygons.

Source: G. Turk, The PLY polygon file format (1994).
"""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Literal

import numpy as np
import numpy.typing as npt

from supple.vtk_surface import fan

Floats = npt.NDArray[np.float64]
Ints = npt.NDArray[np.int64]

_TYPES = {
    "char": "i1", "int8": "i1", "uchar": "u1", "uint8": "u1", "short": "i2", "int16": "i2",
    "ushort": "u2", "uint16": "u2", "int": "i4", "int32": "i4", "uint": "u4", "uint32": "u4",
    "float": "f4", "float32": "f4", "double": "f8", "float64": "f8",
}  # fmt: skip
_ORDERS = {"binary_little_endian": "<", "binary_big_endian": ">"}
_CORNERS = ("vertex_indices", "vertex_index")


@dataclass
class _Element:
    """Of the header: how many rows, and what stands in each."""

    name: str
    count: int
    #: name → (type of a list's length or "", type of the value)
    properties: dict[str, tuple[str, str]] = field(default_factory=dict)


def load_polygons(path: Path) -> tuple[Floats, Ints]:
    """Points (n, 3) and triangles (t, 3); each polygon is cut into a fan.

    Raises:
        ValueError: a file that is no binary PLY, or that ends before its header says.
        KeyError: without points, or of a type that PLY does not have.
    """
    data = path.read_bytes()
    head, end, _ = data.partition(b"end_header\n")
    if not end:
        head, end, _ = data.partition(b"end_header\r\n")
    elements = _header(head.decode("latin-1").splitlines())
    at = len(head) + len(end)
    points, triangles = np.empty((0, 3)), np.empty((0, 3), dtype=np.int64)
    for element in elements:
        if any(length for length, _ in element.properties.values()):
            offsets, ids, at = _lists(data, at, element)
            if element.name == "face":
                triangles = fan(offsets, ids)
            continue
        rows = np.dtype([(name, value) for name, (_, value) in element.properties.items()])
        read = np.frombuffer(data, rows, element.count, at)
        at += read.nbytes
        if element.name == "vertex":
            points = np.stack([read[axis].astype(np.float64) for axis in "xyz"], axis=1)
    return points, triangles


def _header(lines: list[str]) -> list[_Element]:
    form = next((line.split()[1] for line in lines if line.startswith("format ")), "")
    if form not in _ORDERS:
        raise ValueError(f"a binary PLY was expected, got the format {form!r}")
    elements: list[_Element] = []
    for word, *rest in (line.split() for line in lines if line.strip()):
        if word == "element":
            elements.append(_Element(rest[0], int(rest[1])))
        elif word == "property":
            types = [_ORDERS[form] + _TYPES[kind] for kind in rest[:-1] if kind != "list"]
            elements[-1].properties[rest[-1]] = (types[0] if len(types) > 1 else "", types[-1])
    return elements


def _lists(data: bytes, at: int, element: _Element) -> tuple[Ints, Ints, int]:
    """Where each row's corners begin in ``ids``, (rows + 1,), the ids, and where the rows end."""
    form = [(name in _CORNERS, np.dtype(length or "V0").itemsize, np.dtype(value))
            for name, (length, value) in element.properties.items()]  # fmt: skip
    order: Literal["big", "little"] = (
        "big" if any(value[0] == ">" for _, value in element.properties.values()) else "little"
    )
    counts: list[int] = []
    found: list[bytes] = []
    corner: np.dtype[Any] = np.dtype("i4")
    for _ in range(element.count):
        for corners, length, value in form:
            many = 1
            if length:
                many = int.from_bytes(data[at : at + length], order)
                at += length
            size = many * value.itemsize
            if corners:
                corner = value
                counts.append(many)
                found.append(data[at : at + size])
            at += size
    if at > len(data):
        raise ValueError("the file ends before the last of its faces")
    ids = np.frombuffer(b"".join(found), corner).astype(np.int64)
    return np.concatenate([[0], np.cumsum(counts, dtype=np.int64)]), ids, at
