"""`make bench`: Newton's cost on the benchmark cantilever, after its answer is checked.

    cases → solve, several times, interleaved → check the tip → results.md and .json in --out

Box 80 × 15 × 15 m clamped at x = 0, dead traction (0, -10, 0) Pa on x = 80, E = 3 kPa, ν = 0.3, one
load step from zero to 1e-10. The tips are DOLFINx 0.11's and FEBio 4's, which agree to 6 digits.
Times are medians of the repeats and count only beside another code's in the same run on the same
machine.
"""

from __future__ import annotations

import os
import statistics
import sys
from dataclasses import dataclass

import numpy as np
import output

import supple

LENGTH, WIDTH = 80.0, 15.0
DIVISIONS = {"P1": (44, 8, 8), "P2": (17, 5, 5), "Q1": (44, 8, 8), "Q2": (29, 5, 5)}
#: Tip displacement, m, where a node lies at the centre of the loaded face.
TIPS = {
    ("P1", "neo_hookean"): (-5.027239479839573, -25.920530984672247, 0.4953677980656953),
    ("P1", "saint_venant_kirchhoff"): (
        -5.2047873497470585,
        -25.893187570205303,
        0.5027476127170587,
    ),
    ("P2", "neo_hookean"): (-5.586975440050646, -27.254294299844197, 0.0015302842010909254),
    ("Q1", "neo_hookean"): (-5.512033333523699, -27.084478157560234, 0.0),
    ("Q1", "saint_venant_kirchhoff"): (-5.710078330369014, -27.090858781927068, 0.0),
    ("Q2", "neo_hookean"): None,
}


@dataclass(frozen=True)
class Row:
    """Medians over the repeats, ms a Newton iteration."""

    element: str
    law: str
    dofs: int
    iterations: int
    tip_error: float | None
    assembly_ms: float
    factor_ms: float
    solve_ms: float
    total_ms: float


def solve(element: str, law: str) -> tuple[supple.State, float | None]:
    """One cold solve, and the relative error of its tip where that is known."""
    mesh = supple.Mesh.box(DIVISIONS[element], (LENGTH, WIDTH, WIDTH), element)
    body = supple.Body(mesh, law, young=3e3, poisson=0.3)
    body.fix(lambda x: x[:, 0] < 1e-9).traction(
        lambda x: x[:, 0] > LENGTH - 1e-9, (0.0, -10.0, 0.0)
    )
    state = body.solve(load_steps=1)
    tip = TIPS[element, law]
    if tip is None:
        return state, None
    node = np.linalg.norm(mesh.points - [LENGTH, WIDTH / 2, WIDTH / 2], axis=1).argmin()
    return state, float(np.linalg.norm(state.u[node] - tip) / np.linalg.norm(tip))


def measure(repeats: int) -> list[Row]:
    """All cases in turn, ``repeats`` times, after one round that warms up and checks."""
    errors, states = {}, {key: [] for key in TIPS}
    for round_number in range(repeats + 1):
        for key in TIPS:
            state, errors[key] = solve(*key)
            if errors[key] is not None and errors[key] > 1e-6:
                sys.exit(f"{key}: the tip is off by {errors[key]:.1e}, more than 1e-6; not timed")
            if round_number:
                states[key].append(state)
    return [row(key, errors[key], states[key]) for key in TIPS]


def row(key: tuple[str, str], error: float | None, states: list[supple.State]) -> Row:
    """Medians of one case."""

    def median(phase: str) -> float:
        return statistics.median(1e3 * s.timings[phase] / s.iterations for s in states)

    phases = [median(p) for p in ("assembly", "factor", "solve", "total")]
    return Row(*key, states[0].u.size, states[0].iterations, error, *phases)


def table(rows: list[Row], machine: str) -> str:
    """Markdown."""
    lines = [
        "# Newton on the benchmark cantilever",
        "",
        machine,
        "",
        "Phases in ms per iteration.",
        "",
        "| element, law | dofs | iterations | tip error | assembly | factor | solve | total |",
        "|---|---|---|---|---|---|---|---|",
    ]
    for r in rows:
        error = "–" if r.tip_error is None else f"{r.tip_error:.0e}"
        lines.append(
            f"| {r.element} {r.law} | {r.dofs} | {r.iterations} | {error} | {r.assembly_ms:.1f} | "
            f"{r.factor_ms:.1f} | {r.solve_ms:.1f} | **{r.total_ms:.1f}** |"
        )
    return "\n".join(lines) + "\n"


def main() -> None:
    """Measure and write."""
    given = output.options(__doc__, repeats=5).parse_args()
    load = os.getloadavg()[0]
    rows = measure(given.repeats)
    machine = output.machine(load, f"{given.repeats} repeats, `make bench`")
    output.write(given.out, "results", table(rows, machine), machine, rows)


if __name__ == "__main__":
    main()
