"""States: strains, stresses, what is written to a file and what later changes do not touch."""

from __future__ import annotations

import numpy as np
import pytest

import supple

MESH = supple.Mesh.box((2, 1, 1), (2.0, 1.0, 1.0), "P2")
A = np.array([[0.2, 0.1, 0.0], [0.0, -0.1, 0.0], [0.0, 0.05, 0.1]])
F = np.eye(3) + A


@pytest.fixture(scope="module")
def state():
    everywhere = np.arange(len(MESH.points))
    return supple.Body(MESH, "neo_hookean").prescribe(everywhere, MESH.points @ A.T).solve()


def test_strains_of_a_linear_field(state):
    """F = I + A, E = (FᵀF - I)/2, J = det F at each cell and each of its four points."""
    np.testing.assert_allclose(state.deformation_gradient(), np.tile(F, (12, 1, 1)), atol=1e-13)
    E = (F.T @ F - np.eye(3)) / 2
    found = state.green_lagrange(at="quadrature")
    assert found.shape == (12, 4, 3, 3)
    np.testing.assert_allclose(found, np.broadcast_to(E, found.shape), atol=1e-13)
    np.testing.assert_allclose(state.volume_ratio(), np.linalg.det(F), rtol=1e-12)
    with pytest.raises(supple.InputError, match='at must be "cells", "quadrature" or "nodes"'):
        state.cauchy(at="corners")


def test_energy_is_that_of_assemble(state):
    """Stored energy of the field, J; iterations and seconds are counted."""
    body = supple.Body(MESH, "neo_hookean")
    assert state.energy == pytest.approx(supple.assemble(body, state.u)[0], rel=1e-12)
    assert state.iterations == sum(1 for h in state.history if h["iteration"] > 0)
    seconds, counts = (
        ("analysis", "residual", "assembly", "factor", "solve", "total"),
        ("factorisations", "krylov_iterations"),
    )
    assert set(state.timings) == {*seconds, *counts, "solver"}
    assert all(0 <= state.timings[name] < 60 for name in (*seconds, *counts))
    assert state.timings["solver"].startswith("direct: a factor of ")
    assert state.timings["total"] >= state.timings["assembly"] > 0


def test_written_file_names_fields_units_and_frame(state, tmp_path):
    """Displacement, J, von Mises; LPS and metres; positions less displacement are those before."""
    import meshio

    path = state.write(tmp_path / "out.vtu", {"tissue": np.arange(12)})
    file = meshio.read(path)
    np.testing.assert_allclose(file.points - file.point_data["displacement [m]"], MESH.points,
                               atol=1e-14)  # fmt: skip
    np.testing.assert_allclose(np.hstack(file.cell_data["J [1]"]), np.linalg.det(F))
    np.testing.assert_allclose(
        np.hstack(file.cell_data["von Mises stress [Pa]"]), state.von_mises(), rtol=1e-12
    )
    np.testing.assert_array_equal(np.hstack(file.cell_data["tissue"]), np.arange(12))
    text = path.read_bytes()
    assert b"LPS" in text
    assert b"metre" in text or b"unit" in text
    assert supple.Mesh.read(path).volume == pytest.approx(np.linalg.det(F) * 2.0)


def test_a_state_keeps_the_parameters_that_it_was_solved_with():
    """Stress asked for after the body has changed is that of the solve."""
    everywhere = np.arange(len(MESH.points))
    body = supple.Body(MESH, "neo_hookean", young=1e3).prescribe(everywhere, MESH.points @ A.T)
    early, late = body.solve(), body.solve()
    expected = early.cauchy()
    body.set(young=5e3).region([0], "corotational_polar").gravity((1.0, 0, 0))
    np.testing.assert_array_equal(late.cauchy(), expected)


def test_stresses_of_two_laws_stand_at_their_cells():
    """A soft and a stiff half under one field: stress goes with the modulus, cell by cell."""
    everywhere = np.arange(len(MESH.points))
    body = supple.Body(MESH, "neo_hookean", young=1e3)
    stiff = np.array([1, 4, 7])
    body.region(stiff, "neo_hookean", young=3e3)
    sigma = body.prescribe(everywhere, MESH.points @ A.T).solve().cauchy()
    ratio = (
        sigma
        / supple.Body(MESH, "neo_hookean", young=1e3)
        .prescribe(everywhere, MESH.points @ A.T)
        .solve()
        .cauchy()
    )
    expected = np.where(np.isin(np.arange(12), stiff), 3.0, 1.0)[:, None, None]
    np.testing.assert_allclose(ratio[:, [0, 1, 2], [0, 1, 2]], expected[:, 0] * np.ones(3))


def test_rest_shape_knows_where_it_came_from():
    """loaded is the mesh given, mesh the rest shape with the same cells and tags."""
    mesh = supple.Mesh.box((2, 2, 2), (0.1, 0.1, 0.1), "P1")
    body = supple.Body(mesh, "neo_hookean", density=1000.0).fix(lambda p: p[:, 0] == 0)
    rest = body.gravity((0, 0, -5.0)).rest_shape()
    assert rest.loaded is mesh
    assert rest.method == "inverse"
    np.testing.assert_array_equal(rest.mesh.points, mesh.points + rest.u)
    np.testing.assert_array_equal(rest.mesh.cells, mesh.cells)
    J = np.linalg.det(rest.deformation_gradient())
    corners = [m.points[m.cells] for m in (mesh, rest.mesh)]
    now, then = (np.linalg.det(c[:, 1:] - c[:, :1]) for c in corners)
    np.testing.assert_allclose(J, now / then, rtol=1e-10)
