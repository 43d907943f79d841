"""What the PDMS beam's study says: its tables, its bars, and why the printed numbers differ."""

from __future__ import annotations

import csv
import io
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from . import pdms_beam as pdms
from .elastica import bend
from .pdms_beam import Given, Inverse, Outcome, Tip

#: Bars, m: tip on Beam2k.msh, tip of the round bar, last refinement, inverse.
MESH_BAR, ROUND_BAR, STEP_BAR, STRAIGHT_BAR = 0.3e-3, 0.5e-3, 0.1e-3, 1e-6


@dataclass(frozen=True)
class Check:
    """A figure in m and the bar that it must not exceed."""

    name: str
    value: float
    bar: float

    @property
    def passed(self) -> bool:
        return self.value <= self.bar


def finest(outcome: Outcome) -> list[Tip]:
    """The last two bars of the first series, the coarser first."""
    first = outcome.tips[0]
    kind = (first.element, first.formulation)
    return [t for t in outcome.tips if (t.element, t.formulation) == kind][-2:]


def checks(outcome: Outcome) -> list[Check]:
    """Every bar of the study; that of Beam2k.msh only where this is the mesh given."""
    coarse, fine = finest(outcome)
    elastica = bend(pdms.cantilever()).displacement
    found = [
        Check("|u| of the round bar's tip against the elastica", abs(fine.size - elastica),
              ROUND_BAR),
        Check("last refinement's change of it", abs(fine.size - coarse.size), STEP_BAR),
    ]  # fmt: skip
    g = outcome.given
    if g is not None and g.published:
        miss = abs(g.tip.largest - pdms.PUBLISHED_FIELD)
        found.append(Check("largest |u| on Beam2k.msh against FEniCS", miss, MESH_BAR))
    straight = [i for i in (*outcome.inverses, *((g.back,) if g else ())) if i.method == "inverse"]
    name = "rest shape against the straight beam"
    return found + [Check(f"{name}, {i.section}", i.largest, STRAIGHT_BAR) for i in straight]


def table(outcome: Outcome) -> str:
    """One line a solve, CSV; lengths in mm."""
    head = (
        "section,element,formulation,density_kg_m3,bulk_pa,dofs,tip_mm,drop_mm,along_mm,largest_mm,"
        "iterations,processor_s"
    )
    tips = [*outcome.tips, *outcome.variants.values()]
    names = [""] * len(outcome.tips) + list(outcome.variants)
    if outcome.given:
        tips, names = [*tips, outcome.given.tip], [*names, ""]
    rows = [_row(t, name) for t, name in zip(tips, names, strict=True)]
    return "\n".join([head, *rows]) + "\n"


def _row(t: Tip, name: str) -> str:
    section = f"{t.section} ({name})" if name else t.section
    lengths = (t.size, -t.u[1], t.u[0], t.largest)
    cells = [f"{t.density:g}", f"{t.bulk:.4g}", str(t.dofs), *(f"{1e3 * v:.4f}" for v in lengths)]
    last = [str(t.iterations), f"{t.seconds:.2f}"]
    out = io.StringIO()
    csv.writer(out).writerow([section, t.element, t.formulation, *cells, *last])
    return out.getvalue().strip()


def printed(outcome: Outcome) -> list[tuple[str, float, str]]:
    """Published |u|, m, and what each is, in words with our own numbers."""
    fine, ways, theory = finest(outcome)[1], outcome.variants, bend(pdms.cantilever())
    soft = ways["bulk 1e7, as SOFA's"].size - ways["as the study"].size
    corners = [f"{1e3 * _polygon_tip(n):.2f} with {n}" for n in (12, 14, 16)]
    beam2k = "give its mesh with --data to compute it" if outcome.given is None else (
        f"{1e3 * outcome.given.tip.largest:.2f} here; its axis {1e3 * outcome.given.tip.size:.2f}"
    )  # fmt: skip
    places = np.array(pdms.EXPERIMENT_TIP) - [pdms.LENGTH, 0.0]
    return [
        ("experiment", pdms.EXPERIMENT,
         f"|u|, no drop: the published scene has the measured tip {1e3 * places[1]:.2f} mm below "
         f"and {-1e3 * places[0]:.0f} mm short, |u| = {1e3 * np.hypot(*places):.1f}; the round bar "
         f"has {1e3 * fine.size:.2f}, a drop of {-1e3 * fine.u[1]:.2f}"),
        ("elastica, round", theory.displacement,
         f"E = 6 (c1 + c2), 965 kg/m³; with stretch and shear "
         f"{1e3 * bend(pdms.cantilever(thick=True)).displacement:.2f}; the clamp, which keeps the "
         f"root's breadth, takes {_less(ways, 'clamp free to shrink'):.2f} off"),
        ("FEniCS field on Beam2k", pdms.PUBLISHED_FIELD,
         f"largest |u| of all nodes, 963 kg/m³; {beam2k}"),
        ("FEniCS", pdms.FENICS,
         "between the round bar and Beam2k.msh, so most likely another faceted mesh, which is not "
         f"named; the elastica of regular polygons in the circle: {', '.join(corners)} corners"),
        ("Abaqus", pdms.ABAQUS,
         "as FEniCS', 0.2 mm away: the 0.14 mm between 963 and 965 kg/m³ would be most of it"),
        ("SOFA", pdms.SOFA,
         f"linear tetrahedra, bulk modulus 1e7 Pa, which adds {1e3 * soft:.2f} mm, on ever "
         "finer meshes: published fields 110.7, 114.1, 120.3, 123.7 mm, from below towards "
         f"{1e3 * (fine.size + soft + _lighter(ways)):.1f} mm"),
    ]  # fmt: skip


def _less(ways: dict[str, Tip], name: str) -> float:
    return 1e3 * (ways[name].size - ways["as the study"].size)


def _lighter(ways: dict[str, Tip]) -> float:
    return ways["density 963"].size - ways["as the study"].size


def _polygon_tip(corners: int) -> float:
    area, moment = pdms.polygon(corners)
    bar = pdms.cantilever(area=area * pdms.AREA, moment=moment * pdms.MOMENT)
    return bend(bar).displacement


def lines(outcome: Outcome) -> list[str]:
    """The study for people, mm."""
    said = [f"{_name(t)}: |u| {1e3 * t.size:.2f}, {t.dofs} dofs, {t.iterations} iterations, "
            f"{t.seconds:.1f} s" for t in outcome.tips]  # fmt: skip
    said += [f"round, {name}: |u| {1e3 * t.size:.2f}" for name, t in outcome.variants.items()]
    g = outcome.given
    said += _given(g) if g else ["Beam2k.msh was not given (--data): round bars only."]
    inverses = [*outcome.inverses, *((g.back,) if g else ())]
    said += [f"{_inverse(i)}; {i.iterations} iterations, {i.seconds:.1f} s" for i in inverses]
    said += [f"{name}, {1e3 * value:.2f} mm: {why}." for name, value, why in printed(outcome)]
    return [*said, imaged()]


def _name(t: Tip) -> str:
    return f"{t.section} {t.element} {t.formulation}"


def _inverse(i: Inverse) -> str:
    if np.isnan(i.largest):
        return f"{i.section}, {i.method}: no equilibrium was found under the reversed load"
    return f"{i.section}, {i.method}: largest distance from the straight beam {i.largest:.1e} m"


def _given(g: Given) -> list[str]:
    area, moment = g.sections.area.mean() / pdms.AREA, g.sections.moment.mean() / pdms.MOMENT
    return [
        f"given mesh: area {area:.3f}, second moment {moment:.3f} of the round section (means); "
        f"elastica {1e3 * g.stiffer.displacement:.2f}, with stretch and shear "
        f"{1e3 * g.theory.displacement:.2f}, P2–P1 {1e3 * g.tip.size:.2f} on the axis, "
        f"{1e3 * g.tip.largest:.2f} at most, {g.tip.dofs} dofs, {g.tip.iterations} iterations"
    ]


def imaged() -> str:
    """The thesis' 5.36 mm by beam theory."""
    rest = pdms.unbent_experiment(pdms.FENICS)
    s = np.linspace(0.0, pdms.LENGTH, len(rest.x))
    far = 1e3 * np.hypot(rest.x - s, rest.drop)
    return (
        "thesis, inverse from the imaged shape, 5.36 mm: not the inverse's error but the model's: "
        "a model that hangs to 132.52 mm makes a bar that hangs to 127.68 mm rest bent upwards, "
        f"by {far[-1]:.1f} mm at the tip and {far.mean():.1f} mm in the mean (beam theory)."
    )


def result(outcome: Outcome) -> dict[str, Any]:
    """For result.json: lengths in m."""
    bars = {c.name: {"value": c.value, "bar": c.bar, "passed": c.passed} for c in checks(outcome)}
    g = outcome.given
    return {
        "checks": bars,
        "round_tip_m": finest(outcome)[1].size,
        "elastica_m": bend(pdms.cantilever()).displacement,
        "given_mesh": None if g is None else {"tip_m": g.tip.size, "largest_m": g.tip.largest},
        "inverse": [asdict(i) for i in (*outcome.inverses, *((g.back,) if g else ()))],
        "printed": {name: {"m": value, "why": why} for name, value, why in printed(outcome)},
    }
