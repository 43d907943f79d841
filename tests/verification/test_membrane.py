"""Skin: energy, force and tangent taut, wrinkled and slack; closed forms of rubber sheets."""

from __future__ import annotations

import numpy as np
import pytest

import supple
from supple import assembly
from supple.kernels.cells import ELEMENTS, FACETS

YOUNG, THICKNESS = 6e3, 2e-3
MU = YOUNG / 3  # incompressible
#: In-plane stretches of the sheet z = 1 in each regime: along x, along y.
STATES = {"taut": (1.25, 1.15), "wrinkled": (1.3, 0.7), "slack": (0.8, 0.75)}
#: Share of the unrelaxed energy that a slack skin keeps (DESIGN §4).
RESIDUAL = 1e-3
#: Laws whose skins every test run compiles.
QUICK = ("neo_hookean", "saint_venant_kirchhoff", "mooney_rivlin", "corotational_polar",
         "corotational_qr", "fung_skin", "hencky")  # fmt: skip


def units(*forms):
    chosen = []
    for law in ("neo_hookean", "mooney_rivlin", "fung_skin", "ogden"):
        marks = () if law == "neo_hookean" else (pytest.mark.slow,)
        chosen += [pytest.param(f"{law}.{f}.{g}", marks=marks) for f in FACETS for g in forms]
    return chosen


def with_skin(mesh, law="neo_hookean", young=YOUNG, where=None):
    """A body whose volume is soft beside its skin on ``where``; all of the boundary by default."""
    body = supple.Body(mesh, "neo_hookean", young=1e-3, poisson=0.3)
    given = {"young": young} if law == "neo_hookean" else {}
    return body.skin(where or (lambda p: p[:, 0] > -9), law, thickness=THICKNESS, **given)


def mesh_of(unit, distorted):
    facets = (unit.split(".")[1],)
    element = next(e for e in ELEMENTS.values() if e.facet_elements == facets)
    return distorted(element.name, (1, 1, 1))


def moved(points, stretches, seed=3):
    """u that stretches x and y, with z too where all facets are to be in one regime; not affine."""
    rng = np.random.default_rng(seed)
    A = np.diag(np.array([*stretches, stretches[1]]) - 1.0)
    return (points @ A.T + 5e-3 * rng.uniform(-1, 1, points.shape)).ravel()


def sheet(mesh):
    """Nodes of the side z = 1, and the body with skin there alone."""
    return with_skin(mesh, where=lambda p: p[:, 2] > 1 - 1e-9)


def skin_force(body, u):
    """Residual (n, 3) of the skin alone, N."""
    parts = assembly.system(body).skins[0]
    u = np.ascontiguousarray(u).ravel()
    return sum(part.term.residual(u) for part in parts).reshape(-1, 3)


@pytest.mark.parametrize("state", STATES)
@pytest.mark.parametrize("unit", units("skin_direct"))
def test_skin_force_is_the_derivative_of_its_energy(
    unit, state, compiled_units, distorted, assert_slope
):
    """In the middle of each of the three regimes."""
    mesh = mesh_of(unit, distorted)
    system = assembly.system(with_skin(mesh, unit.split(".")[0])).system
    u = moved(mesh.points, STATES[state])
    d = np.random.default_rng(2).uniform(-1, 1, u.size)
    assert_slope(lambda x: system.energy(x, 1.0), system.residual(u, 1.0) @ d, u, d, 2e-3)


@pytest.mark.parametrize("state", STATES)
@pytest.mark.parametrize("unit", units("skin_direct", "skin_inverse"))
def test_skin_tangent_is_the_derivative_of_its_force(
    unit, state, compiled_units, distorted, assert_slope
):
    """On the rest shape, and on the loaded shape with the rest shape unknown."""
    from scipy.sparse import csr_array

    law, _, form = unit.split(".")
    mesh = mesh_of(unit, distorted)
    inverse = form == "skin_inverse"
    system = assembly.system(with_skin(mesh, law), inverse).system
    stretches = np.array(STATES[state])
    u = moved(mesh.points, 1 / stretches if inverse else stretches)
    d = np.random.default_rng(2).uniform(-1, 1, u.size)
    K = csr_array(system.tangent(u), shape=(u.size, u.size))
    assert_slope(lambda x: system.residual(x, 1.0), K @ d, u, d, 1e-3)


@pytest.mark.parametrize("element", ELEMENTS)
def test_turning_a_stretched_skin_turns_its_forces(element, distorted, rotation):
    """Objectivity: R(Q x) = Q R(x); and at rest, turned or not, there is no force at all."""
    mesh = distorted(element)
    body = with_skin(mesh)
    x = mesh.points + moved(mesh.points, STATES["taut"]).reshape(-1, 3)
    force = skin_force(body, x - mesh.points)
    turned = skin_force(body, x @ rotation.T - mesh.points)
    np.testing.assert_allclose(turned, force @ rotation.T, atol=1e-12 * abs(force).max())
    stiffness = YOUNG * THICKNESS
    assert abs(skin_force(body, mesh.points @ rotation.T - mesh.points)).max() < 1e-12 * stiffness


@pytest.mark.parametrize("element", ELEMENTS)
@pytest.mark.parametrize("stretches", [(1.3, 1.3), (1.4, 1.1), (1.5, 1.5**-0.5)])
def test_taut_sheet_pulls_as_a_rubber_sheet_does(element, stretches):
    """Treloar: P1 = μ (λ1 - 1/(λ1³ λ2²)), P2 alike; at λ2 = λ1^(-1/2) that is simple tension.

    The force across the edge of a unit square is P times the thickness.
    """
    a, b = stretches
    mesh = supple.Mesh.box((2, 2, 1), (1.0, 1.0, 1.0), element)
    force = skin_force(sheet(mesh), mesh.points * [a - 1, b - 1, 0.0])
    expected = MU * THICKNESS * np.array([a - 1 / (a**3 * b**2), b - 1 / (b**3 * a**2)])
    edges = [force[mesh.points[:, i] > 1 - 1e-9, i].sum() for i in (0, 1)]
    np.testing.assert_allclose(edges, expected, atol=1e-12 * MU * THICKNESS)


@pytest.mark.parametrize("element", ELEMENTS)
def test_wrinkled_sheet_pulls_one_way_only(element):
    """Pipkin: μ (λ - 1/λ²) along the folds whatever the width, and its residual across them."""
    mesh = supple.Mesh.box((2, 2, 1), (1.0, 1.0, 1.0), element)
    a, b = 1.4, 0.6
    force = skin_force(sheet(mesh), mesh.points * [a - 1, b - 1, 0.0])
    pull, push = [force[mesh.points[:, i] > 1 - 1e-9, i].sum() / (MU * THICKNESS) for i in (0, 1)]
    plain = np.array([a - 1 / (a**3 * b**2), b - 1 / (b**3 * a**2)])
    assert pull == pytest.approx((1 - RESIDUAL) * (a - a**-2) + RESIDUAL * plain[0], rel=1e-12)
    assert push == pytest.approx(RESIDUAL * plain[1], rel=1e-12)


@pytest.mark.parametrize("element", ELEMENTS)
def test_slack_sheet_carries_a_thousandth(element):
    """Its force is 1e-3 of that of a sheet that could be compressed."""
    mesh = supple.Mesh.box((2, 2, 1), (1.0, 1.0, 1.0), element)
    a, b = STATES["slack"]
    force = skin_force(sheet(mesh), mesh.points * [a - 1, b - 1, 0.0])
    plain = a - 1 / (a**3 * b**2)
    edge = force[mesh.points[:, 0] > 1 - 1e-9, 0].sum() / (MU * THICKNESS)
    assert edge == pytest.approx(RESIDUAL * plain, rel=1e-12)


@pytest.mark.parametrize(
    "law",
    [
        pytest.param(m.name, marks=() if m.name in QUICK else (pytest.mark.slow,))
        for m in supple.materials()
    ],
)
def test_every_isotropic_law_can_make_a_skin(law):
    """Just below incompressible, where Hooke's terms are finite, the force is too, and it pulls."""
    material = supple.material(law)
    if "isotropic" in material.exceptions:
        return
    mesh = supple.Mesh.box((1, 1, 1), (1.0, 1.0, 1.0), "P1")
    body = supple.Body(mesh, "neo_hookean", young=1e-3, poisson=0.3)
    given = {"poisson": 0.45} if "poisson" in [p.name for p in material.parameters] else {}
    body.skin(lambda p: p[:, 2] > 1 - 1e-9, law, thickness=THICKNESS, **given)
    force = skin_force(body, mesh.points * [0.01, 0.01, 0.0])
    assert np.isfinite(force).all()
    assert force[mesh.points[:, 0] > 1 - 1e-9, 0].sum() > 0


def test_a_skin_that_would_be_infinitely_stiff_is_refused():
    """Hooke's λ is infinite at a skin's poisson of 0.5 in laws that multiply it by a strain."""
    mesh = supple.Mesh.box((1, 1, 1), (1.0, 1.0, 1.0), "P1")
    body = supple.Body(mesh, "neo_hookean").fix(lambda p: p[:, 2] < 0.1)
    body.skin(lambda p: p[:, 2] > 1 - 1e-9, "corotational_polar", thickness=THICKNESS)
    body.traction(lambda p: p[:, 2] > 1 - 1e-9, (0.0, 0.0, 1.0))
    with pytest.raises(supple.InputError, match=r"wants poisson below 0\.5"):
        body.solve()


def test_a_law_that_is_not_isotropic_is_refused_as_a_skin():
    """The skin's frame is arbitrary, so the sentence names the law."""
    mesh = supple.Mesh.box((1, 1, 1), (1.0, 1.0, 1.0), "P1")
    body = with_skin(mesh, "corotational_qr").fix(lambda p: p[:, 0] < 0.1)
    with pytest.raises(supple.MaterialError, match="corotational_qr is not isotropic"):
        body.solve()
