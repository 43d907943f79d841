"""Pieces of a thinned scan: small ones beside the body are clutter."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from supple.registration.template import Floats


def main_pieces(points: Floats, gap: float, share: float = 0.04) -> npt.NDArray[np.bool_]:
    """Which points (c,) belong to pieces of at least ``share`` of them; the largest does always.

    Args:
        points: (c, 3) m, evenly spread.
        gap: m; points closer than this are of one piece.
    """
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components
    from scipy.spatial import cKDTree

    pairs = cKDTree(points).query_pairs(gap, output_type="ndarray")
    ones = np.ones(len(pairs), dtype=np.int8)
    graph = coo_array((ones, (pairs[:, 0], pairs[:, 1])), shape=(len(points),) * 2)
    of = connected_components(graph, directed=False)[1]
    count = np.bincount(of)
    return np.asarray((count >= min(share * len(points), count.max()))[of])
