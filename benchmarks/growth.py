"""From 1,000 to 1,000,000 dofs: time of each phase, memory, iterations; by factor and multigrid.

    sizes × solvers, each in a process of its own → growth.md, .json, .svg, .png in --out

A cube of P1 tetrahedra, neo-Hookean, on its base, leaning under its weight. A solver's sizes end at
its --largest, or after the first solve that took longer than --seconds. Exponents are fitted to
the sizes from 10,000 dofs on.
"""

from __future__ import annotations

import argparse
import json
import os
import resource
import subprocess
import sys
import time
from dataclasses import dataclass
from typing import Any

import bodies
import growth_figure
import linear
import numpy as np
import output

import supple
from supple import assembly
from supple.core import core

#: Cells along an edge: 1,029, 3,000, 10,125, 31,944, 98,304, 311,052 and 1,029,000 dofs.
EDGES = (6, 9, 14, 21, 31, 46, 69)
SOLVERS = ("direct", "multigrid")
PHASES = ("mesh", "pattern", "analysis", "assembly", "factor", "solve", "total")
FITTED_FROM = 10_000


@dataclass(frozen=True)
class Row:
    """One solve: seconds by phase, those of all threads, MB at most, iterations."""

    solver: str
    dofs: int
    mesh: float
    pattern: float
    analysis: float
    assembly: float
    factor: float
    solve: float
    total: float
    cpu: float
    megabytes: float
    iterations: int
    krylov_iterations: int
    factorisations: int


def one(solver: str, cells: int) -> dict[str, Any]:
    """Solve one size in this process, after a tiny one that imports; or say why not."""
    try:
        bodies.block(2).solve(solver=solver)
    except supple.InputError as problem:
        return {"skip": str(problem)}
    begin = time.perf_counter()
    body = bodies.block(cells)
    meshed = time.perf_counter() - begin
    begin, cpu = time.perf_counter(), time.process_time()
    state = body.solve(solver=solver)
    solved, cpu = time.perf_counter() - begin, time.process_time() - cpu
    megabytes = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    pattern = pattern_seconds(bodies.block(cells))
    analysis = analysis_seconds(body) if solver == "direct" else 0.0
    t = state.timings
    row = Row(solver, body.mesh.points.size, meshed, pattern, analysis, t["assembly"],
              max(t["factor"] - analysis, 0.0), t["solve"], meshed + solved, cpu, megabytes,
              state.iterations, int(t["krylov_iterations"]), int(t["factorisations"]))  # fmt: skip
    return vars(row)


def pattern_seconds(body: supple.Body) -> float:
    """Of pattern and scatter maps, which `solve` makes too: a first tangent beside a second."""
    system = assembly.system(body).system
    u = np.zeros(body.mesh.points.size)
    first, second = (linear.milliseconds(system.tangent, u) for _ in range(2))
    return max(first - second, 0.0) / 1e3


def analysis_seconds(body: supple.Body) -> float:
    """Of the symbolic analysis, which `solve` counts as part of the factor; done once more."""
    pattern, _ = linear.reduced(body)
    return linear.milliseconds(core().Cholesky().analyse, pattern) / 1e3


def measure(largest: dict[str, int], seconds: float) -> tuple[list[Row], list[str]]:
    """All sizes of all solvers; what was left out, and why."""
    rows, left_out = [], []
    for solver in SOLVERS:
        for edge in EDGES:
            dofs = 3 * (edge + 1) ** 3
            if dofs > largest[solver]:
                left_out.append(f"{solver} from {dofs:,} dofs on: --largest")
                break
            command = [sys.executable, __file__, "--one", solver, str(edge)]
            done = subprocess.run(command, capture_output=True, text=True, check=False)
            if done.returncode:
                words = done.stderr.strip().splitlines() or [f"status {done.returncode}"]
                left_out.append(f"{solver} from {dofs:,} dofs on: {words[-1]}")
                break
            answer = json.loads(done.stdout)
            if "skip" in answer:
                left_out.append(f"{solver}: {answer['skip']}")
                break
            rows.append(Row(**answer))
            if rows[-1].total > seconds:
                left_out.append(f"{solver} beyond {dofs:,} dofs: took more than {seconds:.0f} s")
                break
    return rows, left_out


def exponents(rows: list[Row]) -> dict[str, float]:
    """p of time ~ dofsᵖ by phase, and of the memory, in least squares of the logarithms."""
    kept = [r for r in rows if r.dofs >= FITTED_FROM]
    if len(kept) < 2:
        return {}
    x = np.log([r.dofs for r in kept])
    found = {}
    for name in (*PHASES, "cpu", "megabytes"):
        y = np.array([getattr(r, name) for r in kept])
        if (y > 0).all():
            found[name] = float(np.polyfit(x, np.log(y), 1)[0])
    return found


def table(rows: list[Row], machine: str, left_out: list[str]) -> str:
    """Markdown."""
    head = (
        "solver",
        "dofs",
        *PHASES,
        "µs a dof",
        "CPU of the solve",
        "peak MB",
        "Newton",
        "Krylov",
        "factorisations",
    )
    body: list[tuple[Any, ...]] = []
    for solver in SOLVERS:
        own = [r for r in rows if r.solver == solver]
        body += [cells_of(r) for r in own]
        p = exponents(own)
        if p:
            cells = {name: f"**{power:.2f}**" for name, power in p.items()}
            phases = (cells.get(name) for name in PHASES)
            rest = (None, cells.get("cpu"), cells.get("megabytes"), None, None, None)
            body.append((solver, "exponent", *phases, *rest))
    lines = ["# Growth", "", machine, "", "Seconds.", "", *output.markdown(head, body), "",
             "![Growth](growth.svg)"]  # fmt: skip
    lines += [f"\nNot measured: {reason}" for reason in left_out]
    return "\n".join(lines) + "\n"


def cells_of(r: Row) -> tuple[Any, ...]:
    """One row of the table."""
    phases = (output.digits(getattr(r, p)) for p in PHASES)
    each, cpu = output.digits(1e6 * r.total / r.dofs), output.digits(r.cpu)
    counts = (r.iterations, r.krylov_iterations, r.factorisations)
    return r.solver, f"{r.dofs:,}", *phases, each, cpu, f"{r.megabytes:.0f}", *counts


def options() -> argparse.ArgumentParser:
    """What may be given."""
    parser = output.options(__doc__, repeats=1)
    parser.add_argument("--largest", type=int, default=320_000, help="dofs, of multigrid")
    parser.add_argument("--largest-direct", type=int, default=100_000, help="dofs, of the factor")
    parser.add_argument("--seconds", type=float, default=120.0, help="no larger size after that")
    parser.add_argument("--one", nargs=2, metavar=("SOLVER", "CELLS"), help=argparse.SUPPRESS)
    return parser


def main() -> None:
    """Measure and write."""
    given = options().parse_args()
    if given.one:
        print(json.dumps(one(given.one[0], int(given.one[1]))))
        return
    load = os.getloadavg()[0]
    largest = {"direct": given.largest_direct, "multigrid": given.largest}
    rows, left_out = measure(largest, given.seconds)
    machine = output.machine(load, "one solve a size, each in a process of its own, all cores")
    output.write(given.out, "growth", table(rows, machine, left_out), machine, rows)
    growth_figure.draw(rows, given.out)


if __name__ == "__main__":
    main()
