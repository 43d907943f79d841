"""Shipped energies on numbers: free at rest, objective, isotropic or turning with their fibres."""

from __future__ import annotations

import ast

import numpy as np
import pytest

import supple
from supple import assembly
from supple.kernels import checks, reader

LAWS = [m.name for m in supple.materials() if reader.read(m.path).solid]
SKINS = [m.name for m in supple.materials() if reader.read(m.path).surface]
FIBROUS = [n for n in LAWS if any(p.kind.size == 3 for p in supple.material(n).parameters)]
F = np.array([[1.1, 0.2, 0.0], [0.1, 0.9, 0.15], [-0.05, 0.1, 1.2]])
#: Laws whose kernels every test run compiles: at least one for each word of the vocabulary.
QUICK = ("neo_hookean", "saint_venant_kirchhoff", "corotational_polar", "corotational_qr",
         "mooney_rivlin", "ogden", "hencky", "holzapfel_ogden", "hooke",
         "transversely_isotropic_mooney_rivlin")  # fmt: skip
#: Statements of an energy file, its docstring apart; parameters may take several lines.
LONGEST = 12


@pytest.fixture(params=LAWS)
def law(request):
    return reader.read(supple.material(request.param).path)


def defaults(law):
    return {p.name: p.default for p in law.parameters}


def directions(law):
    return {p.name: np.array(p.default) for p in law.parameters if p.kind.size == 3}


def psi(law, F, **values):
    return checks.energy_at(law, F, defaults(law) | values)


def test_rest_has_no_energy_and_no_stress_unless_declared(law):
    """ψ(I) = 0 and σ(I) = 0; a law that declares otherwise must prove it."""
    scale = checks.stiffness_scale(law, defaults(law))
    free = abs(psi(law, np.eye(3))) <= 1e-12 * scale
    free &= bool(abs(checks.rest_stress(law, defaults(law))).max() <= 1e-7 * scale)
    assert free == ("stress_free" not in law.exceptions)


def test_small_strains_cost_energy(law):
    """ψ ≥ 0 near I, and above 0 for a pure strain: the rest state is a minimum."""
    if "stress_free" in law.exceptions:
        return
    scale, rng = checks.stiffness_scale(law, defaults(law)), np.random.default_rng(0)
    for size in (1e-4, 1e-2, 0.1):
        for _ in range(20):
            H = rng.uniform(-size, size, (3, 3))
            assert psi(law, np.eye(3) + H) > -1e-14 * scale
            assert psi(law, np.eye(3) + (H + H.T) / 2) > 1e-7 * scale * size**2


def test_rotation_after_leaves_the_energy_unless_declared(law, rotation):
    """ψ(QF) = ψ(F)."""
    same = psi(law, rotation @ F) == pytest.approx(psi(law, F), rel=1e-12)
    assert same == ("objective" not in law.exceptions)


def test_turning_matter_leaves_the_energy_unless_declared(law, rotation):
    """ψ(QFQᵀ) = ψ(F) for an isotropic law, and for no other; for objective ones that is ψ(FQᵀ)."""
    same = psi(law, rotation @ F @ rotation.T) == pytest.approx(psi(law, F), rel=1e-12)
    assert same == ("isotropic" not in law.exceptions)


@pytest.mark.parametrize("name", FIBROUS)
def test_matter_and_its_fibres_turn_together(name, rotation):
    """ψ(F Qᵀ; Q f) = ψ(F; f), Q F Qᵀ where the law is not objective; a turned fibre alone tells."""
    law = reader.read(supple.material(name).path)
    turned = {n: rotation @ f for n, f in directions(law).items()}
    F_turned = F @ rotation.T if "objective" not in law.exceptions else rotation @ F @ rotation.T
    assert psi(law, F_turned, **turned) == pytest.approx(psi(law, F), rel=1e-12)
    for n, f in turned.items():  # pulled along and across, since a slack fibre tells nothing
        changes = [abs(psi(law, G, **{n: f}) / psi(law, G) - 1) for G in (F, np.linalg.inv(F))]
        assert max(changes) > 1e-6, n


def test_flattening_costs_everything_unless_declared(law):
    """ψ grows without bound as J → 0; with the exception "barrier" it stays finite, J < 0 too.

    A law with a limit of its own (Gent) has no number there, which refuses the state as well.
    """
    flat = [psi(law, np.diag([1.0, 1.0, J])) for J in (1e-2, 1e-50, 1e-150)]
    scale = checks.stiffness_scale(law, defaults(law))
    if "barrier" in law.exceptions:
        assert max(flat) < 10 * scale
        assert np.isfinite(psi(law, np.diag([1.0, 1.0, -0.1])))
    else:
        flat = np.nan_to_num(flat, nan=np.inf, posinf=np.inf)
        assert np.isinf(flat[1]) or flat[0] < flat[1] / 10 < flat[2] / 20
        assert flat[2] > 1e2 * scale  # -bulk/2 ln J alone: 173 bulk


@pytest.mark.parametrize("name", SKINS)
def test_skin_has_no_energy_at_rest_and_none_to_gain_across_its_pull(name):
    """ψ_s(I) = 0 is a minimum, and at a pulled skin's own width 1/√λ all others cost more."""
    law = reader.read(supple.material(name).path)
    checks.require_sound(law)
    assert checks.skin_energy_at(law, (1.0, 1.0), defaults(law)) == 0.0
    for pull in (1.0, 1.1, 1.5):
        width = pull**-0.5
        widths = [checks.skin_energy_at(law, (pull, width + d), defaults(law))
                  for d in (-1e-3, 0.0, 1e-3)]  # fmt: skip
        assert widths[1] < min(widths[0], widths[2])


@pytest.mark.parametrize("name", [m.name for m in supple.materials()])
def test_an_energy_file_is_short(name):
    """At most LONGEST statements: import, exceptions, definitions and what is in them."""
    tree = ast.parse(supple.material(name).path.read_text(encoding="utf-8"))
    count = sum(isinstance(node, ast.stmt) for node in ast.walk(tree)) - 1
    assert count <= LONGEST


def test_there_are_the_energies_that_users_of_sofa_and_febio_look_for():
    """Issue: 18 or more."""
    assert len(supple.materials()) >= 18


@pytest.mark.parametrize(
    "unit",
    [
        pytest.param(f"{law}.P1.direct", marks=() if law in QUICK else (pytest.mark.slow,))
        for law in LAWS
    ],
)
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
    table = (
        assembly.system(body).regions[0].tabulate("points", (points @ (F - np.eye(3)).T).ravel())
    )
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
