"""Curved cells, several laws, skins, follower loads and sliding supports go there and back."""

from __future__ import annotations

import numpy as np
import pytest

import supple

pytestmark = pytest.mark.usefixtures("quick_compiler")
CURVED = ["P2", *(pytest.param(e, marks=pytest.mark.slow) for e in ("Q2", "Q2L", "Pr2"))]


def largest_strain(found):
    stretches = np.linalg.svd(found.deformation_gradient(), compute_uv=False)
    return abs(stretches - 1).max()


def misses(body):
    """Of both round trips, their largest distance from the identity as a share of the size."""
    mesh, state = body.mesh, body.solve()
    rest = body.on(mesh.moved(state.points)).rest_shape()
    again = body.rest_shape().body().solve()
    return [abs(end.points - mesh.points).max() / mesh.size for end in (rest, again)]


@pytest.mark.parametrize("element", CURVED)
def test_curved_cells_of_two_laws_under_every_load_at_once(element, distorted):
    """Bent edges and faces, with skin on some; weight, dead forces, a pressure that follows.

    One traction counts per rest area, another per loaded area.
    """
    mesh = distorted(element, (1, 1, 2))
    x, y, z = mesh.points.T
    body = supple.Body(mesh, "neo_hookean", density=100.0, young=1e3, poisson=0.4)
    high = mesh.points[mesh.cells].mean(axis=1)[:, 2] > 0.5
    body.region(high, "corotational_polar", young=700.0, poisson=0.3)
    body.fix(z < 0.05).gravity((0.2, 0.1, 0.5)).pressure(x > 0.85, 30.0)
    body.traction(z > 0.85, (40.0, 0.0, 150.0)).traction(z > 0.85, (0.0, 20.0, 60.0), per="loaded")
    body.force(np.flatnonzero(z > 0.85)[:1], (0.2, 0.0, 0.3))
    body.skin(y < 0.15, "neo_hookean", thickness=5e-3, young=1e4)
    assert largest_strain(body.solve()) > 0.3
    assert max(misses(body)) <= 1e-9
