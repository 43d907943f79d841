"""GMRES on one kept symmetric factor finds the rest shape that LU finds, or hands over to LU."""

from __future__ import annotations

import numpy as np
import pytest

import supple
from supple import assembly, newton

EDGE = 0.1

#: Law, formulation, parameters and gravity, m/s², that strain the block by 20 to 60 %.
LAWS = [
    ("neo_hookean", "displacement", {"young": 1e3, "poisson": 0.45}, 2.0),
    ("corotational_polar", "displacement", {"young": 1e3, "poisson": 0.45}, 2.0),
    ("saint_venant_kirchhoff", "displacement", {"young": 1e3, "poisson": 0.3}, 2.0),
    ("holzapfel_gasser_ogden", "displacement", {}, 20.0),
    ("demiray", "displacement", {}, 4.0),
    ("neo_hookean_isochoric", "mixed", {"mu": 334.0, "bulk": 33e3}, 2.0),
    ("neo_hookean_isochoric", "mean-dilatation", {"mu": 334.0, "bulk": 33e3}, 2.0),
]
ELEMENT = {"displacement": "P1", "mixed": "P2", "mean-dilatation": "Q1"}


def block(element="P1", law="neo_hookean", formulation="displacement", g=2.0, cells=3, **values):
    """A soft cube that lies and leans on its base under gravity."""
    mesh = supple.Mesh.box((cells,) * 3, (EDGE,) * 3, element)
    values = values or ({"young": 1e3, "poisson": 0.3} if law == "neo_hookean" else {})
    body = supple.Body(mesh, law, formulation, density=1000.0, **values)
    return body.fix(lambda p: p[:, 2] < 1e-9).gravity((0.0, g / 2, g))


def top(p):
    return p[:, 2] > EDGE - 1e-9


def assert_same(body, size=EDGE):
    """The rest shapes of both solvers, to 1e-10 of the size; returns them."""
    iterated, direct = body.rest_shape(solver="gmres"), body.rest_shape(solver="direct")
    assert abs(iterated.u).max() > 0.05 * size
    assert abs(iterated.points - direct.points).max() <= 1e-10 * size
    assert iterated.timings["krylov_iterations"] > 0 == direct.timings["krylov_iterations"]
    assert iterated.timings["factorisations"] < direct.timings["factorisations"]
    return iterated, direct


@pytest.mark.parametrize(("law", "formulation", "values", "g"), LAWS)
def test_rest_shape_is_that_of_lu(law, formulation, values, g):
    """Every formulation and laws of every kind: points to 1e-10 of the size, the same stress."""
    body = block(ELEMENT[formulation], law, formulation, g, cells=2, **values)
    iterated, direct = assert_same(body)
    scale = abs(direct.cauchy()).max()
    np.testing.assert_allclose(iterated.cauchy(), direct.cauchy(), rtol=0, atol=1e-8 * scale)


@pytest.mark.parametrize("element", ["P2", "Q1", "Q2"])
def test_rest_shape_is_that_of_lu_on_every_element(element):
    """To 1e-10 of the size."""
    assert_same(block(element, cells=2))


@pytest.mark.parametrize("what", ["skin", "pressure", "symmetry", "slide", "forces"])
def test_rest_shape_is_that_of_lu_under_other_terms(what):
    """Membranes, follower loads, nodes held in some directions only, sliding: 1e-10 of the size."""
    body = block()
    if what == "skin":
        body.skin(top, "neo_hookean", thickness=2e-3, young=5e3)
    elif what == "pressure":
        body.pressure(top, -40.0)
    elif what == "symmetry":
        body.prescribe(lambda p: p[:, 0] < 1e-9, (0.0, np.nan, np.nan))
    elif what == "slide":
        square = np.array([[-1.0, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]])
        wall = supple.Surface(square[:, [2, 0, 1]], np.array([[0, 1, 2], [0, 2, 3]]))
        body.slide(lambda p: p[:, 0] < 1e-9, wall)
    else:
        body.force(top, (0.02, 0.0, 0.01))
    assert_same(body)


def test_rotations_of_a_bent_beam_cost_no_second_factor():
    """The rest shape of a straight cantilever turns by 45°: one factorisation, few iterations."""
    mesh = supple.Mesh.box((20, 3, 3), (80.0, 15.0, 15.0), "P1")
    body = supple.Body(mesh, "neo_hookean", young=3e3, poisson=0.3)
    body.fix(lambda p: p[:, 0] < 1e-9).traction(lambda p: p[:, 0] > 80 - 1e-9, (0.0, -20.0, 0.0))
    rest, _ = assert_same(body, size=80.0)
    along = rest.points[mesh.points[:, 0] > 79.9].mean(axis=0)
    before = rest.points[abs(mesh.points[:, 0] - 72.0) < 0.1].mean(axis=0)
    angle = np.degrees(np.arctan2(*(along - before)[[1, 0]]))
    assert angle > 40
    assert rest.timings["factorisations"] == 1
    assert rest.timings["krylov_iterations"] < 12 * rest.iterations


@pytest.mark.parametrize("strain", [-0.004, -0.02, -0.1, 0.1])
def test_stability_is_that_of_a_factorisation(strain):
    """A clamped column pressed to half of Euler's strain, to more than twice that, far more, drawn.

    Its slenderness is 5: π²/4 · (1/5)²/12 = 0.8 %. On the factor that an inverse solve has kept,
    and by the signs of the pivots of LDLᵀ.
    """
    mesh = supple.Mesh.box((15, 3, 3), (5.0, 1.0, 1.0), "P1")
    body = supple.Body(mesh, "neo_hookean", young=1e4, poisson=0.3, density=1.0)
    body.fix(lambda p: p[:, 0] < 1e-9).gravity((0.0, 0.0, -0.1))
    body.rest_shape(solver="gmres")
    inverse = assembly.system(body, inverse=True).system
    u = np.zeros_like(mesh.points)
    u[:, 0] = strain * mesh.points[:, 0]
    counted = newton.unstable_directions(body, u.ravel())
    assert (counted > 0) == (strain < -0.01)
    assert newton.unstable_directions(body, u.ravel(), inverse) == counted
    built = assembly.system(body).system
    built.reset_timings()
    newton.unstable_directions(body, u.ravel(), inverse)
    assert built.timings.krylov_iterations > 0
    assert (built.timings.factorisations > 0) == (counted > 0)


def test_a_factor_that_no_longer_serves_is_replaced():
    """Stiff and soft half change places, 1 : 1000: the kept factor misleads, the answer is LU's."""
    body = block(g=1.0, cells=4)
    low = np.flatnonzero(body.mesh.points[body.mesh.cells].mean(axis=1)[:, 2] < EDGE / 2)
    body.set(young=1e3).set(where=low, young=1e6)
    body.rest_shape()
    body.set(young=1e6).set(where=low, young=1e3)
    again = body.rest_shape()
    assert again.timings["factorisations"] >= 1
    direct = body.rest_shape(solver="direct")
    assert abs(again.points - direct.points).max() <= 1e-10 * EDGE


def test_a_load_without_a_rest_shape_fails_alike():
    """A cube drawn from all sides beyond its fold: same cause, same load reached."""
    mesh = supple.Mesh.box((2, 2, 2), (1.0,) * 3, "P1")
    errors = []
    for solver in ("gmres", "direct"):
        body = supple.Body(mesh, "neo_hookean", young=1e3, poisson=0.3)
        body.prescribe(np.arange(len(mesh.points)), np.where(mesh.points < 1e-9, 0.0, np.nan))
        for axis in range(3):
            body.pressure(lambda p, axis=axis: p[:, axis] > 1 - 1e-9, -1e4)
        with pytest.raises(supple.ConvergenceError, match="no rest shape") as caught:
            body.rest_shape(solver=solver)
        errors.append(caught.value)
    assert errors[0].cause == errors[1].cause
    assert errors[0].load_factor == pytest.approx(errors[1].load_factor, rel=1e-2)


def test_an_unknown_solver_is_named():
    with pytest.raises(supple.InputError, match="cholesky"):
        block().rest_shape(solver="cholesky")
