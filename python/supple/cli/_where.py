"""How a case says which part of a mesh it means: `where`.

where = "base"                      a tag of the mesh
where = [0, 4, 17]                  ids
where = { z = "min" }               the lowest end along z (or "max")
where = { z = 0.0 }                 at z = 0, to within a millionth of the mesh's size
where = { x = [0.0, 0.1], z = 0.0 } both hold; ends included
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

if TYPE_CHECKING:
    from ..case import Table
    from ..mesh import Mesh

Where = str | npt.NDArray[np.int64] | npt.NDArray[np.bool_]
AXES = ("x", "y", "z")
TOLERANCE = 1e-6
"""Of the mesh's size: how far from a plane a node may lie and still be on it."""


def nodes(table: Table, mesh: Mesh) -> Where:
    """What `where` of this table chooses among the nodes, as `Body` takes it.

    Raises:
        InputError: it is none of the above, or chooses nothing.
    """
    chosen = _chosen(table, mesh.points, mesh.size)
    with table.named("where"):
        mesh.nodes(chosen)
    return chosen


def cells(table: Table, mesh: Mesh) -> Where:
    """The same among the cells, by the mean of their nodes."""
    chosen = _chosen(table, mesh.points[mesh.cells].mean(axis=1), mesh.size)
    with table.named("where"):
        mesh.cell_ids(chosen)
    return chosen


def _chosen(table: Table, points: npt.NDArray[np.float64], size: float) -> Where:
    value = table.value("where")
    if isinstance(value, str) and value:
        return value
    if isinstance(value, list) and value and all(type(item) is int for item in value):
        return np.array(value, dtype=np.int64)
    if isinstance(value, Mapping) and value and set(value) <= set(AXES):
        mask = np.ones(len(points), dtype=bool)
        for axis, given in value.items():
            low, high = _interval(table, axis, given, points[:, AXES.index(axis)])
            along = points[:, AXES.index(axis)]
            mask &= (along >= low - TOLERANCE * size) & (along <= high + TOLERANCE * size)
        return mask
    raise table.wrong("where", 'a tag, a list of ids or a place such as { z = "min" }', value)


def _interval(
    table: Table, axis: str, given: object, along: npt.NDArray[np.float64]
) -> tuple[float, float]:
    """The lowest and highest coordinate, m, that `given` admits on this axis."""
    if given == "min":
        return along.min(), along.min()
    if given == "max":
        return along.max(), along.max()
    ends: list[Any] = given if isinstance(given, list) and len(given) == 2 else [given, given]
    if all(isinstance(end, int | float) and not isinstance(end, bool) for end in ends):
        return float(ends[0]), float(ends[1])
    raise table.wrong(f"where.{axis}", '"min", "max", a number or [low, high] in m', given)
