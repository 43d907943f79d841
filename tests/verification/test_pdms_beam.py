"""The silicone beam of thesis chapter 3: FEniCS' published field, the elastica, straight again."""

from __future__ import annotations

import json
from collections import defaultdict

import numpy as np
import pytest

from supple import ConvergenceError, InputError, Mesh
from supple.cli import main
from supple.studies import pdms_beam as pdms
from supple.studies import pdms_beam_figure, published_meshes
from supple.studies.elastica import bend
from supple.studies.pdms_beam_report import ROUND_BAR, STRAIGHT_BAR, checks, lines, table
from supple.studies.round_bar import round_bar, sections


@pytest.fixture(scope="module")
def beam2k(shared) -> Mesh:
    return published_meshes.beam2k(shared / "data")


def hung(mesh: Mesh, formulation: str = "mixed", **values: float):
    body = pdms.silicone(mesh, formulation, **values)
    return body, pdms.hang(body, bend(pdms.cantilever()))


def test_sections_of_a_prism_of_tetrahedra_are_its_polygon():
    """Twelve corners in the circle: area and second moment of a regular polygon, to rounding."""
    cut = sections(round_bar(0.182, pdms.RADIUS, 3, 4, "P1"), 7)
    area, moment = pdms.polygon(12)
    assert cut.area / pdms.AREA == pytest.approx(np.full(7, area), rel=1e-10)
    assert cut.moment / pdms.MOMENT == pytest.approx(np.full(7, moment), rel=1e-10)


@pytest.mark.parametrize("element", ["P2", "Q2", "Q2L"])
def test_curved_bars_have_the_volume_of_the_cylinder(element):
    """Parabolas through three points of the circle: the missing area falls as the 4th power."""
    whole = pdms.AREA * pdms.LENGTH
    miss = [1 - round_bar(pdms.LENGTH, pdms.RADIUS, n, 2, element).volume / whole for n in (2, 4)]
    assert miss[0] < 1e-3
    assert miss[0] / miss[1] == pytest.approx(16, rel=0.1)


def test_a_coarse_round_bar_hangs_as_the_elastica_and_comes_back_straight():
    """Q2L–Q1, 16 cells along: 0.5 mm from the elastica of E = 6 (c1 + c2), 1e-6 m from straight."""
    body, state = hung(round_bar(pdms.LENGTH, pdms.RADIUS, 2, 16, "Q2L"))
    u = state.u[pdms.axis_end(body.mesh)]
    reference = bend(pdms.cantilever())
    assert np.linalg.norm(u) == pytest.approx(reference.displacement, abs=ROUND_BAR)
    assert u[:2] == pytest.approx([reference.tip[0], -reference.tip[1]], abs=ROUND_BAR)
    assert pdms.straighten("round", body, state)[1].largest <= STRAIGHT_BAR


@pytest.mark.slow
def test_where_newton_starts_does_not_matter():
    """From the elastica's shape and from zero: the same equilibrium to 1e-9 m."""
    body, state = hung(round_bar(pdms.LENGTH, pdms.RADIUS, 2, 16, "Q2L"))
    assert np.abs(body.solve().u - state.u).max() < 1e-9


def test_linear_tetrahedra_lock():
    """P1 at a bulk modulus of 3000 times the shear modulus keeps the beam nearly straight."""
    body = pdms.silicone(round_bar(pdms.LENGTH, pdms.RADIUS, 2, 20, "P1"), "displacement")
    assert np.linalg.norm(body.solve().u, axis=1).max() < 0.05 * 0.1297


def test_the_printed_numbers_are_the_references(shared):
    """The study's constants are those of the reference numbers, as is the elastica."""
    known = json.loads((shared / "reference" / "references.json").read_text("utf-8"))["pdms_beam"]
    mm = known["tip_displacement_mm"]
    ours = {"experiment": pdms.EXPERIMENT, "FEniCS": pdms.FENICS, "Abaqus": pdms.ABAQUS,
            "SOFA": pdms.SOFA}  # fmt: skip
    assert {name: pytest.approx(1e3 * value) for name, value in ours.items()} == mm
    assert known["I1_bar_coefficient"] == pdms.C1
    assert known["I2_bar_coefficient"] == pdms.C2
    round_, faceted = (
        1e3 * bend(pdms.cantilever(area=a * pdms.AREA, moment=i * pdms.MOMENT)).displacement
        for a, i in ((1, 1), (0.944, 0.882))
    )
    assert (round_, faceted) == (pytest.approx(129.72, abs=0.01), pytest.approx(134.31, abs=0.05))


def test_the_mesh_of_the_thesis_has_the_sections_that_were_measured(beam2k):
    """Area 0.944 and second moment 0.882 of the round section, means along the beam."""
    cut = sections(beam2k)
    assert cut.area.mean() / pdms.AREA == pytest.approx(0.944, abs=1e-3)
    assert cut.moment.mean() / pdms.MOMENT == pytest.approx(0.882, abs=1e-3)
    assert cut.area.mean() * pdms.LENGTH == pytest.approx(beam2k.volume, rel=1e-3)


def test_another_mesh_or_study_is_refused(tmp_path):
    """A box of 1 m is no beam of 182 mm; other studies take no --data, no folder without it (2)."""
    with pytest.raises(InputError, match=r"0\.182 m"):
        pdms.given(Mesh.box((1, 1, 1), (1.0, 1.0, 1.0)))
    out = str(tmp_path / "out")
    folder = str(tmp_path)
    assert main(["study", "hanging-dome", "--data", folder, "--out", out]) == 2
    assert main(["study", "pdms-beam", "--data", folder, "--out", out]) == 2


def test_a_shortcut_that_finds_nothing_is_told_and_drawn_without(tmp_path, monkeypatch):
    """Where the beam under reversed gravity has no equilibrium, the study goes on."""
    straighten = pdms.straighten

    def lost(section, body, state, method="inverse"):
        if method != "inverse":
            raise ConvergenceError("lost")
        return straighten(section, body, state)

    monkeypatch.setattr(pdms, "straighten", lost)
    tip = pdms.Tip("round", "Q2L", "mixed", 965.0, 1e9, 3, (0.0, -0.1, 0.0), 0.1, 1, 0.0)
    monkeypatch.setattr(pdms, "variants", lambda: defaultdict(lambda: tip))
    outcome = pdms.run(plan=(("Q2L", "mixed", ((2, 8), (2, 10))),))
    assert np.isnan(outcome.inverses[1].largest)
    assert pdms_beam_figure.draw(outcome, tmp_path / "beam.png").stat().st_size > 1e4
    assert any("no equilibrium was found under the reversed load" in t for t in lines(outcome))


@pytest.mark.slow
def test_the_published_field_is_found_to_every_digit_with_its_own_quadrature(beam2k):
    """Largest |u| of the field that FEniCS wrote (P2–P1, degree 2, D (J - 1)²): 1e-10 m."""
    _, state = hung(beam2k.elevated(), density=pdms.SCRIPT_DENSITY, quadrature=2)
    largest = np.linalg.norm(state.u, axis=1).max()
    assert largest == pytest.approx(pdms.PUBLISHED_FIELD, abs=1e-10)


@pytest.mark.slow
def test_the_study_meets_its_bars(beam2k):
    """Tip within 0.5 mm of the elastica, last step < 0.1 mm, FEniCS within 0.3 mm, straight."""
    outcome = pdms.run(beam2k, plan=(("Q2L", "mixed", ((2, 20), (2, 40))),))
    assert [c for c in checks(outcome) if not c.passed and "refinement" not in c.name] == []
    assert len(checks(outcome)) == 5
    assert outcome.variants["bulk ten times"].size == pytest.approx(
        outcome.variants["as the study"].size, abs=2e-5
    )
    assert len(table(outcome).splitlines()) == 1 + 2 + 5 + 1
    assert any("Beam2k" in line for line in lines(outcome))
