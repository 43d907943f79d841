"""Solves that must fail: ConvergenceError with its cause, and a body that is as before."""

from __future__ import annotations

import numpy as np
import pytest

import supple
from supple.kernels.cells import ELEMENTS


def block(element="P1", young=1e3, poisson=0.45, cells=(2, 2, 4)):
    mesh = supple.Mesh.box(cells, (0.1, 0.1, 0.2), element)
    body = supple.Body(mesh, "neo_hookean", density=1000.0, young=young, poisson=poisson)
    return body.fix(lambda p: p[:, 2] < 1e-9)


def check(error, body):
    """Attributes that §8 promises."""
    assert error.cause
    assert error.cause in str(error)
    assert 0 <= error.load_factor <= 1
    assert {"load_factor", "iteration", "residual", "step"} <= set(error.history[0])
    assert all(np.isfinite(h["load_factor"]) for h in error.history)
    assert all(0 <= c < len(body.mesh.cells) for c in error.cells)


def suction(element, share):
    """A cube on rollers drawn out by a following suction, and the largest that it can carry, Pa.

    Neo-Hookean under equal stretches s: σ = (μ (s² - 1) + 3 λ ln s) / s³, which has a maximum.
    """
    young, poisson = 1e3, 0.3
    mu, lmbda = young / (2 + 2 * poisson), young * poisson / ((1 + poisson) * (1 - 2 * poisson))
    s = np.linspace(1, 5, 400001)
    largest = ((mu * (s**2 - 1) + 3 * lmbda * np.log(s)) / s**3).max()
    mesh = supple.Mesh.box((2, 2, 2), (1.0, 1.0, 1.0), element)
    body = supple.Body(mesh, "neo_hookean", young=young, poisson=poisson)
    body.prescribe(np.arange(len(mesh.points)), np.where(mesh.points < 1e-9, 0.0, np.nan))
    for axis in range(3):
        body.pressure(lambda p, axis=axis: p[:, axis] > 1 - 1e-9, -share * largest)
    return body


@pytest.mark.parametrize("inverse", [False, True])
@pytest.mark.parametrize("element", ELEMENTS)
def test_a_load_that_the_body_cannot_carry(element, inverse):
    """Twice the largest hydrostatic tension: neither shape exists, and half of it was reached."""
    body = suction(element, 2.0)
    with pytest.raises(supple.ConvergenceError) as caught:
        body.rest_shape() if inverse else body.solve()
    check(caught.value, body)
    assert 0.45 < caught.value.load_factor <= 0.5 + 1e-9
    assert ("no rest shape" in str(caught.value)) == inverse
    below = suction(element, 0.9)  # what the cube can carry is found
    found = below.rest_shape() if inverse else below.solve()
    F = found.deformation_gradient()
    np.testing.assert_allclose(F, np.broadcast_to(F[0, 0, 0] * np.eye(3), F.shape), atol=1e-9)


def test_a_failed_solve_leaves_the_body_as_it_was():
    """What it carried before gives the same state after failures; old states stay."""
    body = suction("Q1", 0.9)
    before = body.solve()
    kept, pressures = before.u.copy(), list(body._description.pressures)
    body.pressure(lambda p: p[:, 0] > 1 - 1e-9, -5e3)
    for start in (None, before):
        with pytest.raises(supple.ConvergenceError):
            body.solve(start=start)
    np.testing.assert_array_equal(before.u, kept)
    body.clear_loads()._description.pressures.extend(pressures)
    np.testing.assert_array_equal(body.solve().u, kept)


@pytest.mark.parametrize("element", ["Q1", "Q2"])
def test_a_rest_shape_that_is_inside_out_at_corners_is_refused(element):
    """A 2 kPa weight hangs on 50 Pa: what the quadrature points allow, the corners do not."""
    body = block(element, young=50.0).gravity((0.0, 0.0, 9.81))
    with pytest.raises(supple.ConvergenceError, match="no rest shape") as caught:
        body.rest_shape()
    check(caught.value, body)


def test_worst_cells_are_numbered_as_in_the_mesh():
    """The last layer, of another law, is turned inside out half way: the cells named are of it."""
    body = block("Q1")
    last = np.arange(12, 16)  # between z = 0.15 and z = 0.2
    body.region(last, "corotational_polar").prescribe(lambda p: p[:, 2] > 0.149, (0.0, 0.0, 0.0))
    body.prescribe(lambda p: p[:, 2] > 0.199, (0.0, 0.0, -0.1))
    with pytest.raises(supple.ConvergenceError) as caught:
        body.solve()
    check(caught.value, body)
    assert caught.value.cells[0] in last
    assert 0.45 < caught.value.load_factor <= 0.5


def test_euler_column_that_buckles_is_unstable():
    """Four times Euler's load on a slender clamped column: straight is no stable equilibrium."""
    mesh = supple.Mesh.box((2, 2, 10), (0.01, 0.01, 0.2), "Q2")
    body = supple.Body(mesh, "neo_hookean", young=1e6, poisson=0.0)
    euler = np.pi**2 * 1e6 * (0.01**4 / 12) / (2 * 0.2) ** 2

    def top(p):
        return p[:, 2] > 0.2 - 1e-9

    body.fix(lambda p: p[:, 2] < 1e-9)
    for share in (0.9, 4.0):
        body.clear_loads().traction(top, (0.0, 0.0, -share * euler / 1e-4))
        if share < 1:
            assert abs(body.solve().u[:, :2]).max() < 1e-9
            continue
        with pytest.raises(supple.ConvergenceError) as caught:
            body.solve(load_steps=1)
        check(caught.value, body)


def test_progress_sees_every_iteration_and_can_stop_a_solve():
    """What it raises comes out; the body solves again afterwards."""
    body = block().gravity((0.0, 0.0, -1.0))
    seen = []
    state = body.solve(progress=seen.append)
    assert seen == state.history
    assert state.iterations == sum(1 for h in seen if h["iteration"] > 0)

    class Enough(Exception):
        pass

    def stop(_):
        raise Enough

    with pytest.raises(Enough):
        body.solve(progress=stop)
    np.testing.assert_array_equal(body.solve().u, state.u)


def test_newton_converges_quadratically():
    """Residuals of a smooth problem: the exponent of the last steps is near 2."""
    history = block("Q1").gravity((0.0, 0.3, -0.5)).solve(load_steps=1).history
    r = [h["residual"] for h in history if h["residual"] > 1e-11 * history[0]["residual"]]
    exponents = [np.log(r[i + 1] / r[i]) / np.log(r[i] / r[i - 1]) for i in range(1, len(r) - 1)]
    assert max(exponents) > 1.7, r


@pytest.mark.parametrize("element", ["P2", "Q1"])
def test_threads_do_not_change_a_result(element):
    """One and two threads: displacements equal to 1e-12 of the size, forces and energy too."""
    from supple.core import core

    before = core().threads()
    results = []
    try:
        for threads in (1, 2):
            core().set_threads(threads)
            assert core().threads() == threads
            body = block(element, cells=(3, 3, 6)).gravity((0.0, 0.5, -1.0))
            body.skin(lambda p: p[:, 0] < 1e-9, "neo_hookean", thickness=1e-3)
            results.append((body.solve(), supple.assemble(body, 0.1 * body.mesh.points**2)))
    finally:
        core().set_threads(before)
    (one, (e1, r1, k1)), (two, (e2, r2, k2)) = results
    assert abs(one.u - two.u).max() <= 1e-12 * one.mesh.size
    assert e1 == pytest.approx(e2, rel=1e-12)
    assert abs(r1 - r2).max() <= 1e-12 * abs(r1).max()
    assert abs(k1 - k2).max() <= 1e-12 * abs(k1).max()


def test_reversed_loads_that_buckle_a_body_say_nothing_of_its_rest_shape():
    """A column that hangs has a rest shape; stood on its head by the shortcut it gives way."""
    body = block("P2", young=2.5e3, cells=(1, 1, 4)).gravity((0.0, 0.0, 9.81))
    assert body.rest_shape().points[:, 2].max() < 0.2
    with pytest.raises(supple.ConvergenceError) as caught:
        body.rest_shape(method="reversed-gravity")
    assert "no equilibrium under reversed loads" in str(caught.value)
    assert "no rest shape" not in str(caught.value)
