"""Sliding supports: distance energy over faces, edges and vertices; blocks that slide to rest."""

from __future__ import annotations

import numpy as np
import pytest

import supple
from supple.core import core
from supple.supports import node_shares

#: A tent: two rectangles that meet in the ridge x = 0, z = 0, open below.
TENT = supple.Surface(
    [[0, -1, 0], [0, 1, 0], [1, -1, -1], [1, 1, -1], [-1, -1, -1], [-1, 1, -1]],
    [[0, 2, 3], [0, 3, 1], [0, 1, 5], [0, 5, 4]],
)
NORMAL = np.array([1.0, 0.0, 1.0]) / np.sqrt(2)
#: Where a node lies → where it lands, and what of its displacement costs energy.
PLACES = {
    "face": ([0.5, 0.1, 0.1], [0.2, 0.1, -0.2], np.outer(NORMAL, NORMAL)),
    "edge": ([0.05, 0.1, 0.3], [0, 0.1, 0], np.diag([1.0, 0, 1])),
    "vertex": ([0.02, 1.4, 0.3], [0, 1, 0], np.eye(3)),
}


def springs(places, inverse=False, stiffness=3.0):
    """A system of nothing but nodes held to the tent."""
    system = core().System(np.ascontiguousarray(places, dtype=float).ravel(), [])
    nodes = list(range(len(places)))
    system.add(
        core().Sliding(
            system,
            nodes,
            np.full(len(nodes), stiffness),
            TENT.points,
            TENT.triangles.astype(np.int32),
            inverse,
        )
    )
    return system


def dense(system, u):
    from scipy.sparse import csr_array

    return csr_array(system.tangent(u), shape=(u.size, u.size)).toarray()


@pytest.mark.parametrize("place", PLACES)
def test_spring_pulls_to_the_closest_point(place):
    """Energy k d²/2, force k d, and stiffness only across the feature that holds the point."""
    at, lands, projector = PLACES[place]
    system, u = springs([at]), np.zeros(3)
    gap = np.subtract(at, lands)
    assert system.energy(u, 1.0) == pytest.approx(1.5 * gap @ gap, rel=1e-12)
    np.testing.assert_allclose(system.residual(u, 1.0), 3 * gap, atol=1e-14)
    np.testing.assert_allclose(dense(system, u), 3 * projector, atol=1e-14)


@pytest.mark.parametrize("place", PLACES)
def test_force_and_stiffness_are_the_derivatives_of_the_energy(place):
    """The energy is quadratic near each place, so central differences are exact to rounding."""
    system, u = springs([PLACES[place][0]]), np.zeros(3)
    for d in 1e-3 * np.eye(3):
        slope = (system.energy(u + d, 1.0) - system.energy(u - d, 1.0)) / 2
        assert slope == pytest.approx(system.residual(u, 1.0) @ d, abs=1e-15)
        change = (system.residual(u + d, 1.0) - system.residual(u - d, 1.0)) / 2
        np.testing.assert_allclose(change, dense(system, u) @ d, atol=1e-15)


def test_inverse_reaction_is_along_the_normal_of_the_loaded_point():
    """Size by the rest point's distance, direction by the loaded one's; tangent k n ⊗ n(X)."""
    loaded = np.array([0.5, 0.1, -0.5])  # on the right face
    system, u = springs([loaded], inverse=True), np.array([0.02, 0.05, 0.03])
    gap = NORMAL @ (loaded + u - [0.5, 0.1, -0.5])
    np.testing.assert_allclose(system.residual(u, 1.0), 3 * gap * NORMAL, atol=1e-14)
    np.testing.assert_allclose(dense(system, u), 3 * np.outer(NORMAL, NORMAL), atol=1e-14)


ANGLE = np.radians(20.0)
TURN = np.array([[np.cos(ANGLE), 0, -np.sin(ANGLE)], [0, 1, 0], [np.sin(ANGLE), 0, np.cos(ANGLE)]])
PLANE = supple.Surface(
    np.array([[-5, -5, 0], [5, -5, 0], [5, 5, 0], [-5, 5, 0.0]]) @ TURN.T, [[0, 1, 2], [0, 2, 3]]
)
RHO, SIZE = 1000.0, np.array([0.2, 0.1, 0.1])


def on_slope(element, compliance):
    """A block on the inclined plane, stopped by a held line at its lower end; its rest nodes."""
    flat = supple.Mesh.box((4, 2, 2), SIZE, element)
    local = flat.points
    mesh = flat.moved(local @ TURN.T)
    body = supple.Body(mesh, "neo_hookean", density=RHO, young=5e4, poisson=0.3)
    along = TURN[:, 0]
    base = np.flatnonzero(local[:, 2] < 1e-9)
    body.slide(base, PLANE, compliance=compliance).gravity((0.0, 0.0, -9.81))
    return body, local, base, along


@pytest.mark.parametrize("element", ["P1", "Q1", "P2", "Q2"])
def test_block_slides_down_to_its_stop(element):
    """The stop carries m g sin α, the plane m g cos α along its normal, and nothing sticks."""
    compliance = 1e-6
    body, local, base, along = on_slope(element, compliance)
    normal, weight = TURN[:, 2], RHO * SIZE.prod() * 9.81
    state = body.fix(np.flatnonzero(local[:, 0] < 1e-9)).solve()
    stop = state.reactions.sum(axis=0)
    assert stop @ along == pytest.approx(weight * np.sin(ANGLE), rel=1e-9)
    gap = state.points[base] @ normal
    plane = -(node_shares(body.mesh, base) / compliance * gap).sum()
    held = (
        state.reactions[base].sum(axis=0) @ normal
    )  # the stop's line on the plane has springs too
    held += (state.reactions.sum(axis=0) - state.reactions[base].sum(axis=0)) @ normal
    assert plane + held == pytest.approx(weight * np.cos(ANGLE), rel=1e-9)
    slid = (state.points - body.mesh.points)[base] @ along
    assert slid.min() < -1e-5  # the base moves along the plane
    assert abs(gap).max() < 1e-4


@pytest.mark.parametrize("compliance", [1e-8, 1e-9, 1e-10])
def test_a_stiffer_plane_holds_the_same_block(compliance):
    """The answer is that of a rigid plane up to compliance · weight; rounding does not stop it."""
    body, local, base, _ = on_slope("Q1", compliance)
    state = body.fix(np.flatnonzero(local[:, 0] < 1e-9)).solve()
    assert abs(state.points[base] @ TURN[:, 2]).max() < 1e3 * compliance


def test_body_that_nothing_stops_from_sliding_is_refused():
    """On a plane without a stop a shift along it is free; the sentence says so."""
    body, *_ = on_slope("P1", 1e-9)
    with pytest.raises(supple.InputError, match="nothing resists a"):
        body.solve()


@pytest.mark.parametrize("element", ["P1", "Q1"])
def test_rest_shape_on_a_slide_goes_back_to_itself(element):
    """Direct after inverse on the inclined plane gives the loaded mesh back, near the plane."""
    body, local, base, _ = on_slope(element, 1e-6)
    body.fix(np.flatnonzero(local[:, 0] < 1e-9))
    rest = body.rest_shape()
    assert abs(rest.u).max() > 1e-6
    assert abs(rest.mesh.points[base] @ TURN[:, 2]).max() < 1e-4
    state = body.on(rest.mesh).solve()
    assert abs(state.points - body.mesh.points).max() < 1e-4 * body.mesh.size
