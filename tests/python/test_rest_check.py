"""What a rest shape is worth: what it carries when loaded, and what loading it again gives."""

from __future__ import annotations

import numpy as np
import pytest

import supple


def cantilever(young, element="P1", cells=(10, 2, 2)):
    """A bar of 60 × 12 × 12 mm that is level under its own weight."""
    mesh = supple.Mesh.box(cells, (0.06, 0.012, 0.012), element)
    body = supple.Body(mesh, "neo_hookean", density=1000.0, young=young, poisson=0.3)
    return body.fix(lambda x: x[:, 0] == 0.0).gravity((0.0, 0.0, -9.81))


def forces(body, rest):
    """Largest free residual (N) and smallest eigenvalue of the free tangent at the given shape."""
    again = body.on(rest.mesh)
    _, residual, tangent = supple.assemble(again, -rest.u)
    free = np.repeat(body.mesh.points[:, 0] > 0.0, 3)
    values = np.linalg.eigvalsh(tangent.toarray()[np.ix_(free, free)])
    return np.abs(residual.ravel()[free]).max(), values.min()


@pytest.mark.parametrize(
    ("young", "given"),
    [(2e4, "reached"), (8e3, "another equilibrium")],
)
def test_what_the_given_shape_is_to_its_rest_shape(young, given):
    """By residual and tangent at the given shape."""
    body = cantilever(young)
    rest = body.rest_shape()
    found = supple.round_trip(rest)
    assert found.given == given
    residual, least = forces(body, rest)
    assert residual < 1e-10 * 1000 * 9.81 * 0.06 * 0.012**2  # of the weight, as the solver's rtol
    assert least > 0
    missed = np.linalg.norm(found.state.points - body.mesh.points, axis=1).max()
    assert found.distance == missed
    assert found.relative == missed / 0.06
    assert (found.relative < 1e-9) == (given == "reached")
    assert found.seconds > 0
    near = supple.round_trip(rest, near=True)
    assert near.given == "reached"
    assert near.relative < 1e-9


def test_a_failure_is_told_once():
    """The message has its prefix once, and no method is advised that has just failed."""
    body = cantilever(6e3)
    for method in ("inverse", "sellier", "sellier-anderson"):
        options = {} if method == "inverse" else {"max_solves": 2}
        with pytest.raises(supple.ConvergenceError) as caught:
            body.rest_shape(method=method, **options)
        told = str(caught.value)
        assert told.count("no rest shape") == 1
        assert caught.value.cause in told
        assert f'"{method}"' not in told


def test_a_rest_shape_on_which_the_given_one_would_buckle_is_refused():
    """The softest bar curls up by more than a turn; its tangent, held level, is indefinite."""
    body = cantilever(6e3)
    with pytest.raises(supple.ConvergenceError, match="no rest shape"):
        body.rest_shape()


def test_an_approximate_rest_shape_has_the_given_one_for_no_equilibrium():
    body = cantilever(3e4)
    rest = body.rest_shape(method="reversed-gravity")
    for near in (False, True):
        assert supple.round_trip(rest, near).given == "no equilibrium"
    assert forces(body, rest)[0] > 1e-6


def test_a_rest_shape_that_leads_nowhere_raises():
    """One iteration does not do: the solve's own error, with its cause."""
    body = cantilever(2e4)
    rest = body.rest_shape()
    with pytest.raises(supple.ConvergenceError, match="no equilibrium: "):
        supple.round_trip(rest, load_steps=1, max_iterations=1)


@pytest.mark.parametrize("element", ["P1", "P2", "Q1"])
def test_weight_of_the_loaded_state_goes_round(element):
    """ρ of the loaded shape: its whole weight hangs on the supports, and the trip closes."""
    body = cantilever(4e4, element, (5, 2, 2))
    rest = body.rest_shape(density_of="loaded")
    found = supple.round_trip(rest)
    assert found.relative < 1e-9
    weight = 1000 * 9.81 * 0.06 * 0.012**2
    assert found.state.reactions[:, 2].sum() == pytest.approx(weight, rel=1e-9)
    again = body.on(rest.mesh).solve()  # as if ρ counted at rest
    assert abs(again.points - body.mesh.points).max() > 1e-5 * body.mesh.size


@pytest.mark.parametrize("at", ["cells", "quadrature", "nodes"])
def test_prestress_of_a_known_field(at):
    """x = (I + A) X everywhere: F = I + A, J its determinant, σ of the closed form."""
    loaded = supple.Mesh.box((2, 1, 1), (2.0, 1.0, 1.0), "P2")
    F = np.array([[1.2, 0.1, 0.0], [0.0, 0.9, 0.0], [0.0, 0.05, 1.1]])
    rest_points = loaded.points @ np.linalg.inv(F).T
    body = supple.Body(loaded, "neo_hookean", young=1e3, poisson=0.25)
    body.prescribe(np.arange(len(loaded.points)), loaded.points - rest_points)
    found = body.rest_shape().prestress(at)
    J, mu, lmbda = np.linalg.det(F), 400.0, 400.0
    sigma = (mu * (F @ F.T - np.eye(3)) + lmbda * np.log(J) * np.eye(3)) / J
    shape = {"cells": (12,), "quadrature": (12, 4), "nodes": (len(loaded.points),)}[at]
    assert found.J.shape == shape
    np.testing.assert_allclose(found.F, np.broadcast_to(F, (*shape, 3, 3)), atol=1e-11)
    np.testing.assert_allclose(found.J, J, rtol=1e-11)
    np.testing.assert_allclose(found.cauchy, np.broadcast_to(sigma, (*shape, 3, 3)), atol=1e-7)
    assert (found.places is None) == (at != "quadrature")
    if found.places is not None:
        assert found.places.shape == (4, 3)


def test_the_loaded_shape_of_a_mixed_body_is_written_with_its_pressure(tmp_path):
    """A third of the trace of σ is p, ψ_dev having none: on stiff, straight cells its mean."""
    import meshio

    mesh = supple.Mesh.box((3, 1, 1), (0.03, 0.01, 0.01), "P2")
    body = supple.Body(mesh, "neo_hookean_isochoric", "mixed", 1000.0, mu=2e6, bulk=1e8)
    rest = body.fix(lambda x: x[:, 0] == 0.0).gravity((0.0, 0.0, -9.81)).rest_shape()
    file = meshio.read(rest.write_loaded(tmp_path / "loaded.vtu"))
    sigma = file.cell_data["Cauchy stress [Pa]"][0].reshape(-1, 3, 3)
    p = file.point_data["pressure [Pa]"][file.cells[0].data[:, :4]].mean(axis=1)
    trace = np.trace(sigma, axis1=1, axis2=2) / 3
    np.testing.assert_allclose(trace, p, atol=1e-3 * np.abs(p).max())
