"""Laws of the principal stretches are exact where stretches coincide: stress and tangent."""

from __future__ import annotations

import numpy as np
import pytest

import supple

slow = pytest.mark.slow
EYE = np.eye(3)
MESH = supple.Mesh(np.vstack([np.zeros(3), EYE]), [[0, 1, 2, 3]], "P1")
GRADIENTS = np.vstack([-np.ones(3), EYE])
YOUNG, POISSON = 3e3, 0.3
MU, LAMBDA = YOUNG / 2.6, YOUNG * 0.3 / (1.3 * 0.4)
#: Exponents on both sides of 0, of 2 and of 1, whole and not.
TERMS = ((700.0, 1.3), (30.0, 7.5), (-90.0, -2.2))
OGDEN = {f"{n}{i}": t[k] for i, t in enumerate(TERMS, 1) for k, n in enumerate(("mu", "alpha"))}
HOOKE = {"young": YOUNG, "poisson": POISSON}
PARAMETERS = {
    "ogden": OGDEN | {"bulk": 1e4},
    "ogden_compressible": OGDEN | {"lmbda": 2e3},
    "hencky": HOOKE,
    "corotational_polar": HOOKE,
}


def kirchhoff(law, x):
    """τ_i = λ_i ∂ψ/∂λ_i (3) and ∂τ_i/∂ln λ_j (3, 3), Pa, of the stretches ``x``; by hand."""
    J, one = x.prod(), np.eye(3, dtype=x.dtype)
    if law == "ogden":
        s, third = x * J ** (-one[0, 0] / 3), one[0, 0] / 3
        tau, slope = 1e4 * np.log(J) + 0 * x, 1e4 + 0 * one
        for m, a in TERMS:
            p = s ** np.asarray(a, x.dtype)
            tau = tau + m * (p - p.mean())
            slope = slope + m * a * (p[:, None] * (one - third) - third * (p - p.mean())[None, :])
        return tau, slope
    if law == "ogden_compressible":
        powers = [(m, a, x ** np.asarray(a, x.dtype)) for m, a in TERMS]
        tau = sum(m * (p - 1) for m, _, p in powers) + 2e3 * J * (J - 1)
        return tau, np.diag(sum(m * a * p for m, a, p in powers)) + 2e3 * (2 * J**2 - J)
    if law == "hencky":
        return 2 * MU * np.log(x) + LAMBDA * np.log(J), 2 * MU * one + LAMBDA
    tau = x * (2 * MU * (x - 1) + LAMBDA * (x.sum() - 3))
    return tau, np.diag(tau + 2 * MU * x**2) + LAMBDA * np.outer(x, x)


def response(law, x, dF):
    """P (3, 3) of F = diag(x), and its change along ``dF``; Ogden (1984), eqs. 6.1.25 and 6.1.28.

    In 80-bit numbers, so that differences of nearly equal stretches leave more than 1e-12.
    """
    x = np.asarray(x, np.longdouble)
    tau, slope = kirchhoff(law, x)
    first = tau / x
    second = (slope / x[:, None] - np.diag(first)) / x[None, :]
    dP = np.diag(second @ np.diag(dF))
    for i, j in ((0, 1), (1, 0), (0, 2), (2, 0), (1, 2), (2, 1)):
        if x[i] == x[j]:
            apart = second[i, i] - second[i, j]
            a, b = (first[i] / x[i] + apart) / 2, (apart - first[i] / x[i]) / 2
        else:
            a = (tau[i] - tau[j]) / (x[i] ** 2 - x[j] ** 2)
            b = (x[j] * first[i] - x[i] * first[j]) / (x[i] ** 2 - x[j] ** 2)
        dP[i, j] = a * dF[i, j] + b * dF[j, i]
    return np.diag(first), dP


@pytest.mark.parametrize(
    "stretches",
    [(1, 1, 1), (1.2, 1, 1), (0.8, 1, 1), (1.2, 1.2, 1), (1.2, 1.2, 0.7), (1.3, 1.3, 1.3),
     (1, 1, 1 + 1e-7), (1.1, 1.1 + 1e-6, 0.9), (1, 1 + 1e-4, 1 - 1e-4), (1.4, 1.1, 0.7)],
)  # fmt: skip
@pytest.mark.parametrize("turned", [False, True])
@pytest.mark.parametrize(
    "unit",
    [
        pytest.param(f"{law}.P1.direct", marks=slow if law == "ogden_compressible" else ())
        for law in PARAMETERS
    ],
)
def test_stress_and_tangent_are_exact_at_equal_stretches(
    unit, stretches, turned, compiled_units, rotation
):
    """Of a tetrahedron, to 1e-10 of the stiffness, by the principal-stretch formulae."""
    law = unit.split(".")[0]
    left, right = (rotation, rotation @ rotation) if turned else (EYE, EYE)
    F = left @ np.diag(np.array(stretches, float)) @ right.T
    body = supple.Body(MESH, law, **PARAMETERS[law])
    _, residual, tangent = supple.assemble(body, MESH.points @ (F - EYE).T)
    scale = 3e3
    P = left @ np.asarray(response(law, stretches, 0 * EYE)[0], float) @ right.T
    assert abs(residual - GRADIENTS @ P.T / 6).max() < 1e-12 * scale
    for d in np.random.default_rng(0).uniform(-1, 1, (4, 4, 3)):
        dF = d.T @ GRADIENTS
        dP = left @ np.asarray(response(law, stretches, left.T @ dF @ right)[1], float) @ right.T
        change = (tangent @ d.ravel()).reshape(-1, 3)
        assert abs(change - GRADIENTS @ dP.T / 6).max() < 1e-10 * scale


def sheet(law):
    """A cube almost without stiffness with a skin of ``law``, 1 m thick, on its side z = 1."""
    mesh = supple.Mesh.box((1, 1, 1), (1.0, 1.0, 1.0), "P1")
    body = supple.Body(mesh, "neo_hookean", young=1e-9)
    given = {n: v for n, v in PARAMETERS[law].items() if n not in ("bulk", "poisson")}
    return mesh, body.skin(lambda p: p[:, 2] > 1 - 1e-9, law, thickness=1.0, **given)


@pytest.mark.parametrize("law", [pytest.param("ogden", marks=slow), "hencky"])
@pytest.mark.parametrize("stretches", [(1.2, 1.2), (1.2, 1.2 + 1e-7), (1.3, 1.1), (1.01, 1.01)])
def test_skins_are_exact_at_equal_stretches(law, stretches):
    """P_i = (τ_i - τ_3)/λ_i of a volume-preserving sheet; its tangent by differences, 1e-7."""
    x = np.array([*stretches, 1 / np.prod(stretches)])
    tau = 2 * YOUNG / 3 * np.log(x) if law == "hencky" else sum(m * x**a for m, a in TERMS)
    mesh, body = sheet(law)
    u = mesh.points * [x[0] - 1, x[1] - 1, 0.0]
    _, force, tangent = supple.assemble(body, u)
    edges = [force[mesh.points[:, i] > 1 - 1e-9, i].sum() for i in (0, 1)]
    np.testing.assert_allclose(edges, (tau[:2] - tau[2]) / x[:2], atol=1e-8)
    d = np.random.default_rng(1).uniform(-1, 1, u.shape)
    up, down = (supple.assemble(body, u + h * d)[1] for h in (1e-5, -1e-5))
    slope = (tangent @ d.ravel()).reshape(-1, 3)
    assert abs((up - down) / 2e-5 - slope).max() < 1e-7 * abs(slope).max()
