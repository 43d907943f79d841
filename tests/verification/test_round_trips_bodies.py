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


def bowl(sag):
    """A bowl over 0.4 m × 0.4 m of 6 × 6 × 2 triangles, ``sag`` (1/m) its curvature."""
    along = np.linspace(-0.2, 0.2, 7)
    x, y = (a.ravel() for a in np.meshgrid(along, along, indexing="ij"))
    n = np.arange(49).reshape(7, 7)
    a, b, c, d = (q.ravel() for q in (n[:-1, :-1], n[1:, :-1], n[1:, 1:], n[:-1, 1:]))
    triangles = np.vstack([np.column_stack([a, b, c]), np.column_stack([a, c, d])])
    height = sag * (x**2 + 0.6 * y**2) / 2
    return supple.Surface(np.column_stack([x, y, height]), triangles)


def height_over(surface, points):
    """z (n,) of the surface above or below each point, by Newton's method."""
    p = points.copy()
    for _ in range(50):
        at = surface.closest(p)
        p[:, 2] += ((at.point - p) * at.normal).sum(axis=1) / at.normal[:, 2]
    return p[:, 2]


def on_bowl(element, surface, compliance):
    """A block whose base follows the bowl, held at one side of it and sliding with the rest."""
    cells = (3, 3, 2) if element in ("P1", "Q1") else (2, 2, 1)
    mesh = supple.Mesh.box(cells, (0.1, 0.1, 0.06), element, origin=(-0.047, -0.041, 0.0))
    p = mesh.points.copy()
    base = p[:, 2] < 1e-9
    p[:, 2] += height_over(surface, p * [1, 1, 0]) * (1 - p[:, 2] / 0.06)
    body = supple.Body(mesh.moved(p), "neo_hookean", density=1000.0, young=8e3, poisson=0.3)
    body.slide(base, surface, compliance=compliance)
    return body.fix(p[:, 0] < -0.047 + 1e-9).gravity((1.0, 0.5, -3.0)), base


@pytest.mark.parametrize("sag", [0.0, 10 / 3])
@pytest.mark.parametrize(
    "element", ["P1", "Q1", *(pytest.param(e, marks=pytest.mark.slow) for e in ("P2", "Q2"))]
)
def test_sliding_round_trips_close_as_the_support_gets_rigid(element, sag):
    """On a plane and on a faceted bowl they miss by the depth at which the springs carry.

    Direct and inverse springs pull from the same surface, the one at the loaded point and the
    other at the rest point, so the miss is of the order of compliance × weight and falls with it.
    """
    surface, errors = bowl(sag), []
    for compliance in (1e-6, 1e-8):
        body, base = on_bowl(element, surface, compliance)
        assert abs(body.rest_shape().u[base, :2]).max() > 1e-3
        errors.append(np.array(misses(body)) * body.mesh.size)
        weight = 1000.0 * body.mesh.volume * np.linalg.norm([1.0, 0.5, -3.0])
        assert (errors[-1] < 10 * compliance * weight).all(), (errors, compliance * weight)
    np.testing.assert_allclose(errors[0] / errors[1], 100.0, rtol=0.05)
