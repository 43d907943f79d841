"""Manufactured solution: the field that exact loads must give back, at the rates of theory."""

from __future__ import annotations

import json

import numpy as np
import pytest

import supple
from supple.cli import main
from supple.studies import manufactured
from supple.studies.manufactured import Case

SVK = manufactured.CASES[0]
FIBRES = '''"""Fibres with an exponential energy in a neo-Hookean ground."""
from supple.energy import Direction, Kinematics, Number, Pa, exp, ln

exceptions = {"isotropic"}


def psi(k: Kinematics, mu: Pa = 1e3, k1: Pa = 5e3, k2: Number = 10.0,
        fibre: Direction = (1.0, 0.0, 0.0)):
    ground = mu / 2 * (k.I1 - 3 - 2 * ln(k.J)) + mu * ln(k.J) ** 2
    return ground + k1 / (2 * k2) * (exp(k2 * (k.I4(fibre) - 1) ** 2) - 1)
'''


def test_the_case_is_that_of_the_thesis():
    """SVK, E = 3 kPa, ν = 0.3; beside it two laws that are not isotropic; four elements."""
    assert (SVK.name, dict(SVK.values)) == (
        "saint_venant_kirchhoff",
        {"young": 3e3, "poisson": 0.3},
    )
    others = [supple.material(case.material) for case in manufactured.CASES[1:]]
    assert len(others) == 2
    assert all("isotropic" in law.exceptions for law in others)
    assert manufactured.ELEMENTS == ("P1", "P2", "Q1", "Q2")
    assert all(len(cells) == 4 for cells in manufactured.MESHES.values())


def test_the_gradient_is_that_of_the_field():
    """Central differences of U."""
    X, h = np.random.default_rng(0).uniform(0, 1, (5, 3)), 1e-5
    _, gradient = manufactured.exact(X)
    for j, step in enumerate(h * np.eye(3)):
        slope = (manufactured.exact(X + step)[0] - manufactured.exact(X - step)[0]) / (2 * h)
        np.testing.assert_allclose(gradient[..., j], slope, atol=1e-10)


@pytest.mark.parametrize("element", manufactured.ELEMENTS + manufactured.FURTHER)
def test_exact_loads_balance(element):
    """∫ Div P dX = ∮ P N dA: body force and tractions together pull nowhere."""
    forces = manufactured.exact_loads(SVK, supple.Mesh.box((2, 2, 2), (1, 1, 1), element), 8)
    assert abs(forces.sum(axis=0)).max() < 1e-8 * abs(forces).sum()


def test_a_body_under_the_exact_loads_finds_the_field():
    """P1 and SVK on the first meshes: rates 2 of u and 1 of E."""
    assert manufactured.run(SVK, "P1", (4, 6, 8)).miss <= manufactured.BAR


def test_a_wrong_parameter_is_noticed():
    """Loads of another stiffness than the body's: the errors stay where they are."""
    mesh = supple.Mesh.box((6, 6, 6), (1, 1, 1), "Q1")
    load = manufactured.exact_loads(SVK, mesh, 6)
    found = [
        supple.Body(mesh, SVK.material, quadrature=4, young=young, poisson=0.3)
        .fix(lambda x: x[:, 2] < 1e-9)
        .force(np.arange(len(mesh.points)), load)
        .solve()
        for young in (3e3, 2.9e3)
    ]
    U = manufactured.exact(mesh.points)[0]
    misses = [np.linalg.norm(state.u - U) / np.linalg.norm(U) for state in found]
    assert misses[0] < 0.01 < 0.03 < misses[1]


@pytest.mark.slow
@pytest.mark.parametrize(
    ("case", "element"), [pytest.param(c, e, id=f"{c.name}-{e}") for c, e in manufactured.plan()]
)
def test_rates_are_those_of_theory(case, element):
    """p + 1 of u and p of E within 0.1, from each of four meshes to the next."""
    series = manufactured.run(case, element)
    assert series.miss <= manufactured.BAR, manufactured.line(series)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("formulation", "element", "cells"),
    [("mixed", "P2", (4, 6)), ("mixed", "Q2L", (2, 4, 6)), ("mean-dilatation", "Q1", (8, 12))],
)
def test_other_formulations_are_no_slower_than_theory(formulation, element, cells):
    """The same loads and field; on these meshes faster, while the pressure's own error fades."""
    case = Case("mooney_rivlin", {"bulk": 5e3})
    series = manufactured.run(case, element, cells, formulation)
    u, strain = series.rates
    assert min(u) > series.degree + 1 - manufactured.BAR, manufactured.line(series)
    assert min(strain) > series.degree - manufactured.BAR, manufactured.line(series)


@pytest.mark.slow
def test_any_energy_file_can_be_put_through(tmp_path):
    file = tmp_path / "fibres.py"
    file.write_text(FIBRES, encoding="utf-8")
    case = Case(file, {"fibre": tuple(np.array([1.0, 2.0, 3.0]) / np.sqrt(14))})
    assert manufactured.run(case, "Q2", (6, 8, 10)).miss <= manufactured.BAR


@pytest.mark.parametrize(("bar", "code"), [(0.1, 0), (1e-6, 3)])
def test_the_study_writes_figures_and_a_table_and_exits_3_off_the_bar(
    tmp_path, monkeypatch, capsys, bar, code
):
    monkeypatch.setattr(manufactured, "CASES", (SVK,))
    monkeypatch.setattr(manufactured, "ELEMENTS", ("P1",))
    monkeypatch.setattr(manufactured, "FURTHER", ())
    monkeypatch.setattr(manufactured, "MESHES", {1: (4, 6, 8)})
    monkeypatch.setattr(manufactured, "BAR", bar)
    assert main(["study", "manufactured", "--out", str(tmp_path / "out")]) == code
    names = ["manufactured.png", "manufactured.svg", "result.json"]
    assert sorted(path.name for path in (tmp_path / "out").iterdir()) == names
    result = json.loads((tmp_path / "out" / "result.json").read_text(encoding="utf-8"))
    assert [row["passed"] for row in result["series"]] == [code == 0]
    assert ("not_trustworthy" in result) == (code == 3)
    assert "saint_venant_kirchhoff P1 1/8: u" in capsys.readouterr().out
