"""How the triangles of a scan hang together: pieces, and neighbours that disagree."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

Ints = npt.NDArray[np.int64]
Mask = npt.NDArray[np.bool_]


def connected(left: Ints, right: Ints, count: int) -> tuple[Ints, int]:
    """Which group each of ``count`` is in when ``left[k]`` is tied to ``right[k]``; how many."""
    from scipy.sparse import coo_matrix
    from scipy.sparse.csgraph import connected_components

    graph = coo_matrix((np.ones(len(left), dtype=np.int8), (left, right)), shape=(count, count))
    number, label = connected_components(graph, directed=False)
    return label, int(number)


def half_edges(triangles: Ints, count: int) -> Any:
    """Sparse (count, count): how often an edge is run from the row's point to the column's."""
    from scipy.sparse import coo_matrix

    small = np.ascontiguousarray(triangles.T, dtype=np.int32)
    rows, columns = small.ravel(), small[[1, 2, 0]].ravel()
    ones = np.ones(len(rows), dtype=np.int16)
    return coo_matrix((ones, (rows, columns)), shape=(count, count)).tocsr()


def pieces(edges: Any) -> tuple[Ints, int]:
    """Which piece each point is in, and how many there are; a lone point is one."""
    from scipy.sparse.csgraph import connected_components

    number, label = connected_components(edges, directed=True, connection="weak")
    return label, int(number)


def consistent(triangles: Ints, edges: Any) -> Mask:
    """Which triangles (t,) to turn so that neighbours run their shared edge in opposite ways.

    In each piece the fewer are turned. Two triangles share an edge only where no third does. A
    piece that has no two sides (a Möbius strip) is left as it is.
    """
    t = len(triangles)
    if edges.data.max() == 1:
        return np.zeros(t, dtype=bool)
    left, right, same = _neighbours(triangles, edges.shape[0])
    # Each triangle stands twice in a graph, as it is and turned; neighbours are tied as they agree.
    other, mirror = np.where(same, right + t, right), np.where(same, right, right + t)
    label, _ = connected(np.r_[left, left + t], np.r_[other, mirror], 2 * t)
    kept, flipped = label[:t], label[t:]
    flip = np.asarray(kept > flipped)
    piece = np.minimum(kept, flipped)
    fewer = np.bincount(piece, flip) > 0.5 * np.bincount(piece)
    return np.asarray((flip ^ fewer[piece]) & (kept != flipped))


def _neighbours(triangles: Ints, count: int) -> tuple[Ints, Ints, Mask]:
    """Pairs of triangles across an edge of exactly two, and whether they run it the same way."""
    a, b = triangles.ravel(), triangles[:, [1, 2, 0]].ravel()
    key = np.minimum(a, b) * count + np.maximum(a, b)
    order = np.argsort(key)
    key = key[order]
    starts = np.flatnonzero(np.r_[True, key[1:] != key[:-1]])
    pair = starts[np.diff(np.r_[starts, len(key)]) == 2]
    first, second = order[pair], order[pair + 1]
    return first // 3, second // 3, np.asarray((a < b)[first] == (a < b)[second])
