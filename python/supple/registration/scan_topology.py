"""How the triangles of a scan hang together: pieces, and neighbours that disagree."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

Ints = npt.NDArray[np.int64]
Mask = npt.NDArray[np.bool_]


def pieces(triangles: Ints, count: int) -> tuple[Ints, int]:
    """Which piece each triangle (t,) is of, pieces joined by points, and how many there are."""
    a, b, c = triangles.T
    label, _ = connected(np.r_[a, a], np.r_[b, c], count)
    used, of = np.unique(label[a], return_inverse=True)
    return of.ravel(), len(used)


def consistent(triangles: Ints, count: int) -> Mask:
    """Which triangles (t,) to turn so that neighbours run their shared edge in opposite ways.

    In each piece the fewer are turned. Two triangles share an edge only where no third does. A
    piece that has no two sides (a Möbius strip) is left as it is.
    """
    left, right, same = neighbours(triangles, count)
    none = np.zeros(len(triangles), dtype=bool)
    if not same.any():
        return none
    # Each triangle stands twice in a graph, as it is and turned; neighbours are tied as they agree.
    t = len(triangles)
    other = np.where(same, right + t, right)
    mirror = np.where(same, right, right + t)
    label, _ = connected(np.r_[left, left + t], np.r_[other, mirror], 2 * t)
    kept, flipped = label[:t], label[t:]
    flip = np.asarray(kept > flipped)
    piece = np.minimum(kept, flipped)
    fewer = np.bincount(piece, flip) > 0.5 * np.bincount(piece)
    return np.asarray((flip ^ fewer[piece]) & (kept != flipped))


def neighbours(triangles: Ints, count: int) -> tuple[Ints, Ints, Mask]:
    """Pairs of triangles across an edge of exactly two, and whether they run it the same way."""
    a, b = triangles.ravel(), triangles[:, [1, 2, 0]].ravel()
    key = np.minimum(a, b) * count + np.maximum(a, b)
    order = np.argsort(key, kind="stable")
    key = key[order]
    starts = np.flatnonzero(np.r_[True, key[1:] != key[:-1]])
    pair = starts[np.diff(np.r_[starts, len(key)]) == 2]
    first, second = order[pair], order[pair + 1]
    return first // 3, second // 3, np.asarray((a < b)[first] == (a < b)[second])


def connected(left: Ints, right: Ints, count: int) -> tuple[Ints, int]:
    """Which group each of ``count`` is in when ``left[k]`` is tied to ``right[k]``; how many."""
    from scipy.sparse import coo_matrix
    from scipy.sparse.csgraph import connected_components

    graph = coo_matrix((np.ones(len(left), dtype=np.int8), (left, right)), shape=(count, count))
    number, label = connected_components(graph, directed=False)
    return label.astype(np.int64), int(number)
