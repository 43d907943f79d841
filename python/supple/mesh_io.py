"""Mesh files in (meshio's formats and Gmsh 1) and VTU out."""

from __future__ import annotations

import io
from collections.abc import Iterable, Mapping
from contextlib import redirect_stderr, redirect_stdout
from pathlib import Path
from typing import TYPE_CHECKING, Any
from xml.sax.saxutils import quoteattr

import numpy as np
import numpy.typing as npt

from supple import gmsh1
from supple.errors import InputError, MeshError
from supple.files import existing, metres, replacing
from supple.kernels.cells import ELEMENTS, NO_NODE, Element
from supple.mesh_groups import groups_of
from supple.mesh_tags import Tag
from supple.mesh_topology import all_facets, corner_groups, facet_corners

if TYPE_CHECKING:
    from supple.mesh import Mesh

Floats = npt.NDArray[np.float64]
Ints = npt.NDArray[np.int64]

#: Gmsh's number of each VTK node of a prism of 18 nodes, which meshio does not permute.
_GMSH_WEDGE18 = [0, 1, 2, 3, 4, 5, 6, 9, 7, 12, 14, 13, 8, 10, 11, 15, 17, 16]
#: Volume cells that no element stands for.
_OTHER_VOLUMES = ("tetra", "hexahedron", "wedge", "pyramid", "polyhedron", "VTK_")


def read(
    path: Path, unit: str | None, element: str | None
) -> tuple[Floats, Ints, str, dict[str, Tag]]:
    """What ``Mesh.read`` hands to ``Mesh``: points (m), cells, element name, tags."""
    raw = read_raw(existing(path))
    scale = metres(_unit_of(path, raw, unit))
    table = _kept(path, raw, element)
    cells = np.vstack([block.data for block in raw.cells if block.type == table.meshio])
    used = np.unique(cells)
    if len(used) and (used[0] < 0 or used[-1] >= len(raw.points)):
        raise MeshError(f"{path} has cells with nodes outside its {len(raw.points)} points.")
    new = np.full(len(raw.points) + 1, NO_NODE, dtype=np.int64)  # new[NO_NODE] is NO_NODE
    new[used] = np.arange(len(used))
    tags = _renumbered(groups_of(raw, table), new, new[cells], table)
    return np.asarray(raw.points, dtype=float)[used] * scale, new[cells], table.name, tags


def read_raw(path: Path) -> Any:
    """The file as a meshio.Mesh; MeshError if no reader can use it. Prints nothing."""
    import meshio

    if path.suffix.lower() == ".msh" and gmsh1.is_gmsh1(path):
        points, blocks = gmsh1.read(path)
        cells = [(name, data) for name, data, _ in blocks]
        return meshio.Mesh(points, cells, cell_data={"gmsh:physical": [g for *_, g in blocks]})
    said = io.StringIO()
    try:
        with redirect_stdout(said), redirect_stderr(said):
            raw = meshio.read(path)
    except (Exception, SystemExit) as error:  # meshio ends the process on a file it cannot read
        first = next((line.strip() for line in str(error).splitlines() if line.strip()), "")
        cause = f" ({first})" if first and first != "1" else ""
        raise MeshError(
            f"{path} is no mesh file that can be read{cause}; export it as Gmsh, VTU or VTK."
        ) from None
    if path.suffix.lower() == ".msh":
        for block in raw.cells:
            if block.type == "wedge18":
                block.data = block.data[:, _GMSH_WEDGE18]
    return raw


def _unit_of(path: Path, raw: Any, unit: str | None) -> str:
    """The unit that was asked for or that the file names; InputError if they differ."""
    named = [key[6:] for key in raw.field_data if key.startswith("unit: ")]
    if unit is None and not named:
        raise InputError(f"{path} does not name its unit of length; pass unit='m' or unit='mm'.")
    if unit is not None and named and named[0] != unit:
        raise InputError(
            f"{path} says that it is in {named[0]}, got unit={unit!r}; leave unit out."
        )
    return unit if unit is not None else named[0]


def _kept(path: Path, raw: Any, element: str | None) -> Element:
    """The element of the cells to keep."""
    volumes = {b.type for b in raw.cells if len(b.data) and b.type.startswith(_OTHER_VOLUMES)}
    known = {table.name: table for table in ELEMENTS.values() if table.meshio in volumes}
    has = ", ".join(sorted({b.type for b in raw.cells if len(b.data)})) or "no cells"
    if element is not None:
        if element not in known:
            raise MeshError(f"{path} has no {element} cells; it has {has}.")
        return known[element]
    if not known:
        wanted = ", ".join(table.meshio for table in ELEMENTS.values())
        raise MeshError(f"{path} has no volume cells ({wanted}); it has {has}.")
    if len(volumes) > 1:
        raise MeshError(
            f"{path} mixes volume cells ({', '.join(sorted(volumes))}); mesh it with one kind, or "
            f"pass element= one of {', '.join(known)} to keep those alone."
        )
    return next(iter(known.values()))


def _renumbered(tags: Mapping[str, Tag], new: Ints, cells: Ints, table: Element) -> dict[str, Tag]:
    """Tags on the nodes that were kept; without parts that are not on the cells."""
    result = {}
    for name, tag in tags.items():
        ids = tag.ids
        if tag.kind == "points":
            ids = new[ids][new[ids] >= 0]
        elif tag.kind == "facets":
            ids = new[ids][((new[ids] != NO_NODE) | (ids == NO_NODE)).all(axis=1)]
            blocks = [facet_corners(facets, table) for facets in (all_facets(cells, table), ids)]
            known, own = corner_groups(*blocks)
            ids = ids[np.isin(own, known)]
        if len(ids):
            result[name] = Tag(tag.kind, ids)
    return result


def write(
    mesh: Mesh,
    path: Path,
    point_data: Mapping[str, npt.ArrayLike],
    cell_data: Mapping[str, npt.ArrayLike],
    frame: str,
) -> Path:
    """What ``Mesh.write`` does."""
    import meshio

    if path.suffix.lower() != ".vtu":
        raise InputError(f"path must end in .vtu, got {path.name!r}.")
    fields: list[tuple[str, npt.NDArray[Any]]] = [
        ("frame: " + frame, np.ones(1, np.int8)),
        ("unit: m", np.ones(1, np.int8)),
    ]
    at_points = _data(point_data, len(mesh.points), "point_data")
    at_cells = _data(cell_data, len(mesh.cells), "cell_data")
    for name, tag in mesh.tags.items():
        if tag.kind == "facets":
            fields.append((f"facets:{name}", tag.ids))
        else:
            count, data = (
                (len(mesh.points), at_points)
                if tag.kind == "points"
                else (len(mesh.cells), at_cells)
            )
            data[f"tag:{name}"] = np.isin(np.arange(count), tag.ids).astype(np.int8)
    raw = meshio.Mesh(
        mesh.points,
        [(mesh.table.meshio, mesh.cells)],
        point_data=at_points,
        cell_data={name: [values] for name, values in at_cells.items()},
    )
    with replacing(path) as aside:
        raw.write(aside)
        _insert(aside, fields)
    return path


def _data(data: Mapping[str, npt.ArrayLike], count: int, argument: str) -> dict[str, Any]:
    """Arrays (count, components) that VTU can hold; a (count, 3, 3) tensor becomes 9 columns."""
    result = {}
    for name, values in data.items():
        array = np.asarray(values)
        if array.dtype.kind not in "biuf" or array.ndim < 1 or len(array) != count:
            raise InputError(
                f"{argument}[{name!r}] must be numbers of shape ({count}, …), "
                f"got {array.dtype} of shape {array.shape}."
            )
        array = array.astype(np.int8) if array.dtype == np.bool_ else array
        result[name] = array if array.ndim == 1 else array.reshape(count, -1)
    return result


def _insert(path: Path, fields: Iterable[tuple[str, npt.NDArray[Any]]]) -> None:
    """Put field data, which meshio reads but does not write, at the head of a VTU file.

    Numbers only: meshio refuses files with string arrays, so frame and unit are array names.
    """
    arrays = []
    for name, values in fields:
        kind = "Int8" if values.dtype == np.int8 else "Int64"
        columns = f' NumberOfComponents="{values.shape[1]}"' if values.ndim == 2 else ""
        head = f'<DataArray type="{kind}" Name={quoteattr(name)} NumberOfTuples="{len(values)}"'
        numbers = " ".join(map(str, values.ravel()))
        arrays.append(f'{head}{columns} format="ascii">{numbers}</DataArray>\n')
    head, tag, rest = path.read_text(encoding="utf-8").partition("<UnstructuredGrid>\n")
    block = "<FieldData>\n" + "".join(arrays) + "</FieldData>\n"
    path.write_text(head + tag + block + rest, encoding="utf-8")
