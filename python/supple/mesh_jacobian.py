"""Jacobians of isoparametric cells: volume, quality and the sign that tells an inverted cell."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import product

import numpy as np
import numpy.typing as npt

from supple.kernels.cells import Element

Floats = npt.NDArray[np.float64]
Ints = npt.NDArray[np.int64]

#: Cells that are looked at together, at most, and multiplications of one product over them: what is
#: computed stays in the cache, and BLAS wakes no threads for it.
_AT_ONCE, _PRODUCT = 2048, 250_000

#: Inverse of the edges of the ideal cell, as columns: regular tetrahedron, cube, regular prism.
_IDEAL = {
    "tetrahedron": np.linalg.inv(
        np.array([[1, 0.5, 0.5], [0, 3**0.5 / 2, 3**0.5 / 6], [0, 0, (2 / 3) ** 0.5]])
    ),
    "hexahedron": np.eye(3),
    "prism": np.linalg.inv(np.array([[1, 0.5, 0], [0, 3**0.5 / 2, 0], [0, 0, 1.0]])),
}


def jacobians(points: Floats, cells: Ints, element: Element, at: Floats) -> Floats:
    """dX/dξ (n, 3, 3) of every cell (n, nodes) at one reference point ``at`` (3,)."""
    slopes = element.gradients(at[None, :])[0]
    return np.asarray(np.swapaxes(points[cells], 1, 2) @ slopes)


def determinants(J: Floats) -> Floats:
    """det (n,) of matrices (n, 3, 3), written out: many times faster than one by one."""
    return _determinant(np.moveaxis(J, 0, -1))


def _determinant(m: Floats | Sequence[Sequence[Floats]]) -> Floats:
    """Of matrices whose entries m[i][j] are arrays of one shape."""
    a, b, c = m
    return np.asarray(
        a[0] * (b[1] * c[2] - b[2] * c[1])
        + a[1] * (b[2] * c[0] - b[0] * c[2])
        + a[2] * (b[0] * c[1] - b[1] * c[0])
    )


def quadrature(element: Element) -> tuple[Floats, Floats]:
    """Reference points (q, 3) and weights (q,) that integrate det dX/dξ of a cell exactly.

    Tetrahedron, degree 3: Zienkiewicz, Taylor (2000), vol. 1, table 9.2; cube: Gauss-Legendre;
    prism: a triangle's rule times that.
    """
    if element.cell.is_simplex and element.degree == 1:
        return np.full((1, 3), 0.25), np.array([1 / 6])
    if element.cell.is_simplex:
        inner = np.vstack([np.full((1, 3), 1 / 6), np.full((3, 3), 1 / 6) + np.eye(3) / 3])
        return np.vstack([np.full((1, 3), 0.25), inner]), np.array([-0.8, *[0.45] * 4]) / 6
    nodes, weights = np.polynomial.legendre.leggauss(element.degree + 1)
    nodes, weights = (nodes + 1) / 2, weights / 2
    if element.cell.is_cube:
        points = np.array(list(product(nodes, repeat=3)))
        return points, np.array([np.prod(w) for w in product(weights, repeat=3)])
    flat, flat_weights = _triangle_rule(element.degree)
    points = np.array([[*xy, z] for z in nodes for xy in flat])
    return points, np.outer(weights, flat_weights).ravel()


def _triangle_rule(degree: int) -> tuple[Floats, Floats]:
    """Points (q, 2) and weights (q,) of degree 2 · ``degree``: 3 or 6 points.

    Source: Cowper (1973), Int. J. Numer. Methods Eng. 7, in closed form.
    """
    if degree == 1:
        rings = [(1 / 6, 1 / 3)]
    else:
        root, spread = np.sqrt(38 - 44 * np.sqrt(0.4)), np.sqrt(213125 - 53320 * np.sqrt(10))
        rings = [((8 - np.sqrt(10) + s * root) / 18, (620 + s * spread) / 3720) for s in (1, -1)]
    points = [np.full((3, 2), a) + (1 - 3 * a) * np.eye(3)[:, :2] for a, _ in rings]
    return np.vstack(points), np.repeat([w / 2 for _, w in rings], 3)


def volumes(points: Floats, cells: Ints, element: Element) -> Floats:
    """Signed volume (n,) of every cell, m³."""
    total = np.zeros(len(cells))
    for at, weight in zip(*quadrature(element), strict=True):
        total += weight * determinants(jacobians(points, cells, element, at))
    return total


def smallest_jacobian(points: Floats, cells: Ints, element: Element) -> Floats:
    """Smallest det dX/dξ (n,) over each cell's nodes and quadrature points.

    Relative to its longest edge from the first corner cubed, so that it has no unit.
    """
    at = np.vstack([element.points, _kernel_points(element)])
    if element.name == "P1":
        at = at[:1]
    slopes = np.ascontiguousarray(element.gradients(at).transpose(2, 0, 1))
    result = np.empty(len(cells))
    step = min(_AT_ONCE, _PRODUCT // slopes[0].size)
    for first in range(0, len(cells), step):
        some = cells[first : first + step].T
        x = [np.ascontiguousarray(points[:, i])[some] for i in range(3)]
        columns = [[slopes[j] @ x[i] for j in range(3)] for i in range(3)]
        arms = [component[1 : element.corners] - component[0] for component in x]
        length = np.sqrt(sum(arm**2 for arm in arms).max(axis=0))
        size = np.maximum(length, np.finfo(float).tiny ** 0.25) ** 3
        result[first : first + step] = _determinant(columns).min(axis=0) / size
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
    """Quality (n,): 1 regular tetrahedron, cube or prism, 0 flat; the worst of the corners.

    3 det(W)^(2/3) / ‖W‖², W = dX/dξ relative to the ideal corner. Source: Liu and Joe (1994),
    BIT 34; Knupp (2001), SIAM J. Sci. Comput. 23, for other cells.
    """
    worst = np.ones(len(cells))
    ideal = _IDEAL[element.cell.name]
    for at in element.points[: element.corners]:
        corner = jacobians(points, cells, element, at) @ ideal
        det = np.maximum(determinants(corner), 0.0)
        norm = np.maximum((corner**2).sum(axis=(1, 2)), np.finfo(float).tiny)
        worst = np.minimum(worst, 3 * det ** (2 / 3) / norm)
    return worst
