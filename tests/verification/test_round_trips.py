"""Direct and inverse are one set of equations read both ways: a round trip closes to rounding."""

from __future__ import annotations

import numpy as np
import pytest

import supple
from supple.kernels.cells import ELEMENTS

EDGE = 0.1


def loaded_block(element):
    """A soft cube held at its base: gravity and traction draw and bend it, skin on two sides."""
    mesh = supple.Mesh.box((2, 2, 2), (EDGE,) * 3, element)
    body = supple.Body(mesh, "neo_hookean", density=1000.0, young=1e3, poisson=0.45)

    def top(p):
        return p[:, 2] > EDGE - 1e-9

    def top_and_side(p):
        return top(p) | (abs(p[:, 0] - EDGE) < 1e-9)

    body.fix(lambda p: p[:, 2] < 1e-9).gravity((0.0, 0.0, 3.0)).traction(top, (30.0, 0.0, 200.0))
    return body.skin(top_and_side, "neo_hookean", thickness=2e-3, young=5e3)


def largest_strain(state):
    stretches = np.linalg.svd(state.deformation_gradient(), compute_uv=False)
    return abs(stretches - 1).max()


@pytest.mark.parametrize("element", ELEMENTS)
def test_rest_shape_of_a_solved_body_is_its_mesh(element):
    """rest_shape ∘ solve = identity to 1e-9 of the size, beyond 30 % strain."""
    body = loaded_block(element)
    state = body.solve()
    assert largest_strain(state) > 0.3
    rest = body.on(state.mesh.moved(state.points)).rest_shape()
    assert abs(rest.points - body.mesh.points).max() <= 1e-9 * body.mesh.size
    np.testing.assert_allclose(rest.cauchy(), state.cauchy(), rtol=0, atol=1e-6)


@pytest.mark.parametrize("element", ELEMENTS)
def test_solving_on_a_rest_shape_gives_the_mesh_back(element):
    """solve ∘ rest_shape = identity to 1e-9 of the size, beyond 30 % strain."""
    body = loaded_block(element)
    rest = body.rest_shape()
    state = rest.body().solve()
    assert largest_strain(state) > 0.3
    assert abs(state.points - body.mesh.points).max() <= 1e-9 * body.mesh.size


@pytest.mark.parametrize("load", ["pressure", "loaded traction"])
def test_other_loads_make_the_round_trip_too(load):
    """Follower pressure, and traction per loaded area."""
    mesh = supple.Mesh.box((2, 2, 2), (EDGE,) * 3, "Q1")
    body = supple.Body(mesh, "neo_hookean", density=1000.0, young=1e3, poisson=0.45)
    body.fix(lambda p: p[:, 2] < 1e-9).gravity((0.0, 2.0, 5.0))

    def top(p):
        return p[:, 2] > EDGE - 1e-9

    if load == "pressure":
        body.pressure(top, -150.0)
    else:
        body.traction(top, (50.0, 0.0, 100.0), per="loaded")
    rest = body.rest_shape()
    assert abs(rest.u).max() > 0.1 * EDGE
    again = rest.body().solve()
    assert abs(again.points - mesh.points).max() <= 1e-9 * mesh.size


@pytest.mark.parametrize("element", ELEMENTS)
def test_density_counts_in_the_state_that_is_asked_for(element):
    """The supports carry ρ V g: V of the rest shape found, or of the loaded shape given."""
    mesh = supple.Mesh.box((2, 2, 2), (EDGE,) * 3, element)
    body = supple.Body(mesh, "neo_hookean", density=1000.0, young=1e3, poisson=0.3)
    g = np.array([0.0, 1.2, 4.2])  # at more, the corners of the clamped side of Pr2 turn over
    body.fix(lambda p: p[:, 2] < 1e-9).gravity(g)
    for density_of in ("rest", "loaded"):
        rest = body.rest_shape(density_of=density_of)
        volume = {"rest": rest.mesh.volume, "loaded": mesh.volume}[density_of]
        held = rest.reactions.sum(axis=0)
        np.testing.assert_allclose(held, -1000.0 * volume * g, rtol=1e-9,
                                   atol=1e-9)  # fmt: skip
        assert abs(volume / EDGE**3 - 1) > 1e-3 or density_of == "loaded"


@pytest.mark.parametrize("element", ELEMENTS)
def test_density_of_the_loaded_shape_goes_back_with_it(element):
    """On the rest shape gravity pulls at the masses that the nodes had under load: exact again.

    A density per cell would be so with P1 alone, whose J is constant in a cell.
    """
    body = loaded_block(element)
    rest = body.rest_shape(density_of="loaded")
    assert abs(rest.volume_ratio("cells") - 1).max() > 0.05
    again = rest.body().solve()
    assert largest_strain(again) > 0.3
    assert abs(again.points - body.mesh.points).max() <= 1e-9 * body.mesh.size
    if element == "P1":
        same = supple.Body(rest.mesh, "neo_hookean", young=1e3, poisson=0.45,
                           density=1000.0 * rest.volume_ratio("cells"))  # fmt: skip
        same.fix(lambda p: p[:, 2] < 1e-9).gravity((0.0, 2.0, 1.0))
        masses = rest.body().clear_loads().gravity((0.0, 2.0, 1.0))
        masses._description.skins.clear()
        masses._restructured()
        assert abs(same.solve().u - masses.solve().u).max() <= 1e-9 * body.mesh.size


def test_masses_at_rest_weigh_the_same_in_every_pose():
    """ρ V_loaded g, whichever way gravity then points; and back from that pose again."""
    mesh = supple.Mesh.box((2, 2, 2), (EDGE,) * 3, "Q1")
    body = supple.Body(mesh, "neo_hookean", density=1000.0, young=2e3, poisson=0.3)
    body.fix(lambda p: p[:, 2] < 1e-9).gravity((0.0, 1.0, 4.0))
    rest = body.rest_shape(density_of="loaded")
    other = rest.body().gravity((3.0, 0.0, -4.0))
    state = other.solve()
    weight = 1000.0 * mesh.volume * np.array([3.0, 0.0, -4.0])
    np.testing.assert_allclose(state.reactions.sum(axis=0), -weight, rtol=1e-9, atol=1e-12)
    back = other.on(state.mesh.moved(state.points)).rest_shape()
    assert abs(back.points - rest.points).max() <= 1e-9 * mesh.size
    with pytest.raises(supple.InputError, match="masses of its nodes"):
        supple.sensitivity(other, state, "density")


def test_reversed_gravity_is_near_the_rest_shape_for_a_small_load():
    """It agrees at first order: ten times less gravity, a hundred times less difference."""
    differences = []
    for g in (0.5, 0.05):
        mesh = supple.Mesh.box((2, 2, 2), (EDGE,) * 3, "P1")
        body = supple.Body(mesh, "neo_hookean", density=1000.0, young=1e3, poisson=0.3)
        body.fix(lambda p: p[:, 2] < 1e-9).gravity((0.0, g, 0.0))
        exact, rough = body.rest_shape(), body.rest_shape(method="reversed-gravity")
        assert rough.method == "reversed-gravity"
        differences.append(abs(exact.points - rough.points).max())
    assert 80 < differences[0] / differences[1] < 120
