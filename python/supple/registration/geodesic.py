"""The shortest way along a skin: by Dijkstra through places on its edges, then pulled taut."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from supple.errors import MeshError
from supple.registration.skin import edges
from supple.registration.template import OnSurface

Floats = npt.NDArray[np.float64]
Ints = npt.NDArray[np.int64]

#: Where an edge may be crossed, at first, as shares of it.
_TRIED = np.array([1 / 6, 1 / 2, 5 / 6])


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

    def _nodes(self, triangle: int) -> Ints:
        """(9,) tried places on the edges of a triangle."""
        return (len(_TRIED) * self._edges[triangle][:, None] + np.arange(len(_TRIED))).ravel()

    def _linked(self) -> Any:
        """Lengths between the tried places on two edges of one triangle."""
        from scipy.sparse import coo_array

        k = len(_TRIED)
        nodes = (k * self._edges[:, :, None] + np.arange(k)).reshape(-1, 3 * k)
        i, j = (x.ravel() for x in np.nonzero(np.subtract.outer(*[np.arange(3 * k) // k] * 2) > 0))
        rows, columns = nodes[:, i].ravel(), nodes[:, j].ravel()
        far = np.linalg.norm(self._tried[rows] - self._tried[columns], axis=1)
        return coo_array((far, (rows, columns)), shape=[len(self._tried)] * 2).tocsr()

    def _crossed(self, start: OnSurface, end: OnSurface) -> Ints:
        """Edges between two places; none within a triangle."""
        from scipy.sparse.csgraph import dijkstra

        first, last = int(start.triangle[0]), int(end.triangle[0])
        if first == last:
            return np.zeros(0, dtype=np.int64)
        a, b = (place.at(self._points, self._triangles)[0] for place in (start, end))
        begin, arrive = self._nodes(first), self._nodes(last)
        out, came = dijkstra(self._links, directed=False, indices=begin, return_predecessors=True)
        whole = (np.linalg.norm(self._tried[begin] - a, axis=1)[:, None] + out[:, arrive]
                 + np.linalg.norm(self._tried[arrive] - b, axis=1))  # fmt: skip
        if not np.isfinite(whole).any():
            raise MeshError("two landmarks lie on parts of the skin that do not touch; join them.")
        row, column = np.unravel_index(int(whole.argmin()), whole.shape)
        node, passed = int(arrive[column]), []
        while node >= 0:
            passed.append(node // len(_TRIED))
            node = int(came[row, node])
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
    """Shares (m,) of edges (m, 2, 3) at which the way a … b through them is shortest."""
    from scipy.optimize import minimize

    if not len(ends):
        return np.zeros(0)
    along = ends[:, 1] - ends[:, 0]

    def total(share: Floats) -> tuple[float, Floats]:
        way = np.vstack([a, ends[:, 0] + share[:, None] * along, b])
        steps = np.diff(way, axis=0)
        far = np.maximum(np.linalg.norm(steps, axis=1, keepdims=True), 1e-15)
        turn = (steps / far)[:-1] - (steps / far)[1:]
        return float(far.sum()), np.asarray(np.einsum("md,md->m", turn, along))

    found = minimize(total, np.full(len(ends), 0.5), jac=True, method="L-BFGS-B",
                     bounds=[(0, 1)] * len(ends), options={"ftol": 1e-15, "gtol": 1e-12})  # fmt: skip
    return np.asarray(found.x)
