"""Every energy × element × form: energy → residual → tangent by differences, zero at rest."""

from __future__ import annotations

import copy
import re
from types import SimpleNamespace

import numpy as np
import pytest

import supple
from supple import assembly
from supple.kernels.cells import ELEMENTS
from supple.kernels.unit import FORMULATIONS, OFFERED, parse
from supple.laws import folder, read_law

pytestmark = pytest.mark.usefixtures("quick_compiler")


def _text(law):
    return law.path.read_text(encoding="utf-8")


LAWS = {m.name: read_law(m.path) for m in supple.materials()}
SOLIDS = [name for name, law in LAWS.items() if law.solid]
#: Laws whose kernels are compiled with Supple, and on which elements: every form is quick.
AHEAD, AHEAD_ON = ("neo_hookean", "corotational_polar"), ("P1", "P2", "Q1", "Q2")
#: Laws without exponentials or limits near the states of these tests.
SMOOTH = (*AHEAD, "saint_venant_kirchhoff", "mooney_rivlin", "corotational_qr")
#: Laws whose stiffness jumps where a fibre goes slack or reaches its limit.
KINKED = [name for name, law in LAWS.items() if re.search(r"\b(positive|choose)\(", _text(law))]
#: Units that every test run compiles beside those; the others are slow.
QUICK = (
    *("neo_hookean.Q2L.direct", "neo_hookean.Pr1.direct", "neo_hookean.Pr1.inverse"),
    *("saint_venant_kirchhoff.P1.direct", "corotational_qr.P1.direct", "ogden.P1.direct"),
    *("mooney_rivlin.Q1.direct", "hooke.P1.direct"),
    *("mooney_rivlin.P2.mixed_direct", "mooney_rivlin.P2.mixed_inverse"),
    *("mooney_rivlin.Q1.mean_dilatation_direct", "mooney_rivlin.Q1.mean_dilatation_inverse"),
)


def units(*ways: str) -> list:
    """law.element.form for every law, element and formulation that goes with it."""
    chosen = []
    for law in SOLIDS:
        for formulation, prefix in FORMULATIONS.items():
            if formulation != "displacement" and not LAWS[law].is_split:
                continue
            for element in OFFERED[formulation]:
                names = [f"{law}.{element}.{prefix}{way}" for way in ways]
                plain = formulation == "displacement" and law in AHEAD and element in AHEAD_ON
                chosen += [_param(name, plain or name in QUICK) for name in names]
    return chosen


def _param(name: str, fast: bool):
    return pytest.param(name, marks=() if fast else pytest.mark.slow)


def per_cell(parameter, spread):
    """Other values in each cell: scaled where bounds let it be, or a direction turned about z."""
    if parameter.kind.size == 1:
        scaled = parameter.default * spread
        return scaled if parameter.kind.admits(scaled) else parameter.default
    x, y, z = parameter.default
    return np.column_stack([x - spread * y, y + spread * x, z + 0 * spread])


@pytest.fixture
def case(unit, distorted):
    """A distorted block with other parameters in each cell, at some 20 % strain, not affine."""
    return make_case(unit, distorted)


def make_case(unit, distorted, strain=1.0):
    law, element, form = unit.split(".")
    mesh = distorted(element, (2, 1, 1))
    formulation = next(f for f, p in FORMULATIONS.items() if form in (f"{p}direct", f"{p}inverse"))
    body = supple.Body(mesh, law, formulation=formulation)
    spread = np.linspace(0.8, 1.25, len(mesh.cells))
    body.set(**{p.name: per_cell(p, spread) for p in LAWS[law].parameters})
    built = assembly.system(body, form.endswith("inverse"))
    u = strain * stretched(mesh.points)
    rng = np.random.default_rng(5)
    x = np.append(u, 0.02 * rng.uniform(-1, 1, built.system.scalars))
    return SimpleNamespace(body=body, mesh=mesh, built=built, system=built.system, x=x, u=u,
                           direct=form.endswith("direct"))  # fmt: skip


def stretched(points, seed=1):
    rng = np.random.default_rng(seed)
    A = np.array([[0.15, 0.1, -0.05], [0.0, -0.1, 0.1], [0.05, 0.0, 0.12]])
    return points @ A.T + 0.03 * rng.uniform(-1, 1, points.shape)


def dense(system, x):
    """The tangent (dofs, dofs)."""
    from scipy.sparse import csr_array

    return csr_array(system.tangent(x), shape=(x.size, x.size))


def step(unit):
    """Of the differences: shorter where exponentials and fibres' limits leave it less room."""
    return 2e-3 if unit.split(".")[0] in SMOOTH else 2e-4


def short_of_kinks(f, slope, x, d, h):
    """h, or a tenth of it where it crosses a kink: the difference is then off by its jump."""
    off = abs((f(x + h * d) - f(x - h * d)) / (2 * h) - slope).max()
    return h / 10 if off > 1e-3 * abs(slope).max() else h


def direction(size):
    return np.random.default_rng(2).uniform(-1, 1, size)


@pytest.mark.parametrize("unit", units("direct"))
def test_residual_is_the_derivative_of_the_energy(unit, case, assert_slope):
    """R·d against central differences of Π; of a mixed form's saddle by the pressures too."""
    d = direction(case.x.size)
    slope = case.system.residual(case.x, 1.0) @ d
    assert_slope(lambda x: case.system.energy(x, 1.0), slope, case.x, d, step(unit))


@pytest.mark.parametrize("unit", units("direct", "inverse"))
def test_tangent_is_the_derivative_of_the_residual(unit, case, assert_slope):
    """K d against central differences of R."""
    d = direction(case.x.size)
    slope = dense(case.system, case.x) @ d
    h = step(unit)
    if unit.split(".")[0] in KINKED:
        h = short_of_kinks(lambda x: case.system.residual(x, 1.0), slope, case.x, d, h / 10)
    assert_slope(lambda x: case.system.residual(x, 1.0), slope, case.x, d, h)


@pytest.mark.parametrize("unit", units("direct"))
def test_tangent_is_symmetric(case):
    """A second derivative of the energy is."""
    K = dense(case.system, case.x)
    assert abs(K - K.T).max() < 1e-13 * abs(K).max()


@pytest.mark.parametrize("unit", units("direct", "inverse"))
def test_a_rigid_motion_gives_no_force_unless_declared(unit, case, rotation):
    """u = (Q - I) x + c, p = 0: R below 1e-12 of the stiffness times the body's size."""
    points, exceptions = case.mesh.points, LAWS[unit.split(".")[0]].exceptions
    moved = points @ rotation.T - points + np.array([0.3, -0.2, 0.1])
    for u, broken in ((np.zeros_like(points), "stress_free"), (moved, "objective")):
        x = np.append(u, np.zeros(case.system.scalars))
        free = "stress_free" not in exceptions and (
            broken == "stress_free" or broken not in exceptions
        )
        stiffness = abs(dense(case.system, x)).max()
        assert (abs(case.system.residual(x, 1.0)).max() < 1e-12 * stiffness) == free


@pytest.mark.parametrize("unit", units("direct"))
def test_a_free_cell_has_six_zero_modes(unit):
    """Three shifts and three turns cost no energy at rest, and nothing else does.

    Of a mixed form the pressures are condensed out first, which leaves what the cell resists with.
    """
    law, element, form = unit.split(".")
    formulation = next(f for f, p in FORMULATIONS.items() if form == f"{p}direct")
    box = supple.Mesh.box((1, 1, 1), (1.0, 1.0, 1.0), element)
    nodes = np.unique(box.cells[0])
    cell = supple.Mesh(box.points[nodes], np.searchsorted(nodes, box.cells[:1]), element)
    body = supple.Body(cell, law, formulation=formulation)
    K = supple.assemble(body, np.zeros_like(cell.points))[2].toarray()
    n = cell.points.size
    if formulation == "mixed":
        K = K[:n, :n] - K[:n, n:] @ np.linalg.solve(K[n:, n:], K[n:, :n])
    eigenvalues = np.linalg.eigvalsh(K)
    scaled = eigenvalues / eigenvalues.max()
    bar = 1e-4 * min(1.0, _softness(LAWS[law]))
    if "stress_free" in LAWS[law].exceptions:  # turning a cell under stress changes its forces
        assert (np.abs(scaled) < 1e-13).sum() == 3, scaled[:7]
    else:
        assert np.abs(scaled[:6]).max() < 1e-12, scaled[:7]
        assert scaled[6] > bar, (scaled[:7], bar)


def _softness(law):
    """Least over largest stiffness of the law itself at rest, among unit strains."""
    from supple.kernels import checks

    values = {p.name: p.default for p in law.parameters}
    step, second = 1e-3, []
    basis = [np.outer(a, b) + np.outer(b, a) for a, b in _PAIRS]
    C = np.empty((6, 6))
    for i, a in enumerate(basis):
        for j, b in enumerate(basis):
            signs = ((1, 1), (1, -1), (-1, 1), (-1, -1))
            C[i, j] = sum(s * t * checks.energy_at(law, np.eye(3) + step * (s * a + t * b), values)
                          for s, t in signs) / (4 * step**2)  # fmt: skip
    second = np.linalg.eigvalsh(C)
    return second[0] / second[-1]


_PAIRS = [
    (np.eye(3)[i] / (2 if i == j else 2**0.5), np.eye(3)[j]) for i in range(3) for j in range(i, 3)
]


@pytest.mark.parametrize("unit", units("inverse"))
def test_inverse_residual_is_the_direct_one_read_backwards(case, distorted):
    """On the loaded mesh, u' = X - x gives the nodal forces that u = x - X gives on the rest."""
    pressure = None
    if case.system.scalars:
        pressure = np.cos(3 * case.mesh.points[:, 0]) * 0.02 * case.built.scalar_unit
    direct = assembly.system(case.body)
    forward = assembly.unknowns(case.body, case.u, pressure)
    forward[case.u.size :] /= direct.scalar_unit
    expected = direct.system.residual(forward, 1.0)
    inverse = assembly.system(case.body.on(case.mesh.moved(case.mesh.points + case.u)), True)
    backward = assembly.unknowns(case.body, -case.u, pressure)
    backward[case.u.size :] /= inverse.scalar_unit
    found = inverse.system.residual(backward, 1.0)
    found[case.u.size :] *= direct.scalar_unit / inverse.scalar_unit
    np.testing.assert_allclose(found, expected, atol=1e-11 * abs(expected).max(), rtol=0)


@pytest.mark.parametrize("unit", units("direct"))
def test_turning_all_turns_the_forces_and_turning_the_body_alone_does_not(unit, case, rotation):
    """R(Q X, Q u; Q f) = Q R(X, u; f): shape, displacement and fibres turned together.

    With the fibres left as they were a law of directions notices. The QR strain's first edge is
    turned with the body.
    """
    fibres = [p.name for p in LAWS[unit.split(".")[0]].parameters if p.kind.size == 3]
    turned = case.mesh.moved(case.mesh.points @ rotation.T)
    n = case.u.size
    expected = case.system.residual(case.x, 1.0)
    expected[:n] = (expected[:n].reshape(-1, 3) @ rotation.T).ravel()
    values = case.body._description.regions[0].values
    for follow in (True, False):
        body = case.body.on(turned)
        if follow:
            body.set(**{name: values[name] @ rotation.T for name in fibres})
        built = assembly.system(body)
        scale = case.built.scalar_unit / built.scalar_unit  # of one and the same pressure
        found = built.system.residual(np.append(case.u @ rotation.T, scale * case.x[n:]), 1.0)
        found[n:] *= scale
        same = abs(found - expected).max() < 1e-9 * abs(expected).max()
        assert same == (follow or not fibres)


#: Sensitivities of every unit, or where they are many of the first element of each cell.
def sensitivity_units() -> list:
    chosen = []
    for unit in units("direct", "inverse"):
        name = unit.values[0]
        quick = name in ("neo_hookean.P1.direct", "mooney_rivlin.Q1.mean_dilatation_direct")
        chosen.append(_param(f"{name}_sensitivity", quick))
    return chosen


@pytest.mark.parametrize("unit", sensitivity_units())
def test_sensitivities_are_the_derivatives_of_the_residual(unit, distorted):
    """∂R/∂(each parameter) and ∂R/∂X against Richardson differences of R, to 1e-8."""
    from supple.state import Rest, State

    # With exponentials some 20 % are 1e23 Pa, beside which one parameter's share cannot be seen.
    strain = 1.0 if unit.split(".")[0] in SMOOTH else 0.3
    case = make_case(unit.removesuffix("_sensitivity"), distorted, strain)
    n, scalars = case.u.size, case.system.scalars
    nodal = None
    if scalars:
        nodal = case.built.scalar_unit * 0.02 * np.cos(3 * case.mesh.points[:, 0])
    description = case.body._description
    solved = (case.u, 0, [], {}, 0.0, 0 * case.u, (), description, "", nodal)
    at = State(*solved) if case.direct else Rest(*solved, _body=case.body)

    def residual(body):
        built = assembly.system(body, not case.direct)
        x = assembly.unknowns(body, case.u, nodal)
        x[n:] /= built.scalar_unit
        r = built.system.residual(x, 1.0)
        r[n:] /= built.scalar_unit
        return r

    for p in LAWS[unit.split(".")[0]].parameters:
        value = description.regions[0].values[p.name]
        step = move(p, value, description.regions[0].values)

        def change(h, name=p.name, value=value, step=step):
            body = copy.copy(case.body)
            body._description = copy.copy(description)
            region = copy.copy(description.regions[0])
            region.values = {**region.values, name: value + h * step}
            body._description.regions = [region]
            return residual(body)

        found = supple.sensitivity(case.body, at, p.name) @ step.ravel()
        assert_derivative(found, change, p.name)
    d = np.random.default_rng(3).uniform(-0.1, 0.1, case.u.shape)
    found = supple.sensitivity(case.body, at, "points") @ d.ravel()
    assert_derivative(
        found, lambda h: residual(case.body.on(case.mesh.moved(case.mesh.points + h * d))), "points"
    )


def move(parameter, value, values):
    """A change of every cell's value: of its own size, less near a bound; of 0 its unit's size."""
    if parameter.kind.size == 3:
        return np.random.default_rng(7).uniform(-0.5, 0.5, value.shape)
    room = min(parameter.kind.maximum - value.max(), value.min() - parameter.kind.minimum)
    if value.all():
        return np.minimum(abs(value), 10 * room)
    largest = max(abs(v).max() for v in values.values())
    return np.full_like(value, 0.1 * largest if parameter.kind.unit == "Pa" else 0.1)


def assert_derivative(found, change, name):
    """h⁶ by Richardson from central differences at h, h/2, h/4.

    At a step so long that rounding of R does not count, so short that none crosses a kink.
    """
    errors = []
    for h in (1e-2, 1e-3, 1e-4, 1e-5, 5e-2, 2e-1):
        d = [(change(h / k) - change(-h / k)) / (2 * h / k) for k in (1, 2, 4)]
        first, second = (4 * d[1] - d[0]) / 3, (4 * d[2] - d[1]) / 3
        expected = (16 * second - first) / 15
        rounding = 32 * np.finfo(float).eps * abs(change(h)).max() / h
        if not found.any() and abs(expected).max() <= rounding:
            return  # R does not depend on it: fibres that are slack, or short of their limit
        errors.append(abs(found - expected).max() / abs(expected).max())
        if errors[-1] <= 1e-8:
            return
    raise AssertionError(f"∂R/∂{name}: {errors}")


def test_the_matrix_is_whole():
    """Every file in materials/ that is a solid, on every element, both ways; names parse."""
    names = {unit.values[0] for unit in units("direct", "inverse")}
    assert {n.split(".")[0] for n in names} == set(SOLIDS)
    for law in SOLIDS:
        for element in ELEMENTS:
            assert {f"{law}.{element}.direct", f"{law}.{element}.inverse"} <= names
    assert all(parse(name, folder()).name == name for name in names)
