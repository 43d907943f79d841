"""Every law's Cauchy stress in uniaxial, equibiaxial and simple shear states, by textbook.py."""

from __future__ import annotations

import numpy as np
import pytest

import supple
from supple.kernels import checks, reader

from .textbook import STRESS

EYE = np.eye(3)
TETRAHEDRON = supple.Mesh(np.vstack([np.zeros(3), EYE]), [[0, 1, 2, 3]], "P1")
#: Laws whose kernels every test run compiles: at least one for each word of the vocabulary.
QUICK = ("neo_hookean", "saint_venant_kirchhoff", "corotational_polar", "corotational_qr",
         "mooney_rivlin", "ogden", "hencky", "holzapfel_ogden", "hooke",
         "transversely_isotropic_mooney_rivlin")  # fmt: skip
STATES = {
    "uniaxial": np.diag([1.25, 0.92, 0.92]),
    "pushed": np.diag([0.85, 1.05, 1.05]),
    "equibiaxial": np.diag([1.15, 1.15, 0.8]),
    "simple shear": EYE + 0.3 * np.outer(EYE[0], EYE[1]),
    "turned": np.array([[1.05, 0.2, 0.0], [-0.3, 0.9, 0.15], [-0.05, 0.1, 1.1]]),
    "slightly pulled": np.diag([1.03, 0.99, 0.985]),
}


def values(law, rotation):
    """The law's defaults, but directions in general position: orthonormal columns."""
    chosen = {p.name: p.default for p in supple.material(law).parameters}
    directions = [p.name for p in supple.material(law).parameters if p.kind.size == 3]
    return chosen | {name: rotation[:, i] for i, name in enumerate(directions)}


@pytest.mark.parametrize("law", STRESS)
def test_file_has_the_textbooks_stress(law, rotation):
    """σ = P Fᵀ/J, P by differences of the file run on numbers, in six states: 1e-6."""
    p, read = values(law, rotation), reader.read(supple.material(law).path)
    for name, F in STATES.items():
        P = np.zeros((3, 3))
        for i, j in np.ndindex(3, 3):
            d = 1e-5 * np.outer(EYE[i], EYE[j])
            up, down = (checks.energy_at(read, F + s * d, p, EYE) for s in (1, -1))
            P[i, j] = (up - down) / 2e-5
        expected = STRESS[law](F, p)
        sigma = P @ F.T / np.linalg.det(F)
        assert abs(sigma - expected).max() < 1e-6 * abs(expected).max(), name


@pytest.mark.parametrize(
    "unit",
    [
        pytest.param(f"{law}.P1.direct", marks=() if law in QUICK else (pytest.mark.slow,))
        for law in STRESS
    ],
)
def test_stress_is_the_textbooks(unit, compiled_units, rotation):
    """σ = P Fᵀ/J of a tetrahedron whose nodal forces are P ∂N/∂X V, in six states: 1e-10."""
    law = unit.split(".")[0]
    p = values(law, rotation)
    body = supple.Body(TETRAHEDRON, law, **p)
    for name, F in STATES.items():
        residual = supple.assemble(body, TETRAHEDRON.points @ (F - EYE).T)[1]
        sigma = 6 * residual[1:].T @ F.T / np.linalg.det(F)
        expected = STRESS[law](F, p)
        assert abs(sigma - expected).max() < 1e-10 * abs(expected).max(), name


def test_skin_pulls_as_its_paper_says():
    """P1 = μ e^(b (I1 - 3)) (λ1 - 1/(λ1³ λ2²)) per thickness, on the edges of a taut unit sheet."""
    mesh = supple.Mesh.box((1, 1, 1), (1.0, 1.0, 1.0), "P1")
    body = supple.Body(mesh, "neo_hookean", young=1e-9)
    body.skin(lambda p: p[:, 2] > 1 - 1e-9, "fung_skin", thickness=2e-3, mu=8e3, b=2.5)
    for a, b in ((1.2, 1.1), (1.15, 1.15), (1.3, 1.3**-0.5)):
        force = supple.assemble(body, mesh.points * [a - 1, b - 1, 0.0])[1]
        slope = 8e3 * np.exp(2.5 * (a**2 + b**2 + 1 / (a * b) ** 2 - 3))
        expected = 2e-3 * slope * np.array([a - 1 / (a**3 * b**2), b - 1 / (b**3 * a**2)])
        edges = [force[mesh.points[:, i] > 1 - 1e-9, i].sum() for i in (0, 1)]
        np.testing.assert_allclose(edges, expected, rtol=1e-10, atol=1e-8)


def test_every_law_has_its_formula():
    """No energy file without one."""
    assert {*STRESS, "fung_skin"} == {m.name for m in supple.materials()}
