"""A hanging dome under gravity: rest shape, back again, and turned over, with and without skin.

    dome → body → rest shape → prone again → supine → table and figure

The dome is the prone shape: z ≤ 6 mm + (depth - 6 mm) sqrt(1 - (r / 65 mm)²) over a clamped base
z = 0; prone gravity is +z, supine -z; neo-Hookean, ν = 0.45, 1000 kg/m³, 4,800 P1 tetrahedra; a
skin of 2 mm on all but the base. The depths to compare with were found with DOLFINx.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from ..body import Body
from ..errors import ConvergenceError
from ..files import replacing
from ..mesh import Mesh, Tag

if TYPE_CHECKING:
    from ..newton import Progress

RADIUS, RIM, GRAVITY = 0.065, 0.006, 9.81


@dataclass(frozen=True)
class Case:
    """One dome; lengths in m, moduli in Pa; depths of rest and supine by DOLFINx, None: no rest."""

    depth: float
    young: float
    skin_young: float
    rest: float | None
    supine: float | None


CASES = (
    Case(0.080, 3000.0, 0.0, 0.075, 0.070),
    Case(0.080, 1000.0, 0.0, 0.066, 0.056),
    Case(0.080, 600.0, 0.0, 0.058, 0.046),
    Case(0.080, 1000.0, 22700.0, 0.069, 0.060),
    Case(0.080, 600.0, 5000.0, 0.060, 0.049),
    Case(0.080, 320.0, 22700.0, None, None),
)


@dataclass(frozen=True)
class Outcome:
    """What was found: depths and round trip in m; ``reached`` of gravity where there is no rest."""

    case: Case
    rest: float | None
    supine: float | None
    round_trip: float | None
    reached: float


def dome(depth: float, cells: tuple[int, int, int] = (10, 10, 8)) -> Mesh:
    """The dome's mesh, m, with the facet tag "skin": a box whose square is mapped onto the disk."""
    box = Mesh.box(cells, (2.0, 2.0, 1.0), "P1", origin=(-1.0, -1.0, 0.0))
    s, t, level = box.points.T
    x, y = s * np.sqrt(1 - t**2 / 2), t * np.sqrt(1 - s**2 / 2)
    radius = np.minimum(np.hypot(x, y), 1.0)
    height = RIM + (depth - RIM) * np.sqrt(1 - radius**2)
    points = np.column_stack([x * RADIUS, y * RADIUS, level * height])
    facets = box.boundary()
    skin = facets[(points[facets, 2] > 1e-9).any(axis=1)]
    return Mesh(points, box.cells, "P1", {"skin": Tag("facets", skin)})


def body(case: Case, mesh: Mesh) -> Body:
    """The dome under prone gravity."""
    made = Body(mesh, "neo_hookean", density=1000.0, young=case.young, poisson=0.45)
    made.fix(lambda x: x[:, 2] < 1e-9).gravity((0.0, 0.0, GRAVITY))
    if case.skin_young:
        made.skin("skin", "neo_hookean", thickness=2e-3, young=case.skin_young)
    return made


def run(case: Case, progress: Progress | None = None) -> Outcome:
    """Prone → rest → prone again → supine."""
    mesh = dome(case.depth)
    prone = body(case, mesh)
    try:
        rest = prone.rest_shape(progress=progress)
    except ConvergenceError as failure:
        return Outcome(case, None, None, None, failure.load_factor)
    resting = prone.on(rest.mesh)
    again = resting.solve(progress=progress)
    supine = resting.gravity((0.0, 0.0, -GRAVITY)).solve(progress=progress)
    trip = float(np.abs(again.points - mesh.points).max())
    return Outcome(
        case, float(rest.points[:, 2].max()), float(supine.points[:, 2].max()), trip, 1.0
    )


def write(outcomes: list[Outcome], folder: Path) -> list[Path]:
    """hanging_dome.csv and hanging_dome.svg: depths found, and by DOLFINx, in mm."""
    folder.mkdir(parents=True, exist_ok=True)
    table, figure = folder / "hanging_dome.csv", folder / "hanging_dome.svg"
    with replacing(table) as aside:
        aside.write_text(_csv(outcomes), encoding="utf-8")
    with replacing(figure) as aside:
        _draw(outcomes, aside)
    return [table, figure]


def _csv(outcomes: list[Outcome]) -> str:
    head = "depth_mm,young_pa,skin_young_pa,rest_mm,rest_dolfinx_mm,supine_mm,supine_dolfinx_mm,"
    lines = [head + "round_trip_m,gravity_reached"]
    for o in outcomes:
        c = o.case
        depths = [_mm(v) for v in (o.rest, c.rest, o.supine, c.supine)]
        trip = "" if o.round_trip is None else f"{o.round_trip:.1e}"
        start = f"{1e3 * c.depth:g},{c.young:g},{c.skin_young:g}"
        lines.append(",".join([start, *depths, trip, f"{o.reached:.3f}"]))
    return "\n".join(lines) + "\n"


def _mm(metres: float | None) -> str:
    return "" if metres is None else f"{1e3 * metres:.1f}"


def _draw(outcomes: list[Outcome], path: Path) -> None:
    from matplotlib.figure import Figure

    figure = Figure(figsize=(8, 4.5), layout="constrained")
    axes = figure.add_subplot()
    names = [f"{o.case.young / 1e3:g} kPa\nskin {o.case.skin_young / 1e3:g} kPa" for o in outcomes]
    places = np.arange(len(outcomes))
    axes.plot(places, [1e3 * o.case.depth for o in outcomes], "_k", ms=24, label="prone (given)")
    for field, colour in (("rest", "tab:blue"), ("supine", "tab:orange")):
        found = [1e3 * (getattr(o, field) or np.nan) for o in outcomes]
        other = [1e3 * (getattr(o.case, field) or np.nan) for o in outcomes]
        axes.plot(places, found, "o", color=colour, label=f"{field}, Supple")
        axes.plot(places, other, "s", mfc="none", ms=11, color=colour, label=f"{field}, DOLFINx")
    for place, o in enumerate(outcomes):
        if o.rest is None:
            text = f"no rest shape:\nends at {100 * o.reached:.0f} %\nof gravity"
            axes.text(place, 55, text, ha="center", fontsize=8)
    axes.set(ylabel="depth of the dome, mm", xlabel="E of the tissue, E of the skin")
    axes.set_xticks(places, names)
    axes.set(xlim=(-0.5, len(outcomes) - 0.4), ylim=(30, 85))
    axes.legend(ncols=3, loc="lower center", fontsize=8)
    axes.set_title("Hanging dome: prone shape → rest shape → supine shape")
    figure.savefig(path, format="svg")
