"""Jacobians of isoparametric cells: volume, quality and the sign that tells an inverted cell."""

from __future__ import annotations

from itertools import product

import numpy as np
import numpy.typing as npt

from supple.kernels.cells import Element

Floats = npt.NDArray[np.float64]
Ints = npt.NDArray[np.int64]

#: Inverse of the edges of a regular tetrahedron, as columns: the ideal corner of a tetrahedron.
_REGULAR = np.linalg.inv(
    np.array([[1, 0.5, 0.5], [0, 3**0.5 / 2, 3**0.5 / 6], [0, 0, (2 / 3) ** 0.5]])
)


def jacobians(points: Floats, cells: Ints, element: Element, at: Floats) -> Floats:
    """dX/dξ (n, 3, 3) of every cell (n, nodes) at one reference point ``at`` (3,)."""
    slopes = element.gradients(at[None, :])[0]
    result: Floats = np.einsum("cni,nj->cij", points[cells], slopes)
    return result


def quadrature(element: Element) -> tuple[Floats, Floats]:
    """Reference points (q, 3) and weights (q,) that integrate det dX/dξ of a cell exactly.

    Tetrahedron, degree 3: Zienkiewicz, Taylor (2000), vol. 1, table 9.2; cube: Gauss-Legendre.
    """
    if element.cell.is_simplex and element.degree == 1:
        return np.full((1, 3), 0.25), np.array([1 / 6])
    if element.cell.is_simplex:
        inner = np.vstack([np.full((1, 3), 1 / 6), np.full((3, 3), 1 / 6) + np.eye(3) / 3])
        return np.vstack([np.full((1, 3), 0.25), inner]), np.array([-0.8, *[0.45] * 4]) / 6
    nodes, weights = np.polynomial.legendre.leggauss(element.degree + 1)
    points = np.array(list(product((nodes + 1) / 2, repeat=3)))
    return points, np.array([np.prod(w) for w in product(weights / 2, repeat=3)])


def volumes(points: Floats, cells: Ints, element: Element) -> Floats:
    """Signed volume (n,) of every cell, m³."""
    total = np.zeros(len(cells))
    for at, weight in zip(*quadrature(element), strict=True):
        total += weight * np.linalg.det(jacobians(points, cells, element, at))
    return total


def smallest_jacobian(points: Floats, cells: Ints, element: Element) -> Floats:
    """Smallest det dX/dξ (n,) over each cell's nodes and quadrature points.

    Relative to its longest edge from the first corner cubed, so that it has no unit.
    """
    at = np.vstack([element.points, _kernel_points(element)])
    if element.name == "P1":
        at = at[:1]
    dets = [np.linalg.det(jacobians(points, cells, element, x)) for x in at]
    arms = points[cells[:, 1 : element.corners]] - points[cells[:, :1]]
    length = np.linalg.norm(arms, axis=2).max(axis=1)
    result: Floats = np.min(dets, axis=0) / np.maximum(length, np.finfo(float).tiny ** 0.25) ** 3
    return result


def _kernel_points(element: Element) -> Floats:
    """Points (q, 3) where kernels evaluate energies; for P2 the four of the degree 2 rule."""
    points = quadrature(element)[0]
    if element.name == "P2":
        near = (5 - 5**0.5) / 20
        four = np.vstack(
            [np.full((1, 3), near), np.full((3, 3), near) + np.eye(3) * (1 - 4 * near)]
        )
        return np.vstack([points, four])
    return points


def mean_ratio(points: Floats, cells: Ints, element: Element) -> Floats:
    """Quality (n,): 1 regular tetrahedron or cube, 0 flat; the worst of each cell's corners.

    3 det(W)^(2/3) / ‖W‖², W = dX/dξ relative to the ideal corner. Source: Liu and Joe (1994),
    BIT 34; Knupp (2001), SIAM J. Sci. Comput. 23, for hexahedra.
    """
    worst = np.ones(len(cells))
    ideal = _REGULAR if element.cell.is_simplex else np.eye(3)
    for at in element.points[: element.corners]:
        corner = jacobians(points, cells, element, at) @ ideal
        det = np.maximum(np.linalg.det(corner), 0.0)
        norm = np.maximum((corner**2).sum(axis=(1, 2)), np.finfo(float).tiny)
        worst = np.minimum(worst, 3 * det ** (2 / 3) / norm)
    return worst
