"""`make bench`: what a rest shape costs beside a forward solve of the same body and load.

    cases → forward, inverse, Anderson–Sellier, in turn → check → rest_shape.md and .json in --out

Each time is the wall time of `solve` or `rest_shape` of a new body, kernels compiled before: the
symbolic analysis counts. Ratios are medians of the ratios within a round, so that a busy machine
slows both sides. A rest shape is checked before it is timed: loaded again it is the mesh, to 1e-9.
"""

from __future__ import annotations

import os
import statistics
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
import output
from bodies import block, cantilever

import supple

#: Case → body. Cantilever: the benchmark's, 80 × 15 × 15 m under a dead traction on its end. Block:
#: a cube of 0.1 m and 1 kPa on its base, leaning under its weight.
CASES: dict[str, Callable[[], supple.Body]] = {
    "cantilever P1, 10,000": lambda: cantilever("P1", (44, 8, 8)),
    "cantilever P2, 10,000": lambda: cantilever("P2", (15, 5, 5)),
    "cantilever mixed, 10,000": lambda: cantilever("P2", (15, 5, 5), mixed=True),
    "block P1, 10,000": lambda: block(14, "P1"),
    "block P2, 10,000": lambda: block(7, "P2"),
    "block mixed, 10,000": lambda: block(7, "P2", mixed=True),
}
LARGE: dict[str, Callable[[], supple.Body]] = {
    "cantilever P1, 100,000": lambda: cantilever("P1", (95, 18, 18)),
    "cantilever P2, 100,000": lambda: cantilever("P2", (46, 9, 9)),
}
#: Most that the inverse may cost, in forward solves: by dofs and formulation.
BARS = {"10,000": 1.3, "100,000": 2.0, "mixed": 2.0}
#: The inverse misses by 1e-14 of the size when loaded again; a fixed point of solves to rtol 1e-10
#: comes to 1e-11 or so.
ANDERSON: dict[str, Any] = {"method": "sellier-anderson", "tolerance": 1e-11}


@dataclass(frozen=True)
class Row:
    """Medians of one case: seconds, and ratios within a round; strain is max |stretch - 1|."""

    case: str
    dofs: int
    strain: float
    forward_s: float
    inverse_s: float
    anderson_s: float | None
    ratio: float
    bar: float
    anderson_ratio: float | None
    iterations: tuple[int, int]
    factorisations: tuple[int, int]
    krylov_iterations: int


def timed(call: Callable[[], Any]) -> tuple[float, Any]:
    """Wall seconds and the result."""
    begin = time.perf_counter()
    result = call()
    return time.perf_counter() - begin, result


def measure(case: str, make: Callable[[], supple.Body], repeats: int, anderson: bool) -> Row:
    """Forward, inverse and Anderson–Sellier in turn, after the inverse was checked."""
    body = make()
    error = supple.round_trip(body.rest_shape(), near=True).relative
    if error > 1e-9:
        sys.exit(f"{case}: loaded again, the rest shape misses by {error:.1e} > 1e-9; not timed")
    times: list[tuple[float, float, float]] = []
    for _ in range(repeats):
        forward, state = timed(make().solve)
        inverse, rest = timed(make().rest_shape)
        fixed_point = float("nan")
        if anderson:
            fixed_point, other = timed(partial(make().rest_shape, **ANDERSON))
            away = abs(other.points - rest.points).max() / body.mesh.size
            if away > 1e-9:
                sys.exit(f"{case}: Anderson–Sellier is off by {away:.1e}, more than 1e-9")
            del other
        times.append((forward, inverse, fixed_point))
    stretches = np.linalg.svd(rest.deformation_gradient(), compute_uv=False)
    bar = BARS["mixed" if "mixed" in case else case.split(", ")[1]]
    return Row(
        case,
        body.mesh.points.size,
        float(abs(stretches - 1).max()),
        statistics.median(t[0] for t in times),
        statistics.median(t[1] for t in times),
        statistics.median(t[2] for t in times) if anderson else None,
        statistics.median(t[1] / t[0] for t in times),
        bar,
        statistics.median(t[2] / t[1] for t in times) if anderson else None,
        (state.iterations, rest.iterations),
        (int(state.timings["factorisations"]), int(rest.timings["factorisations"])),
        int(rest.timings["krylov_iterations"]),
    )


def table(rows: list[Row], machine: str) -> str:
    """Markdown."""
    lines = [
        "# The rest shape beside a forward solve",
        "",
        machine,
        "",
        "Wall seconds of a cold call; forward → inverse for iterations and factorisations. "
        "Bars: **ratio** as given, Anderson–Sellier over inverse at least 5.",
        "",
        "| case | dofs | strain | forward | inverse | **ratio** | bar | iterations | "
        "factorisations | GMRES | Anderson–Sellier | over inverse |",
        "|---|---|---|---|---|---|---|---|---|---|---|---|",
    ]
    for r in rows:
        other, times = "–", "–"
        if r.anderson_s is not None and r.anderson_ratio is not None:
            other, times = f"{r.anderson_s:.2f}", f"{r.anderson_ratio:.1f}"
        lines.append(
            f"| {r.case} | {r.dofs} | {r.strain:.2f} | {r.forward_s:.2f} | {r.inverse_s:.2f} | "
            f"**{r.ratio:.2f}** | {r.bar} | {r.iterations[0]} → {r.iterations[1]} | "
            f"{r.factorisations[0]} → {r.factorisations[1]} | {r.krylov_iterations} | "
            f"{other} | {times} |"
        )
    return "\n".join(lines) + "\n"


def main() -> None:
    """Measure and write."""
    parser = output.options(__doc__, repeats=3)
    parser.add_argument("--skip-large", action="store_true", help="leave out 100,000 dofs")
    given = parser.parse_args()
    load = os.getloadavg()[0]
    rows = [measure(case, make, given.repeats, True) for case, make in CASES.items()]
    if not given.skip_large:
        rows += [measure(case, make, 1, False) for case, make in LARGE.items()]
    machine = output.machine(load, f"{given.repeats} repeats, `make bench`")
    output.write(given.out, "rest_shape", table(rows, machine), machine, rows)


if __name__ == "__main__":
    main()
