"""Shipped energies on numbers: stress free at rest, objective; declared exceptions hold."""

from __future__ import annotations

import numpy as np
import pytest

import supple
from supple.kernels import checks, reader

LAWS = [material.name for material in supple.materials()]
F = np.array([[1.1, 0.2, 0.0], [0.1, 0.9, 0.15], [-0.05, 0.1, 1.2]])


@pytest.fixture(params=LAWS)
def law(request):
    return reader.read(supple.material(request.param).path)


def defaults(law):
    return {p.name: p.default for p in law.parameters}


def psi(law, F):
    return checks.energy_at(law, F, defaults(law))


def test_rest_has_no_energy_and_no_stress_unless_declared(law):
    """ψ(I) = 0 and σ(I) = 0; a law that declares otherwise must prove it."""
    scale = checks.stiffness_scale(law, defaults(law))
    free = abs(psi(law, np.eye(3))) <= 1e-12 * scale
    free &= bool(abs(checks.stress_at(law, np.eye(3), defaults(law))).max() <= 1e-7 * scale)
    assert free == ("stress_free" not in law.exceptions)


def test_rotation_after_leaves_the_energy_unless_declared(law, rotation):
    """ψ(QF) = ψ(F)."""
    same = psi(law, rotation @ F) == pytest.approx(psi(law, F), rel=1e-12)
    assert same == ("objective" not in law.exceptions)


def test_rotation_before_leaves_the_energy_unless_declared(law, rotation):
    """ψ(FQ) = ψ(F) for an isotropic law, and for no other."""
    same = psi(law, F @ rotation) == pytest.approx(psi(law, F), rel=1e-12)
    assert same == ("isotropic" not in law.exceptions)


def test_flattening_costs_everything_unless_declared(law):
    """ψ grows without bound as J → 0; with the exception "barrier" it stays finite, J < 0 too."""
    flat = [psi(law, np.diag([1.0, 1.0, J])) for J in (1e-2, 1e-50, 1e-150)]
    scale = checks.stiffness_scale(law, defaults(law))
    if "barrier" in law.exceptions:
        assert max(flat) < 10 * scale
        assert np.isfinite(psi(law, np.diag([1.0, 1.0, -0.1])))
    else:
        assert flat[0] < flat[1] / 10 < flat[2] / 20
        assert flat[2] > 1e3 * scale


@pytest.mark.parametrize("unit", [f"{name}.P1.direct" for name in LAWS])
def test_kernel_gives_the_energy_and_stress_of_the_file(unit, compiled_units):
    """Compiled ψ and P of one tetrahedron against the file run on numbers, P by differences."""
    law = reader.read(supple.material(unit.split(".")[0]).path)
    points = np.array([[0.1, 0, 0], [1.1, 0.1, 0.2], [0.0, 0.9, 0.1], [0.2, 0.1, 1.2]])
    mesh = supple.Mesh(points, [[0, 1, 2, 3]], "P1")
    edges = (points[1:] - points[0]).T
    body = supple.Body(mesh, law.path)
    energy, _, _ = supple.assemble(body, points @ (F - np.eye(3)).T)
    found = checks.energy_at(law, F, defaults(law), edges) * mesh.volume
    assert energy == pytest.approx(found, rel=1e-12)
    table = body._system().regions[0].tabulate("points", (points @ (F - np.eye(3)).T).ravel())
    stress = np.zeros((3, 3))
    for i, j in np.ndindex(3, 3):
        d = np.zeros((3, 3))
        d[i, j] = 1e-5
        up, down = (checks.energy_at(law, F + s * d, defaults(law), edges) for s in (1, -1))
        stress[i, j] = (up - down) / 2e-5
    np.testing.assert_allclose(table[0, :9].reshape(3, 3), F, atol=1e-14)
    P = table[0, 9:18].reshape(3, 3)
    np.testing.assert_allclose(P, stress, atol=1e-7 * abs(stress).max())
    assert table[0, 18] == pytest.approx(found / mesh.volume, rel=1e-12)


def test_qr_law_is_hookes_at_first_order_and_depends_on_vertex_order():
    """1e-6 of strain: ψ = λ/2 tr(ε)² + μ ε:ε to 1e-5; another edge first, another ψ at 10 %."""
    law = reader.read(supple.material("corotational_qr").path)
    values = {"young": 3e3, "poisson": 0.3}
    mu, lmbda = 3e3 / 2.6, 3e3 * 0.3 / (1.3 * 0.4)
    H = 1e-6 * np.array([[1.0, 0.3, 0.2], [0.1, -0.5, 0.4], [0.0, 0.2, 0.7]])
    e = (H + H.T) / 2
    hooke = lmbda / 2 * np.trace(e) ** 2 + mu * (e * e).sum()
    assert checks.energy_at(law, np.eye(3) + H, values) == pytest.approx(hooke, rel=1e-5)
    one, other = (checks.energy_at(law, F, values, np.eye(3)[:, order])
                  for order in ([0, 1, 2], [1, 0, 2]))  # fmt: skip
    assert one != pytest.approx(other, rel=1e-3)
