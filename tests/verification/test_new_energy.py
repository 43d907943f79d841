"""A new energy is one file, anywhere on disk: no other edit, no rebuild, everything works on it."""

from __future__ import annotations

import numpy as np
import pytest

import supple
from supple import assembly
from supple.kernels import checks, reader

FILE = '''"""A dispersed fibre in an Ogden matrix, with a toe; of no paper."""

from supple.energy import Direction, Kinematics, Number, Pa, exp, positive, quadratic_volumetric

exceptions = {"isotropic"}


def psi_dev(k: Kinematics, mu: Pa = 1e3, alpha: Number = 3.3, stiff: Pa = 2e3,
            spread: Number(minimum=0.0, maximum=1.0) = 0.2, grain: Direction = (1.0, 1.0, 0.0)):
    matrix = 2 * mu / alpha**2 * (k.J ** (-alpha / 3) * k.stretch_sum(alpha) - 3)
    pull = positive(spread / 3 * (k.I1_bar - 3) + (1 - spread) * (k.I4_bar(grain) - 1))
    return matrix + stiff / 4 * (exp(pull**2) - 1)


def psi_vol(J, bulk: Pa = 1e4):
    return quadratic_volumetric(J, bulk)
'''
SKIN = '''"""An Ogden skin of one term; of no paper."""

from supple.energy import Kinematics, Number, Pa


def psi_surface(k: Kinematics, mu: Pa = 1e3, alpha: Number = 3.3):
    return 2 * mu / alpha**2 * (k.stretch_sum(alpha) - 3)
'''
F = np.array([[1.1, 0.2, 0.0], [0.1, 0.9, 0.15], [-0.05, 0.1, 1.2]])


@pytest.fixture(scope="module")
def path(tmp_path_factory):
    folder = tmp_path_factory.mktemp("mine")
    (folder / "mine.py").write_text(FILE, encoding="utf-8")
    (folder / "my_skin.py").write_text(SKIN, encoding="utf-8")
    return folder / "mine.py"


@pytest.fixture(autouse=True)
def cache(path, monkeypatch):
    """A kernel cache of its own, so that everything is compiled here."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(path.parent / "cache"))


def test_it_is_shown_as_the_shipped_ones_are(path):
    """Name, parameters with units, bounds and unit directions, reference."""
    found = supple.material(path)
    assert (found.name, found.reference) == (
        "mine",
        "A dispersed fibre in an Ogden matrix, with a toe; of no paper.",
    )
    assert [p.name for p in found.parameters] == ["mu", "alpha", "stiff", "spread", "grain", "bulk"]
    np.testing.assert_allclose(found.parameters[4].default, np.array([1, 1, 0]) / np.sqrt(2))


def test_it_passes_what_shipped_energies_pass(path, rotation):
    """Rest, objectivity, fibres that turn with matter, and compiled ψ and P those of the file."""
    law = reader.read(path)
    checks.require_sound(law)
    values = {p.name: p.default for p in law.parameters}
    psi = checks.energy_at(law, F, values)
    turned = values | {"grain": rotation @ np.array(values["grain"])}
    assert checks.energy_at(law, rotation @ F, values) == pytest.approx(psi, rel=1e-12)
    assert checks.energy_at(law, F @ rotation.T, values) != pytest.approx(psi, rel=1e-6)
    assert checks.energy_at(law, F @ rotation.T, turned) == pytest.approx(psi, rel=1e-12)
    mesh = supple.Mesh(np.vstack([np.zeros(3), np.eye(3)]), [[0, 1, 2, 3]], "P1")
    u = mesh.points @ (F - np.eye(3)).T
    energy, residual, _ = supple.assemble(supple.Body(mesh, path), u)
    assert 6 * energy == pytest.approx(psi, rel=1e-12)
    P = checks.stress_at(law, F, values)
    np.testing.assert_allclose(6 * residual[1:].T, P, atol=1e-7 * abs(P).max())


@pytest.mark.parametrize("inverse", [False, pytest.param(True, marks=pytest.mark.slow)])
def test_its_forces_and_tangents_are_derivatives(path, inverse, distorted, assert_slope):
    """Direct and inverse, with other parameters and another grain in each cell."""
    from scipy.sparse import csr_array

    mesh = distorted("P1", (2, 1, 1))
    n = len(mesh.cells)
    body = supple.Body(mesh, path, alpha=np.linspace(-3, 9.1, n), mu=np.linspace(500, 2e3, n),
                       grain=np.random.default_rng(3).uniform(-1, 1, (n, 3)))  # fmt: skip
    system = assembly.system(body, inverse).system
    rng = np.random.default_rng(1)
    u = (mesh.points @ (F - np.eye(3)).T + 0.02 * rng.uniform(-1, 1, mesh.points.shape)).ravel()
    d = rng.uniform(-1, 1, u.size)
    K = csr_array(system.tangent(u), shape=(u.size, u.size))
    assert_slope(lambda x: system.residual(x, 1.0), K @ d, u, d, 2e-3)
    if not inverse:
        slope = system.residual(u, 1.0) @ d
        assert_slope(lambda x: system.energy(x, 1.0), slope, u, d, 2e-3)
        assert abs(K - K.T).max() < 1e-13 * abs(K).max()


@pytest.mark.slow
def test_it_solves_sags_and_comes_back(path):
    """A block with a region and a skin of new energies, to its rest shape and back: 1e-9 m."""
    mesh = supple.Mesh.box((4, 2, 2), (0.1, 0.05, 0.05), "P1")
    body = supple.Body(mesh, "neo_hookean", density=1e3).region(
        np.arange(24), path, grain=(0, 1, 2)
    )
    body.skin(lambda p: p[:, 2] > 0.05 - 1e-9, path.parent / "my_skin.py", thickness=1e-3)
    body.fix(lambda p: p[:, 0] < 1e-9).gravity((0.0, 0.0, 3.0))
    rest = body.rest_shape()
    assert abs(rest.u).max() > 1e-3
    back = body.on(rest.mesh).solve()
    np.testing.assert_allclose(back.points, mesh.points, atol=1e-9)
