"""Bodies in uniaxial tension and simple shear: displacement, stress, reactions in closed form."""

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
