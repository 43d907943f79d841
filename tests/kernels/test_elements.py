"""The kernels' elements and quadrature: nodal, complete, pinned."""

from __future__ import annotations

from math import factorial
from pathlib import Path

import numpy as np
import pytest

from supple.kernels import elements
from supple.kernels.cells import ELEMENTS, FACETS
from supple.kernels.degree import SCHEMES, Degree, checked
from supple.kernels.unit import Unit, parse

EVERY = {**ELEMENTS, **FACETS}
#: DESIGN §4: points of the stiffness' rule.
POINTS = {
    "P1": 1, "P2": 4, "Q1": 8, "Q2": 27, "Q2L": 27, "Pr1": 6, "Pr2": 18,
    "T1": 1, "T2": 3, "S1": 4, "S2": 9, "S2L": 9,
}  # fmt: skip
#: Volume of the reference cells.
MEASURE = {
    "triangle": 1 / 2, "tetrahedron": 1 / 6, "prism": 1 / 2, "quadrilateral": 1.0, "hexahedron": 1.0
}  # fmt: skip


def monomial_integral(cell, powers):
    """∫ x^a y^b z^c over the reference cell: a! b! c! / (a + b + c + dim)! on a simplex."""

    def simplex(*p):
        return np.prod([factorial(e) for e in p]) / factorial(sum(p) + len(p))

    if cell in ("triangle", "tetrahedron"):
        return simplex(*powers)
    if cell == "prism":
        return simplex(*powers[:2]) / (powers[2] + 1)
    return 1 / np.prod([e + 1.0 for e in powers])


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
    assert weights.sum() == pytest.approx(MEASURE[EVERY[name].cell.name], rel=1e-14)


@pytest.mark.parametrize("scheme", SCHEMES)
@pytest.mark.parametrize("name", ["P1", "Q1", "Pr1"])
def test_every_rule_is_positive_inside_and_exact_to_its_degree(name, scheme):
    """All monomials of total degree ≤ d, for each d that is let through; closed-form integrals."""
    cell = EVERY[name].cell.name
    for number in range(1, SCHEMES[scheme].get(cell, 0) + 1):
        at, weights = elements.quadrature(name, Degree(number, scheme))
        assert (weights > 0).all()
        assert ((at > -1e-15) & (at < 1 + 1e-15)).all()
        if cell != "hexahedron":
            assert (at[:, : 2 if cell == "prism" else 3].sum(axis=1) <= 1 + 1e-15).all()
        for powers in [(number, 0, 0), (0, 0, number), (number // 3,) * 3, (1, number - 1, 0)]:
            found = weights @ np.prod(at ** np.array(powers), axis=1)
            assert found == pytest.approx(monomial_integral(cell, powers), rel=1e-12), number


def test_schemes_beyond_what_is_let_through_are_not_of_basix():
    """Basix has no such rule; where it has one of a higher degree, 20 is our own limit."""
    for name in ("P1", "Q1", "Pr1"):
        for scheme, limits in SCHEMES.items():
            highest = limits.get(EVERY[name].cell.name, 0)
            if highest < 20:
                with pytest.raises((RuntimeError, ValueError)):
                    elements.quadrature(name, Degree(highest + 1, scheme))


def test_a_prisms_rule_is_a_triangles_times_gauss():
    """Pr1: degree 2 × 2 points, Pr2: degree 4 × 3 points, and so with a scheme of the triangle."""
    for degree, points in [(2, 3 * 2), (4, 6 * 3), (Degree(6, "xiao_gimbutas"), 12 * 4)]:
        at, _ = elements.quadrature("Pr1", degree)
        assert len(at) == points
        heights = np.unique(at[:, 2])
        for z in heights:
            layer = at[at[:, 2] == z, :2]
            np.testing.assert_array_equal(layer, at[at[:, 2] == heights[0], :2])


@pytest.mark.parametrize(
    ("degree", "cell", "says"),
    [
        ((4, "keast"), "tetrahedron", "one of default, gauss_jacobi, xiao_gimbutas, got 'keast'"),
        ((4, "gll"), "tetrahedron", "on a tetrahedron must be one of"),
        ((4, "xiao_gimbutas"), "hexahedron", "one of default, gauss_jacobi, gll"),
        ((16, "xiao_gimbutas"), "tetrahedron", "from 1 to 15 for 'xiao_gimbutas'"),
        (0, "prism", "from 1 to 20"),
        (2.0, "prism", "degree or"),
        ((2, "gll", 1), "hexahedron", "degree or"),
        ("gll", "hexahedron", "degree or"),
    ],
)
def test_a_rule_that_there_is_not_says_what_there_is(degree, cell, says):
    """One sentence, before anything is compiled."""
    with pytest.raises(ValueError, match=says) as caught:
        checked(degree, cell)
    assert str(caught.value).startswith("quadrature")


def test_degrees_of_other_schemes_differ():
    """A Degree is its number, but equal only where the scheme is the same."""
    assert Degree(4) == 4 == Degree(4, "default")
    assert Degree(4, "gll") != 4
    assert Degree(4, "gll") == checked((4, "gll"), "hexahedron")
    assert Degree(4, "gll") + 1 == 5


def test_a_unit_keeps_the_scheme_of_its_degree():
    """Named by it, so that two rules never share a library; what is no rule is refused."""
    law = Path("folder") / "mine.py"
    unit = Unit("inverse", "Pr2", law, Degree(6, "gauss_jacobi"))
    assert unit.name == "mine.Pr2.inverse.q6-gauss_jacobi"
    assert parse(unit.name, Path("folder")) == unit != Unit("inverse", "Pr2", law, 6)
    for wrong in ("mine.P1.direct.6", "mine.P1.direct.q", "mine.P1.direct.q6-x", "mine.P3.direct"):
        with pytest.raises(ValueError, match=r"expected|must be named"):
            parse(wrong, Path("folder"))


@pytest.mark.parametrize("name", EVERY)
def test_quadrature_of_loads_is_of_twice_the_degree(name):
    """Products of two shape functions are integrated exactly: against a much finer rule."""
    assert elements.LOAD_DEGREE[name] >= 2 * EVERY[name].degree
    mass = []
    for degree in (elements.LOAD_DEGREE[name], 12):
        at, weights = elements.quadrature(name, degree)
        n = values(name, at)
        mass.append(np.einsum("q,qi,qj->ij", weights, n, n))
    if name not in ("Q2", "S2"):
        np.testing.assert_allclose(mass[0], mass[1], atol=1e-14)
    else:  # serendipity functions hold x²y too: the load itself is exact, their products nearly
        np.testing.assert_allclose(mass[0].sum(axis=0), mass[1].sum(axis=0), atol=1e-14)
