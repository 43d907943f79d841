"""Tetrahedra inside a level set: a lattice cut along its zero, and remeshing, both by Mmg.

The lattice is cut by a field and not fitted to a triangle surface: whatever the surface looks like,
the mesh is closed and without self-intersection, and every cell is positive.

Source: Dapogny, Dobrzynski & Frey (2014), J. Comput. Phys. 262, 358–378.
"""

from __future__ import annotations

from itertools import permutations
from typing import Any

import numpy as np
from numpy.typing import NDArray

from supple.errors import MeshError
from supple.signals import signals_kept

Points = NDArray[np.float64]
Ints = NDArray[np.int32]

INSIDE = 3  # the reference that Mmg gives to cells where the level set is negative


def lattice(origin: Points, extent: Points, edge: float) -> tuple[Points, Ints]:
    """Nodes (n, 3) and positive cells (c, 4): each box of `edge` split into six."""
    nx, ny, nz = (int(n) for n in np.ceil(extent / edge).astype(int) + 1)
    index = np.indices((nx, ny, nz)).reshape(3, -1).T
    names = np.arange(len(index)).reshape(nx, ny, nz)
    boxes = names[:-1, :-1, :-1].ravel()
    strides = (ny * nz, nz, 1)
    cells = [_path(boxes, [strides[a] for a in axes], axes) for axes in permutations(range(3))]
    return origin + edge * index, np.concatenate(cells).astype(np.int32)


def _path(start: NDArray[np.intp], steps: list[int], axes: tuple[int, ...]) -> NDArray[np.intp]:
    """Tetrahedra from each box's first to its last corner, one step along each of `axes`."""
    path = start[:, None] + np.concatenate([[0], np.cumsum(steps)])
    even = axes in ((0, 1, 2), (1, 2, 0), (2, 0, 1))
    return np.asarray(path if even else path[:, [0, 2, 1, 3]])


@signals_kept()
def cut_along_zero(points: Points, cells: Ints, values: Points) -> tuple[Points, Ints]:
    """The part of a mesh where the `values` (n,) of its nodes are negative: nodes, cells."""
    from mmgpy import MmgMesh3D

    mesh = MmgMesh3D(points, cells)
    try:
        mesh.remesh_levelset(
            values[:, None], ls=0.0, noinsert=1, noswap=1, nomove=1, angle=0, verbose=-1
        )
    except RuntimeError as error:
        raise _failed("cutting the lattice along the body's surface", error) from error
    cells, sides = mesh.get_tetrahedra_with_refs()
    return compact(mesh.get_vertices(), cells[sides == INSIDE])[:2]


@signals_kept()
def remesh(
    points: Points, cells: Ints, edges: Points, *, gradation: float, chord: float | None
) -> tuple[Points, Ints]:
    """Better tetrahedra in the same body.

    Args:
        points: (n, 3) mm.
        cells: (c, 4), positive.
        edges: (n,) length of the edges wanted at each node, mm.
        gradation: greatest ratio of neighbouring edges' lengths.
        chord: how far the new surface may lie off the old one, mm; None keeps the old facets.
    """
    from mmgpy import MmgMesh3D

    longest = float(edges.max())
    mesh = MmgMesh3D(points, cells)
    mesh["metric"] = np.ascontiguousarray(edges[:, None], dtype=float)
    try:
        if chord is None:
            mesh.remesh(nosurf=1, hmax=longest, hgrad=gradation, angle=0, verbose=-1)
        else:
            mesh.remesh(
                hausd=chord, hmin=longest / 8, hmax=longest, hgrad=gradation, angle=0, verbose=-1
            )
    except RuntimeError as error:
        raise _failed("remeshing the body", error) from error
    return mesh.get_vertices(), mesh.get_tetrahedra()


def largest_parts(points: Points, cells: Ints, least: float) -> tuple[Points, Ints, int]:
    """The mesh without parts of fewer cells than `least` of the largest, and how many are left."""
    links = np.concatenate([cells[:, [0, i]] for i in (1, 2, 3)])
    part = connected(links, len(points))[cells[:, 0]]
    size = np.bincount(part)
    kept = size >= least * size.max()
    points, cells, _ = compact(points, cells[kept[part]])
    return points, cells, int(kept.sum())


def connected(pairs: NDArray[Any], count: int) -> Ints:
    """(count,) name of the connected part that each of `count` things belongs to."""
    from scipy import sparse

    links = sparse.coo_array((np.ones(len(pairs)), (pairs[:, 0], pairs[:, 1])), (count, count))
    return np.asarray(sparse.csgraph.connected_components(links, directed=False)[1], np.int32)


def compact(
    points: Points, cells: Ints, values: Points | None = None
) -> tuple[Points, Ints, Points]:
    """The nodes that `cells` use, the cells in their numbers, and those nodes' `values`."""
    used, renamed = np.unique(cells, return_inverse=True)
    kept = np.empty(0) if values is None else values[used]
    return points[used], renamed.reshape(-1, 4).astype(np.int32), kept


def _failed(what: str, error: Exception) -> MeshError:
    return MeshError(
        f"{what} failed in the mesher ({error}): try edges of another length, or look at the input"
        " for fragments."
    )
