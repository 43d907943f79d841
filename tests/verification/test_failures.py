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
    assert error.cause in str(error)
    assert error.cause
    assert 0 <= error.load_factor < 1
    assert len(error.history) >= 1
    assert {"load_factor", "iteration", "residual", "step"} <= set(error.history[0])
    assert all(np.isfinite(h["load_factor"]) for h in error.history)
    assert len(error.cells) >= 1
    assert all(0 <= c < len(body.mesh.cells) for c in error.cells)


@pytest.mark.parametrize("element", ELEMENTS)
def test_a_load_that_the_body_cannot_carry(element):
    """A dead traction of a hundred moduli downwards: no equilibrium, and the cause is named."""
    body = block(element).traction(lambda p: p[:, 2] > 0.2 - 1e-9, (0.0, 0.0, -1e5))
    with pytest.raises(supple.ConvergenceError) as caught:
        body.solve()
    check(caught.value, body)


def test_a_failed_solve_leaves_the_body_as_it_was():
    """The same load as before gives the same state, to the last bit, after a failure."""
    body = block().gravity((0.0, 0.0, -1.0))
    before = body.solve()
    body.traction(lambda p: p[:, 2] > 0.2 - 1e-9, (0.0, 0.0, -1e5))
    for start in (None, before):
        with pytest.raises(supple.ConvergenceError):
            body.solve(start=start)
    kept = before.u.copy()
    body.clear_loads().gravity((0.0, 0.0, -1.0))
    np.testing.assert_array_equal(body.solve().u, before.u)
    np.testing.assert_array_equal(before.u, kept)


@pytest.mark.parametrize("element", ELEMENTS)
def test_a_far_too_soft_body_has_no_rest_shape(element):
    """2 kPa of its own weight hang on 50 Pa: without that weight there is no shape to go back to."""
    body = block(element, young=50.0).gravity((0.0, 0.0, 9.81))
    with pytest.raises(supple.ConvergenceError, match="no rest shape") as caught:
        body.rest_shape()
    check(caught.value, body)


def test_worst_cells_are_numbered_as_in_the_mesh():
    """A soft region of the last cells collapses: the cells named are of it."""
    body = block()
    soft = np.arange(len(body.mesh.cells) - 24, len(body.mesh.cells))
    body.region(soft, "neo_hookean", young=1.0, poisson=0.45)
    body.traction(lambda p: p[:, 2] > 0.2 - 1e-9, (0.0, 0.0, -300.0))
    with pytest.raises(supple.ConvergenceError) as caught:
        body.solve()
    assert caught.value.cells[0] in soft


def test_euler_column_that_buckles_is_unstable():
    """Four times Euler's load on a slender clamped column: straight is no stable equilibrium."""
    mesh = supple.Mesh.box((2, 2, 10), (0.01, 0.01, 0.2), "Q2")
    body = supple.Body(mesh, "neo_hookean", young=1e6, poisson=0.0)
    euler = np.pi**2 * 1e6 * (0.01**4 / 12) / (2 * 0.2) ** 2
    top = lambda p: p[:, 2] > 0.2 - 1e-9  # noqa: E731
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
    history = block("Q1").gravity((0.0, 1.0, -2.0)).solve(load_steps=1).history
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
