"""The kernels' elements and quadrature: nodal, complete, pinned."""

from __future__ import annotations

import numpy as np
import pytest

from supple.kernels import elements
from supple.kernels.cells import ELEMENTS, FACETS

EVERY = {**ELEMENTS, **FACETS}
#: DESIGN §4: points of the stiffness' rule.
POINTS = {"P1": 1, "P2": 4, "Q1": 8, "Q2": 27, "T1": 1, "T2": 3, "S1": 4, "S2": 9}


def values(name, at):
    """Shape functions (q, nodes) in kernel order."""
    return elements.scalar_element(name).tabulate(0, at)[0]


@pytest.mark.parametrize("name", EVERY)
def test_each_shape_function_is_one_at_its_own_node_and_zero_at_the_others(name):
    """With the node order of the one table that permutes files into kernels."""
    table = EVERY[name]
    np.testing.assert_allclose(values(name, table.points[table.from_vtk]), np.eye(table.nodes),
                               atol=1e-13)  # fmt: skip


@pytest.mark.parametrize("name", EVERY)
def test_shape_functions_reproduce_every_polynomial_of_their_degree(name):
    """Node values of x^a y^b z^c with a + b + c ≤ degree interpolate to it exactly."""
    table = EVERY[name]
    nodes = table.points[table.from_vtk]
    at = np.random.default_rng(0).uniform(0, 0.5, (7, nodes.shape[1]))
    for powers in np.ndindex(*(table.degree + 1,) * nodes.shape[1]):
        if sum(powers) <= table.degree:
            expected = np.prod(at ** np.array(powers), axis=1)
            found = values(name, at) @ np.prod(nodes ** np.array(powers), axis=1)
            np.testing.assert_allclose(found, expected, atol=1e-14)


@pytest.mark.parametrize("name", EVERY)
def test_quadrature_of_the_stiffness_is_pinned(name):
    """As many points as DESIGN §4 says, inside, positive weights that sum to the cell's measure."""
    at, weights = elements.quadrature(name, elements.STIFFNESS_DEGREE[name])
    assert len(weights) == POINTS[name]
    assert (weights > 0).all()
    assert ((at > 0) & (at < 1)).all()
    measure = {2: 1 / 2, 3: 1 / 6}[at.shape[1]] if EVERY[name].cell.is_simplex else 1.0
    assert weights.sum() == pytest.approx(measure, rel=1e-14)


@pytest.mark.parametrize("name", EVERY)
def test_quadrature_of_loads_is_of_twice_the_degree(name):
    """Products of two shape functions are integrated exactly: against a much finer rule."""
    assert elements.LOAD_DEGREE[name] >= 2 * EVERY[name].degree
    mass = []
    for degree in (elements.LOAD_DEGREE[name], 12):
        at, weights = elements.quadrature(name, degree)
        n = values(name, at)
        mass.append(np.einsum("q,qi,qj->ij", weights, n, n))
    if EVERY[name].cell.is_simplex or EVERY[name].degree == 1:
        np.testing.assert_allclose(mass[0], mass[1], atol=1e-14)
    else:  # serendipity functions hold x²y too: the load itself is exact, their products nearly
        np.testing.assert_allclose(mass[0].sum(axis=0), mass[1].sum(axis=0), atol=1e-14)
