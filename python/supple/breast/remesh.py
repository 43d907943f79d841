"""Tetrahedra of a patient's grid: its lattice, cut along the zero of a field on it."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from supple import tetrahedra

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from supple.breast.grid import Field, PatientGrid, Points

    Ints = NDArray[np.int32]


def lattice(grid: PatientGrid, edge: float) -> tuple[Points, Ints]:
    """Nodes (n, 3) mm and positive cells (c, 4): each box of `edge` mm split into six."""
    extent = grid.spacing * (np.array(grid.shape[::-1]) - 1)
    return tetrahedra.lattice(grid.origin, extent, edge)


def cut_lattice(grid: PatientGrid, level: Field, edge: float) -> tuple[Points, Ints]:
    """The lattice's part where `level` (grid) is negative, cut along its zero: nodes, cells."""
    points, cells = lattice(grid, edge)
    values = grid.sample(level, points)
    cells = cells[values[cells].min(axis=1) < grid.spacing]
    return tetrahedra.cut_along_zero(*tetrahedra.compact(points, cells, values))
