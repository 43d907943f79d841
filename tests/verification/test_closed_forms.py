"""Uniaxial tension, simple shear and coincident stretches against closed forms."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import brentq

import supple

YOUNG, POISSON = 3e3, 0.3
MU, LAMBDA = YOUNG / 2.6, YOUNG * 0.3 / (1.3 * 0.4)
C1, C2, BULK = 400.0, 100.0, 1e4
HOOKE = {"young": YOUNG, "poisson": POISSON}
PARAMETERS = {
    "neo_hookean": HOOKE,
    "saint_venant_kirchhoff": HOOKE,
    "corotational_polar": HOOKE,
    "mooney_rivlin": {"c1": C1, "c2": C2, "bulk": BULK},
}


def cauchy(law, F):
    """σ (3, 3), Pa, from the textbook formula of each law."""
    B, J = F @ F.T, np.linalg.det(F)
    eye = np.eye(3)
    if law == "neo_hookean":
        return (MU * (B - eye) + LAMBDA * np.log(J) * eye) / J
    if law == "saint_venant_kirchhoff":
        E = (F.T @ F - eye) / 2
        return F @ (LAMBDA * np.trace(E) * eye + 2 * MU * E) @ F.T / J
    if law == "mooney_rivlin":
        b = J ** (-2 / 3) * B
        s = 2 * C1 * b - 2 * C2 * np.linalg.inv(b)
        return (s - np.trace(s) / 3 * eye + BULK * np.log(J) * eye) / J
    w, s, v = np.linalg.svd(F)
    Q, U = w @ v, v.T @ np.diag(s) @ v
    return Q @ (2 * MU * (U - eye) + LAMBDA * np.trace(U - eye) * eye) @ F.T / J


def pulled(element, law, stretch):
    """A cube with its faces x, y, z = 0 on rollers, drawn to ``stretch`` along x."""
    mesh = supple.Mesh.box((2, 2, 2), (1.0, 1.0, 1.0), element)
    u = np.where(mesh.points < 1e-9, 0.0, np.nan)
    u[mesh.points[:, 0] > 1 - 1e-9, 0] = stretch - 1
    return supple.Body(mesh, law, **PARAMETERS[law]).prescribe(np.arange(len(u)), u)


@pytest.mark.parametrize(
    ("law", "element"),
    [
        *((law, e) for law in PARAMETERS for e in ("P1", "Q1")),
        *(("neo_hookean", e) for e in ("P2", "Q2")),
    ],
)
@pytest.mark.parametrize("stretch", [1.3, 0.8])
def test_uniaxial_tension(element, law, stretch):
    """Lateral stretch where the lateral stress vanishes (a scalar root), and the axial stress."""
    lateral = brentq(
        lambda b: cauchy(law, np.diag([stretch, b, b]))[1, 1], 0.7, 1.3, xtol=1e-15, rtol=1e-15
    )
    state = pulled(element, law, stretch).solve()
    expected = np.array([stretch - 1, lateral - 1, lateral - 1])
    np.testing.assert_allclose(state.u, state.mesh.points * expected, atol=1e-10)
    sigma = cauchy(law, np.diag([stretch, lateral, lateral]))
    found = state.cauchy(at="quadrature")
    assert abs(found - sigma).max() < 1e-10 * abs(sigma).max()
    end = state.mesh.points[:, 0] > 1 - 1e-9
    force = sigma[0, 0] * lateral**2
    assert state.reactions[end, 0].sum() == pytest.approx(force, rel=1e-10)


@pytest.mark.parametrize("law", PARAMETERS)
@pytest.mark.parametrize("element", ["P1", "Q1"])
def test_simple_shear(element, law):
    """u = γ y e_x on the boundary: σ of F = I + γ e_x ⊗ e_y, in the middle as everywhere."""
    gamma = 0.4
    F = np.eye(3) + gamma * np.outer([1, 0, 0], [0, 1, 0])
    mesh = supple.Mesh.box((2, 2, 2), (1.0, 1.0, 1.0), element)
    outside = np.unique(mesh.boundary())
    body = supple.Body(mesh, law, **PARAMETERS[law])
    state = body.prescribe(outside, mesh.points[outside] @ (F - np.eye(3)).T).solve()
    sigma = cauchy(law, F)
    assert abs(state.u - mesh.points @ (F - np.eye(3)).T).max() < 1e-10
    assert abs(state.cauchy() - sigma).max() < 1e-10 * abs(sigma).max()
    deviator = sigma - np.trace(sigma) / 3 * np.eye(3)
    mises = np.sqrt(1.5 * (deviator**2).sum())
    np.testing.assert_allclose(state.von_mises(), mises, rtol=1e-10)


def polar_response(F, dF):
    """P of the polar corotational law and its change along ``dF``, by singular values.

    dR = R W with W skew: (tr U I - U) w = axial(Rᵀ dF - dFᵀ R), regular where stretches coincide.
    """
    w, s, v = np.linalg.svd(F)
    R, U, eye = w @ v, v.T @ np.diag(s) @ v, np.eye(3)
    strain = U - eye
    T = 2 * MU * strain + LAMBDA * np.trace(strain) * eye
    skew = R.T @ dF - dF.T @ R
    axial = np.array([skew[2, 1], skew[0, 2], skew[1, 0]])
    W = np.cross(eye, np.linalg.solve(np.trace(U) * eye - U, axial))
    dU = R.T @ dF - W @ U
    return R @ T, R @ (W @ T + 2 * MU * dU + LAMBDA * np.trace(dU) * eye)


@pytest.mark.parametrize(
    "stretches",
    [(1, 1, 1), (1.2, 1, 1), (0.8, 1, 1), (1.2, 1.2, 1), (1.2, 1.2, 0.7), (1.3, 1.3, 1.3),
     (1, 1, 1 + 1e-8), (1.1, 1.1 + 1e-6, 0.9), (1, 1 + 1e-4, 1 - 1e-4), (1.4, 1.1, 0.7)],
)  # fmt: skip
@pytest.mark.parametrize("turned", [False, True])
def test_polar_law_is_smooth_where_stretches_coincide(stretches, turned, rotation):
    """Stress and tangent of a tetrahedron at (nearly) equal stretches, by singular values."""
    F = np.diag(np.array(stretches, float))
    if turned:
        F = rotation @ F @ rotation.T @ rotation
    mesh = supple.Mesh(np.vstack([np.zeros(3), np.eye(3)]), [[0, 1, 2, 3]], "P1")
    body = supple.Body(mesh, "corotational_polar", **HOOKE)
    _, residual, tangent = supple.assemble(body, mesh.points @ (F - np.eye(3)).T)
    gradients = np.array([[-1.0, -1, -1], [1, 0, 0], [0, 1, 0], [0, 0, 1]])
    P = polar_response(F, np.zeros((3, 3)))[0]
    assert abs(residual - gradients @ P.T / 6).max() < 1e-13 * MU
    for d in np.random.default_rng(0).uniform(-1, 1, (4, 4, 3)):
        dP = polar_response(F, d.T @ gradients)[1]
        change = (tangent @ d.ravel()).reshape(-1, 3)
        assert abs(change - gradients @ dP.T / 6).max() < 1e-11 * MU
