"""Every energy on every element: energy → residual → tangent by differences, zero at rest."""

from __future__ import annotations

import numpy as np
import pytest

import supple
from supple.laws import read_law

ELEMENTS = ("P1", "P2", "Q1", "Q2")
LAWS = [m.name for m in supple.materials() if read_law(m.path).solid]
#: Laws whose kernels are compiled with Supple, so that every element × form is quick.
AHEAD = ("neo_hookean", "corotational_polar")
#: Laws that every test run compiles on elements of degree 1; the others are slow.
QUICK = (*AHEAD, "saint_venant_kirchhoff", "mooney_rivlin", "corotational_qr")


def units(*forms: str) -> list:
    """law.element.form; slow where it takes long to compile."""
    chosen = []
    for law in LAWS:
        for element in ELEMENTS:
            for form in forms:
                quick = law in QUICK and (form == "direct" or law != "corotational_qr")
                fast = law in AHEAD or (element in ("P1", "Q1") and quick)
                marks = () if fast else (pytest.mark.slow,)
                chosen.append(pytest.param(f"{law}.{element}.{form}", marks=marks))
    return chosen


@pytest.fixture
def system(unit, compiled_units, distorted):
    """system(unit): the runtime system of a distorted block with other parameters in each cell."""
    law, element, form = unit.split(".")
    mesh = distorted(element, (2, 1, 1))
    body = supple.Body(mesh, law)
    spread = np.linspace(0.8, 1.25, len(mesh.cells))
    body.set(**{p.name: per_cell(p, spread) for p in supple.material(law).parameters})
    return body._system(form == "inverse").system


def per_cell(parameter, spread):
    """Other values in each cell: scaled where bounds let it be, or a direction turned about z."""
    if parameter.kind.size == 1:
        scaled = parameter.default * spread
        return scaled if parameter.kind.admits(scaled) else parameter.default
    x, y, z = parameter.default
    return np.column_stack([x - spread * y, y + spread * x, z + 0 * spread])


def stretched(points, seed=1):
    """A displacement of some 20 % strain, not affine."""
    rng = np.random.default_rng(seed)
    A = np.array([[0.15, 0.1, -0.05], [0.0, -0.1, 0.1], [0.05, 0.0, 0.12]])
    return (points @ A.T + 0.03 * rng.uniform(-1, 1, points.shape)).ravel()


def dense(system, u):
    """The tangent (3n, 3n)."""
    from scipy.sparse import csr_array

    return csr_array(system.tangent(u), shape=(u.size, u.size))


def points_of(unit, distorted):
    return distorted(unit.split(".")[1], (2, 1, 1)).points


def step(unit):
    """Of the differences: shorter where exponentials and fibres' limits leave it less room."""
    return 2e-3 if unit.split(".")[0] in QUICK else 2e-4


def direction(size):
    return np.random.default_rng(2).uniform(-1, 1, size)


@pytest.mark.parametrize("unit", units("direct"))
def test_residual_is_the_derivative_of_the_energy(unit, system, distorted, assert_slope):
    """R·d against central differences of Π, at some 20 % strain."""
    u = stretched(points_of(unit, distorted))
    d = direction(u.size)
    slope = system.residual(u, 1.0) @ d
    assert_slope(lambda x: system.energy(x, 1.0), slope, u, d, step(unit))


@pytest.mark.parametrize("unit", units("direct", "inverse"))
def test_tangent_is_the_derivative_of_the_residual(unit, system, distorted, assert_slope):
    """K d against central differences of R, at some 20 % strain."""
    u = stretched(points_of(unit, distorted))
    d = direction(u.size)
    slope = dense(system, u) @ d
    assert_slope(lambda x: system.residual(x, 1.0), slope, u, d, step(unit))


@pytest.mark.parametrize("unit", units("direct"))
def test_tangent_is_symmetric(unit, system, distorted):
    """A second derivative of the energy is."""
    K = dense(system, stretched(points_of(unit, distorted)))
    assert abs(K - K.T).max() < 1e-13 * abs(K).max()


@pytest.mark.parametrize("unit", units("direct", "inverse"))
def test_a_rigid_motion_gives_no_force_unless_declared(unit, system, distorted, rotation):
    """u = (Q - I) x + c: residual below 1e-12 of the stiffness times the body's size.

    A law under stress at rest pulls in both states, one that is not objective when turned.
    """
    points, exceptions = points_of(unit, distorted), supple.material(unit.split(".")[0]).exceptions
    rest, turned = np.zeros(points.size), (points @ rotation.T - points + [0.3, -0.2, 0.1]).ravel()
    stiffness = abs(dense(system, rest)).max()
    free = [abs(system.residual(u, 1.0)).max() < 1e-12 * stiffness for u in (rest, turned)]
    under_stress = "stress_free" in exceptions
    assert free == [not under_stress, not under_stress and "objective" not in exceptions]
    if unit.endswith("direct") and not exceptions & {"stress_free", "objective"}:
        assert abs(system.energy(turned, 1.0)) < 1e-12 * stiffness


@pytest.mark.parametrize("unit", units("direct"))
def test_a_free_cell_has_six_zero_modes_unless_declared(unit, compiled_units):
    """Three shifts and three turns, and nothing else, cost no energy at rest.

    Under stress at rest a turn at first order is a change of shape at second: only shifts are free.
    """
    law, element, _ = unit.split(".")
    box = supple.Mesh.box((1, 1, 1), (1.0, 1.0, 1.0), element)
    nodes = np.unique(box.cells[0])
    cell = supple.Mesh(box.points[nodes], np.searchsorted(nodes, box.cells[:1]), element)
    u = np.zeros_like(cell.points)
    eigenvalues = np.linalg.eigvalsh(supple.assemble(supple.Body(cell, law), u)[2].toarray())
    scaled = eigenvalues / eigenvalues.max()
    free, least = (3, 1e-5) if "stress_free" in supple.material(law).exceptions else (6, 1e-4)
    assert np.abs(scaled[:free]).max() < 1e-13, scaled[:7]
    assert scaled[free] > least, scaled[:7]


@pytest.mark.parametrize("unit", units("inverse"))
def test_inverse_residual_is_the_direct_one_read_backwards(unit, compiled_units, distorted):
    """On the loaded mesh, u' = X - x gives the nodal forces that u = x - X gives on the rest."""
    law, element, _ = unit.split(".")
    rest = distorted(element, (2, 1, 1))
    u = stretched(rest.points).reshape(-1, 3)
    body = supple.Body(rest, law)
    direct = supple.assemble(body, u)[1]
    inverse = body.on(rest.moved(rest.points + u))._system(True).system
    backwards = inverse.residual(-u.ravel(), 1.0).reshape(-1, 3)
    np.testing.assert_allclose(backwards, direct, atol=1e-12 * abs(direct).max(), rtol=0)
