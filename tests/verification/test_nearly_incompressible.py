"""Newton on nearly incompressible bodies: bulk moduli a million times μ, soft bodies, buckling."""

from __future__ import annotations

import numpy as np
import pytest

import supple

FORMS = {"mixed": "P2", "mean-dilatation": "Q1"}


def hanging(formulation, g, bulk=1e9, n=4):
    """A cube of 0.1 m with E = 3 kPa held at z = 0; ``bulk`` Pa, or (lower, upper half)."""
    mesh = supple.Mesh.box((n, n, n), (0.1, 0.1, 0.1), FORMS[formulation])
    low, high = np.broadcast_to(bulk, 2)
    body = supple.Body(mesh, "mooney_rivlin", formulation, 1000.0, c1=500.0, c2=0.0, bulk=low)
    upper = mesh.points[mesh.cells].mean(axis=1)[:, 2] > 0.05
    body.set(where=upper, bulk=high)
    return body.fix(lambda p: p[:, 2] < 1e-9).gravity(g)


@pytest.mark.parametrize("inverse", [False, True])
@pytest.mark.parametrize("g", [-9.81, 9.81])
def test_a_soft_block_hangs_and_stands_the_same_in_both_formulations(g, inverse):
    """ν = 0.4999995: end displacements agree to 5 %, and the mixed form needs few iterations."""
    found = {}
    for formulation in FORMS:
        body = hanging(formulation, (0.0, 0.0, g))
        found[formulation] = body.rest_shape() if inverse else body.solve()
    ends = [abs(state.u[:, 2]).max() for state in found.values()]
    assert ends[0] > 0.008
    assert ends[0] == pytest.approx(ends[1], rel=0.05)
    assert found["mixed"].iterations <= 8


def test_incompressible_beside_compressible():
    """Bulk 1e9 Pa below, 1e3 Pa above, sideways gravity of half the earth's."""
    states = {f: hanging(f, (0.0, 5.0, 0.0), (1e9, 1e3)).solve() for f in FORMS}
    most = [abs(state.u).max() for state in states.values()]
    assert most[0] > 0.04
    assert most[0] == pytest.approx(most[1], rel=0.05)
    assert states["mixed"].iterations <= 10


@pytest.mark.parametrize("element", ["P2", pytest.param("Q2L", marks=pytest.mark.slow)])
def test_a_mixed_column_buckles_at_eulers_load(element):
    """Clamped and free, bulk 1e8 Pa: below its load straight, above it reported unstable.

    Only the count of negative eigenvalues beyond one a pressure can tell: the forces balance.
    """
    mesh = supple.Mesh.box((1, 1, 8), (0.01, 0.01, 0.2), element)
    body = supple.Body(mesh, "mooney_rivlin", "mixed", c1=400.0, c2=100.0, bulk=1e8)
    body.fix(lambda p: p[:, 2] < 1e-9)
    euler = np.pi**2 * 3000.0 * (0.01**4 / 12) / (2 * 0.2) ** 2
    for share in (0.9, 1.2, 4.0):
        body.clear_loads()
        body.traction(lambda p: p[:, 2] > 0.2 - 1e-9, (0.0, 0.0, -share * euler / 1e-4))
        if share < 1:
            assert abs(body.solve(load_steps=1).u[:, :2]).max() < 2e-4
            continue
        with pytest.raises(supple.ConvergenceError, match="unstable equilibrium") as caught:
            body.solve(load_steps=1)
        assert caught.value.cause.startswith("unstable")


def test_an_impossible_load_is_refused_and_the_body_stays_as_it_was():
    """A follower suction far beyond what rubber carries, then the old load again."""
    body = hanging("mixed", (0.0, 0.0, -9.81), 1e6, n=2)
    before = body.solve()
    body.pressure(lambda p: p[:, 0] > 0.1 - 1e-9, -1e5)
    with pytest.raises(supple.ConvergenceError) as caught:
        body.solve()
    assert 0 <= caught.value.load_factor < 1
    assert caught.value.cause
    again = body.clear_loads().gravity((0.0, 0.0, -9.81)).solve()
    np.testing.assert_array_equal(again.u, before.u)
    np.testing.assert_array_equal(again.pressure, before.pressure)


@pytest.mark.parametrize("poisson", [0.3, 0.4995, 0.4999, 0.49999])
@pytest.mark.parametrize("density", [3.0, 30.0])
def test_a_light_load_on_a_body_that_hardly_shrinks_is_carried(poisson, density):
    """Forces below the rounding of the bulk stiffness count as none: the load's own is above it."""
    mesh = supple.Mesh.box((4, 4, 4), (0.1, 0.1, 0.1), "P1")
    body = supple.Body(mesh, "neo_hookean", young=1e4, poisson=poisson, density=density)
    body.fix(lambda p: p[:, 0] < 1e-9).gravity((0.0, 0.0, -9.81))
    state = body.solve()
    assert state.iterations < 10
    weight = density * 0.1**3 * 9.81
    assert state.reactions[:, 2].sum() == pytest.approx(weight, rel=1e-5)
