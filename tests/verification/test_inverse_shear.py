"""Sheared cubes taken back: closed forms checked by hand-made ones, then the cube and the rates.

Independent answers: σ and b written out entry by entry in γ (those of test_shear.py), the cube.
"""

from __future__ import annotations

import csv
import json

import numpy as np
import pytest

import supple
from supple.cli import main
from supple.studies import inverse_shear, inverse_shear_table
from supple.studies.inverse_shear import C1, C2, LAMBDA, LAWS, MU, Case

TOP = LAMBDA / 2 + MU
#: By hand: (σ11, σ22, σ33, σ12) at γ, and (∂σ12/∂γ, ∂σ22/∂γ), Pa.
BY_HAND = {
    "neo_hookean": (lambda g: (MU * g**2, 0, 0, MU * g), lambda g: (MU, 0)),
    "saint_venant_kirchhoff": (
        lambda g: (
            (TOP + MU) * g**2 + TOP * g**4, TOP * g**2, LAMBDA * g**2 / 2, MU * g + TOP * g**3,
        ),
        lambda g: (MU + 3 * TOP * g**2, 2 * TOP * g),
    ),
    "mooney_rivlin": (
        lambda g: (
            (4 * C1 + 2 * C2) / 3 * g**2, -(2 * C1 + 4 * C2) / 3 * g**2, 2 * (C2 - C1) / 3 * g**2,
            2 * (C1 + C2) * g,
        ),
        lambda g: (2 * (C1 + C2), -4 / 3 * (C1 + 2 * C2) * g),
    ),
}  # fmt: skip


@pytest.mark.parametrize("law", LAWS)
@pytest.mark.parametrize("kind", ["simple", "generalised"])
def test_stress_and_body_force_are_those_found_by_hand(law, kind):
    case, y = Case(kind, 0.7, law, "P2", 1), np.linspace(0.1, 1, 5)
    gamma, bend = (0.7, 0.0) if kind == "simple" else (1.4 * y, 1.4)
    stress, slope = BY_HAND[law]
    sigma = case.stress(y)
    for found, expected in zip(
        (sigma[:, 0, 0], sigma[:, 1, 1], sigma[:, 2, 2], sigma[:, 0, 1]), stress(gamma), strict=True
    ):
        np.testing.assert_allclose(found, np.broadcast_to(expected, 5), rtol=1e-12, atol=1e-9)
    b = case.body_force(y)
    for found, expected in zip(b.T, (*slope(gamma), 0.0), strict=True):
        np.testing.assert_allclose(found, np.broadcast_to(-bend * np.asarray(expected), 5),
                                   rtol=1e-12, atol=1e-9)  # fmt: skip


@pytest.mark.parametrize("element", inverse_shear_table.ELEMENTS)
def test_tractions_reactions_and_body_force_balance(element):
    """∮ t da + ∫ b dv = 0 with closed-form t on every face: the nodal forces' sum is ∫ b dv."""
    case = Case("generalised", 0.6, "saint_venant_kirchhoff", element, 2)
    cube = supple.Mesh.box((2, 2, 2), (1.0, 1.0, 1.0), element)
    sheared = cube.moved(cube.points + case.displacement(cube.points))
    total = inverse_shear.nodal_forces(case, sheared).sum(axis=0)
    # Faces X = 0 and 1 cancel, for σ and the normal n da = cof(F) e1 depend on Y alone.
    ends = case.stress(np.array([0.0, 1.0]))[:, :, 1]
    np.testing.assert_allclose(total, -(ends[1] - ends[0]), rtol=1e-12, atol=1e-9)


@pytest.mark.parametrize("element", ["P1", "Q1"])
@pytest.mark.parametrize("gamma", [0.2, 1.0])
def test_the_cube_comes_back_from_simple_shear(element, gamma):
    for law in ("neo_hookean", "mooney_rivlin"):
        found = inverse_shear.run(Case("simple", gamma, law, element, 2))
        assert max(found.place, found.stress) <= inverse_shear_table.BAR


def test_a_wrong_traction_is_noticed(monkeypatch):
    """Tractions and body force of a law 1 % stiffer: the cube is missed by about as much."""
    case = Case("simple", 0.5, "neo_hookean", "P1", 2)
    stiff = inverse_shear.Law(LAWS[case.law].values, lambda F: 1.01 * exact(F))
    exact = LAWS[case.law].stress
    monkeypatch.setitem(LAWS, case.law, stiff)
    assert 1e-4 < inverse_shear.run(case).place < 0.05


def test_the_plan_has_every_law_and_element_in_both_shears():
    plan = inverse_shear_table.plan()
    assert {(c.law, c.element) for c in plan} == {
        (law, element) for law in LAWS for element in inverse_shear_table.ELEMENTS
    }
    assert {c.kind for c in plan if c.is_in_space} == {"simple", "generalised"}
    assert len(set(plan)) == len(plan)
    assert {c.element for c in plan if not c.is_in_space} == {"P1", "Q1"}


def test_misses_tell_an_error_above_the_bar_and_a_wrong_rate():
    exact = Case("simple", 0.2, "neo_hookean", "P1", 2)
    finer = [Case("generalised", 0.3, "mooney_rivlin", "P1", n) for n in (4, 8)]
    good = [inverse_shear.Outcome(exact, 1e-14, 1e-14, 3)]
    good += [inverse_shear.Outcome(c, c.cells**-2.0, 1 / c.cells, 3) for c in finer]
    assert inverse_shear_table.misses(good) == []
    bad = [inverse_shear.Outcome(exact, 1e-14, 1e-11, 3)]
    bad += [inverse_shear.Outcome(c, c.cells**-1.5, 1 / c.cells, 3) for c in finer]
    words = inverse_shear_table.misses(bad)
    assert len(words) == 2
    assert "1.0e-11" in words[0]
    assert "1.50" in words[1]


@pytest.mark.parametrize(("bar", "code"), [(1e-12, 0), (0.0, 3)])
def test_the_study_writes_its_table_and_exits_3_beyond_the_bar(tmp_path, monkeypatch, bar, code):
    cases = [c for c in inverse_shear_table.plan() if (c.law, c.element) == ("mooney_rivlin", "P1")]
    monkeypatch.setattr(inverse_shear_table, "plan", lambda: [c for c in cases if c.cells < 12])
    monkeypatch.setattr(inverse_shear_table, "RATE_BAR", 0.3)
    monkeypatch.setattr(inverse_shear_table, "BAR", bar)
    assert main(["study", "inverse-shear", "--out", str(tmp_path / "out")]) == code
    names = {"inverse_shear.csv", "inverse_shear.png", "inverse_shear.svg", "result.json"}
    assert {p.name for p in (tmp_path / "out").iterdir()} == names
    with (tmp_path / "out" / "inverse_shear.csv").open(encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    assert [row["cells_per_edge"] for row in rows] == ["2", "2", "2", "4", "8"]
    assert float(rows[-1]["stress_rate"]) == pytest.approx(1, abs=0.1)
    result = json.loads((tmp_path / "out" / "result.json").read_text(encoding="utf-8"))
    assert ("not_trustworthy" in result) == (code == 3)


@pytest.mark.slow
def test_every_case_of_the_study_meets_its_bar():
    """48 cases to 1e-12, the others at rates 1 of σ and 2 of the nodes within 0.1."""
    outcomes = [inverse_shear.run(case) for case in inverse_shear_table.plan()]
    assert sum(o.case.is_in_space for o in outcomes) == 48
    assert inverse_shear_table.misses(outcomes) == []
