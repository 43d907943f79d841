"""The shortest way along a skin: by Dijkstra through places on its edges, then pulled taut."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from supple.errors import MeshError
from supple.registration.skin import edges
from supple.registration.template import OnSurface

Floats = npt.NDArray[np.float64]
Ints = npt.NDArray[np.int64]

#: Where an edge may be crossed, at first, as shares of it.
_TRIED = (np.arange(5) + 0.5) / 5
#: Most rounds of pulling taut; some ten are enough.
_ROUNDS = 50


class Ways:
    """Shortest ways over one surface: points (n, 3) m, triangles (t, 3).

    Source: Lanthier, Maheshwari & Sack (1997), Approximating weighted shortest paths on polyhedral
    surfaces; the crossings are then slid along their edges until the length is least, which is
    convex.
    """

    def __init__(self, points: Floats, triangles: Ints) -> None:
        self._points, self._triangles = points, triangles
        ends, owner = np.unique(
            np.sort(edges(triangles).reshape(-1, 2), axis=1), axis=0, return_inverse=True
        )
        self._ends, self._edges = ends, owner.reshape(-1, 3)
        a, b = points[ends[:, 0]], points[ends[:, 1]]
        self._tried = (a[:, None] + _TRIED[:, None] * (b - a)[:, None]).reshape(-1, 3)
        self._links = self._linked()

    def shortest(self, start: OnSurface, end: OnSurface) -> OnSurface:
        """From one place to another, as the places that it passes, both included.

        Moved a little with the surface, these places are still a shortest way to first order.

        Raises:
            MeshError: the surface does not lead from one to the other.
        """
        crossed = self._crossed(start, end)
        a, b = (place.at(self._points, self._triangles)[0] for place in (start, end))
        share = _taut(a, self._points[self._ends[crossed]], b)
        passed = [self._on_edge(edge, s) for edge, s in zip(crossed, share, strict=True)]
        return OnSurface(
            np.array([start.triangle[0], *(t for t, _ in passed), end.triangle[0]]),
            np.array([start.barycentric[0], *(w for _, w in passed), end.barycentric[0]]),
        )

    def _linked(self) -> tuple[Ints, Ints, Floats]:
        """Pairs of tried places on two edges of one triangle, and how far apart they are."""
        k = len(_TRIED)
        nodes = (k * self._edges[:, :, None] + np.arange(k)).reshape(-1, 3 * k)
        i, j = np.nonzero(np.subtract.outer(np.arange(3 * k) // k, np.arange(3 * k) // k) > 0)
        rows, columns = nodes[:, i].ravel(), nodes[:, j].ravel()
        far = np.linalg.norm(self._tried[rows] - self._tried[columns], axis=1)
        return rows, columns, far

    def _linked_to(self, place: OnSurface, node: int) -> tuple[Ints, Ints, Floats]:
        """The same of a place, which is node ``node``, and those on its triangle's edges."""
        k = len(_TRIED)
        nodes = (k * self._edges[place.triangle[0]][:, None] + np.arange(k)).ravel()
        at = place.at(self._points, self._triangles)[0]
        return np.full(3 * k, node), nodes, np.linalg.norm(self._tried[nodes] - at, axis=1)

    def _crossed(self, start: OnSurface, end: OnSurface) -> Ints:
        """Edges between two places; none within a triangle."""
        from scipy.sparse import coo_array
        from scipy.sparse.csgraph import dijkstra

        if start.triangle[0] == end.triangle[0]:
            return np.zeros(0, dtype=np.int64)
        first = len(self._tried)
        parts = (self._links, self._linked_to(start, first), self._linked_to(end, first + 1))
        rows, columns, far = (np.concatenate(column) for column in zip(*parts, strict=True))
        graph = coo_array((far, (rows, columns)), shape=(first + 2, first + 2)).tocsr()
        _, came = dijkstra(graph, directed=False, indices=first, return_predecessors=True)
        passed, node = [], int(came[first + 1])
        while 0 <= node < first:
            passed.append(node // len(_TRIED))
            node = int(came[node])
        if node != first:
            raise MeshError("two landmarks lie on parts of the skin that do not touch; join them.")
        return np.array(passed[::-1])

    def _on_edge(self, edge: int, share: float) -> tuple[int, Floats]:
        """A triangle that has the edge, and the weights of its corners at a share of it."""
        triangle = int(np.argmax((self._edges == edge).any(axis=1)))
        a, b = self._ends[edge]
        corners = self._triangles[triangle]
        return triangle, np.where(corners == a, 1 - share, np.where(corners == b, share, 0.0))


def length(points: Floats, triangles: Ints, way: OnSurface) -> Floats:
    """Of a way, (…) m, with the vertices at (…, n, 3) m."""
    at = np.einsum("kc,...kcd->...kd", way.barycentric, points[..., triangles[way.triangle], :])
    return np.asarray(np.linalg.norm(np.diff(at, axis=-2), axis=-1).sum(axis=-1))


def _taut(a: Floats, ends: Floats, b: Floats) -> Floats:
    """Shares (m,) of edges (m, 2, 3) at which the way a … b through them is shortest.

    Least squares of the steps, each weighted by 1 / its length: Weiszfeld's iteration.
    """
    from scipy.optimize import lsq_linear

    m, along = len(ends), ends[:, 1] - ends[:, 0]
    share = np.full(m, 0.5)
    if not m:
        return share
    slope = np.zeros((m + 1, 3, m))  # of the steps, by the shares
    k = np.arange(m)
    slope[k, :, k], slope[k + 1, :, k] = along, -along
    fixed = np.diff(np.vstack([a, ends[:, 0], b]), axis=0)
    for _ in range(_ROUNDS):
        far = np.linalg.norm(fixed + slope @ share, axis=1)
        root = 1 / np.sqrt(np.maximum(far, 1e-6 * far.max()))[:, None]
        rows = (slope * root[..., None]).reshape(-1, m)
        before = share
        share = lsq_linear(rows, -(fixed * root).ravel(), bounds=(0, 1)).x
        if np.abs(share - before).max() < 1e-6:
            break
    return np.asarray(share)
