"""What multigrid takes from PyAMG: which nodes form an aggregate, and its rigid motions' basis.

PyAMG (MIT) is an extra, ``pip install supple[multigrid]``: it decides once a body what the levels
are; the levels themselves, their cycles and the conjugate gradients run in the runtime.
"""

from __future__ import annotations

from importlib.util import find_spec
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from .errors import InputError

if TYPE_CHECKING:
    from .mesh import Mesh

Floats = npt.NDArray[np.float64]
Ints = npt.NDArray[np.int64]


def available() -> bool:
    """Whether PyAMG is installed; does not import it."""
    return find_spec("pyamg") is not None


def require_available() -> None:
    """Say how to get PyAMG where it is missing.

    Raises:
        InputError: it is not installed.
    """
    if not available():
        raise InputError(
            'solver "multigrid" needs the package pyamg, which is not installed; run '
            'pip install "supple[multigrid]", or choose solver "direct".'
        )


def aggregate(start: Ints, column: Ints, modes: Floats) -> tuple[int, Ints, Floats, Floats]:
    """Aggregates of the nodes of a matrix in blocks.

    Args:
        start: (n + 1,) offsets of the block rows into ``column``, their neighbours.
        modes: (n·b, 6) rigid motions at the rows of the blocks.

    Returns:
        How many there are; (n,) the aggregate of each node, -1 if it has no neighbour; (n·b, 6) an
        orthonormal basis of the modes in each aggregate; (6·aggregates, 6) the modes in that basis.
    """
    from pyamg.aggregation.aggregate import standard_aggregation
    from pyamg.aggregation.tentative import fit_candidates
    from scipy.sparse import csr_array

    n = len(start) - 1
    graph = csr_array((np.ones(len(column), np.int8), column, start), (n, n))
    members, _ = standard_aggregation(graph)
    basis, coarse = fit_candidates(members, modes)
    number = np.full(n, -1, dtype=np.int64)
    inside = np.diff(members.indptr) > 0
    number[inside] = members.indices
    rows = np.zeros((n, len(modes) // n, 6))
    rows[inside] = basis.data
    return members.shape[1], number, rows.reshape(-1, 6), coarse


def corners(mesh: Mesh) -> tuple[Ints, Ints]:
    """The corners (k,) that each node is the mean of, and where each node's begin (n + 1,).

    Empty for elements of degree 1, whose nodes all are corners.
    """
    table = mesh.table
    if table.degree == 1:
        return np.zeros(0, np.int64), np.zeros(0, np.int64)
    first = np.unique(mesh.cells.ravel(), return_index=True)[1]  # a place where each node is met
    cell, local = np.divmod(first, mesh.cells.shape[1])
    counts = np.array([len(entity) for entity in table.entities])[local]
    padded = np.zeros((table.nodes, max(map(len, table.entities))), dtype=np.int64)
    for row, entity in zip(padded, table.entities, strict=True):
        row[: len(entity)] = entity
    parents = np.take_along_axis(mesh.cells[cell], padded[local], axis=1)
    chosen = np.arange(padded.shape[1]) < counts[:, None]
    return np.append(0, np.cumsum(counts)), parents[chosen]
