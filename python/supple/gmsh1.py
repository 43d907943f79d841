"""Reader of Gmsh's first mesh format ($NOD … $ELM …), which meshio does not know.

Strict: anything but the two sections is an error, because such files are often edited by hand.
Source: Gmsh reference manual, "MSH file format version 1 (Legacy)".
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import numpy.typing as npt

from supple.errors import MeshError

#: Gmsh's number -> meshio's type, for cells that both number alike.
_TYPES = {
    1: "line", 2: "triangle", 3: "quad", 4: "tetra", 5: "hexahedron", 6: "wedge", 15: "vertex"
}  # fmt: skip
_NODES = {
    "line": 2, "triangle": 3, "quad": 4, "tetra": 4, "hexahedron": 8, "wedge": 6, "vertex": 1
}  # fmt: skip

Floats = npt.NDArray[np.float64]
Ints = npt.NDArray[np.int64]
Block = tuple[str, Ints, Ints]


def is_gmsh1(path: Path) -> bool:
    """Whether the file opens with the section of nodes of format 1."""
    with path.open("rb") as file:
        return file.readline().strip() == b"$NOD"


def read(path: Path) -> tuple[Floats, list[Block]]:
    """Points (n, 3) in the file's unit, and blocks (meshio type, cells, physical group of each).

    Raises:
        MeshError: a section that is missing, cut short, unknown or followed by anything else.
    """
    lines = path.read_text(encoding="utf-8", errors="replace").splitlines()
    sections, end = [], 0
    for name in ("NOD", "ELM"):
        rows, end = _section(path, lines, end, name)
        sections.append(rows)
    rest = [n for n, line in enumerate(lines[end:], end + 1) if line.strip()]
    if rest:
        raise MeshError(
            f"{path} goes on after $ENDELM, at line {rest[0]} "
            f"({lines[rest[0] - 1].strip()[:40]!r}), which Gmsh 1 does not allow; "
            "delete all that follows $ENDELM."
        )
    numbers, points = _nodes(path, sections[0])
    return points, _blocks(path, sections[1], numbers)


def _section(path: Path, lines: list[str], start: int, name: str) -> tuple[list[str], int]:
    """The rows of one section, checked against its count, and the line after it."""
    try:
        count = int(lines[start + 1]) if lines[start].strip() == f"${name}" else -1
        closed = lines[start + 2 + count].strip() in (f"$END{name}", f"$E{name}")
    except (IndexError, ValueError):
        count, closed = -1, False
    if count < 0 or not closed:
        raise MeshError(
            f"{path} has no complete ${name} section from line {start + 1} on (a count, as many "
            f"lines, $END{name}); export the mesh again."
        )
    return lines[start + 2 : start + 2 + count], start + 3 + count


def _nodes(path: Path, rows: list[str]) -> tuple[Ints, Floats]:
    """Node numbers (n,) and coordinates (n, 3)."""
    try:
        table = np.array([row.split() for row in rows], dtype=np.float64).reshape(-1, 4)
    except ValueError:
        raise MeshError(f"{path}: each line of $NOD must be a number and x y z.") from None
    return table[:, 0].astype(np.int64), table[:, 1:]


def _blocks(path: Path, rows: list[str], numbers: Ints) -> list[Block]:
    """Cells by type, their nodes as rows of the points."""
    row_of = {int(number): i for i, number in enumerate(numbers)}
    found: dict[str, tuple[list[list[int]], list[int]]] = {}
    for row in rows:
        try:
            _, kind, physical, _, count, *nodes = map(int, row.split())
            name = _TYPES[kind]
            cell = [row_of[node] for node in nodes]
        except (ValueError, KeyError):
            raise MeshError(_bad(path, row)) from None
        if not len(cell) == count == _NODES[name]:
            raise MeshError(_bad(path, row))
        cells, groups = found.setdefault(name, ([], []))
        cells.append(cell)
        groups.append(physical)
    return [(name, np.array(cells), np.array(groups)) for name, (cells, groups) in found.items()]


def _bad(path: Path, row: str) -> str:
    """The message for a row of $ELM that cannot be used."""
    return (
        f"{path}: the element line {row[:60]!r} is cut short, names an unknown node or a type "
        "other than vertex, line, triangle, quad, tetrahedron, hexahedron, prism; save as Gmsh 2."
    )
