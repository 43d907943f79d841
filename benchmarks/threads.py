"""What more threads bring: assembly, factor, solve and all of a solve on 1, 2, 4, … cores.

    bodies × threads in turn, several rounds → answers compared → threads.md and .json in --out

Each solve is one of a new body. Answers of all numbers of threads must agree to 1e-12 of the
largest displacement.
"""

from __future__ import annotations

import os
import statistics
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass

import bodies
import numpy as np
import output
from peers.cantilever import DIVISIONS

import supple
from supple.core import core

CASES: dict[str, Callable[[], supple.Body]] = {
    "cantilever P1, 10,935 dofs": lambda: bodies.cantilever("P1", DIVISIONS["P1"]),
    "cantilever P2, 12,705 dofs": lambda: bodies.cantilever("P2", DIVISIONS["P2"]),
    "cantilever Q2, 11,772 dofs": lambda: bodies.cantilever("Q2", DIVISIONS["Q2"]),
    "block P1, 31,944 dofs": lambda: bodies.block(21),
}
PHASES = ("assembly", "factor", "solve", "total")
SAME = 1e-12


@dataclass(frozen=True)
class Row:
    """Medians, seconds of a whole solve; over those of one thread."""

    case: str
    threads: int
    assembly: float
    factor: float
    solve: float
    total: float
    assembly_over: float
    factor_over: float
    solve_over: float
    total_over: float
    difference: float


def counts(cores: int) -> list[int]:
    """1, 2, 4, … and all cores."""
    powers = [2**k for k in range(cores.bit_length()) if 2**k <= cores]
    return sorted({*powers, cores})


def solve(make: Callable[[], supple.Body], threads: int) -> tuple[dict[str, float], np.ndarray]:
    """Seconds by phase, and the answer."""
    core().set_threads(threads)
    body = make()
    begin = time.perf_counter()
    state = body.solve()
    spent = time.perf_counter() - begin
    return {p: float(state.timings[p]) for p in PHASES[:-1]} | {"total": spent}, state.u


def measure(case: str, make: Callable[[], supple.Body], most: int, repeats: int) -> list[Row]:
    """All numbers of threads in turn."""
    chosen = counts(most)
    rounds: dict[int, list[dict[str, float]]] = {n: [] for n in chosen}
    difference = dict.fromkeys(chosen, 0.0)
    solve(make, 1)
    for _ in range(repeats):
        answers = {}
        for n in chosen:
            times, answers[n] = solve(make, n)
            rounds[n].append(times)
        for n in chosen:
            away = np.abs(answers[n] - answers[1]).max() / np.abs(answers[1]).max()
            difference[n] = max(difference[n], float(away))
    worst = max(difference.values())
    if worst > SAME:
        sys.exit(
            f"{case}: answers differ by {worst:.1e} among numbers of threads, more than {SAME}"
        )
    return [row(case, n, rounds, difference[n]) for n in chosen]


def row(case: str, n: int, rounds: dict[int, list[dict[str, float]]], difference: float) -> Row:
    """Medians; ratios within a round."""
    both = list(zip(rounds[1], rounds[n], strict=True))
    seconds = (statistics.median(mine[p] for _, mine in both) for p in PHASES)
    over = (statistics.median(one[p] / max(mine[p], 1e-9) for one, mine in both) for p in PHASES)
    return Row(case, n, *seconds, *over, difference)


def table(rows: list[Row], machine: str) -> str:
    """Markdown."""
    head = ("body", "threads", *(f"{p}, s (×)" for p in PHASES), "answers differ")
    body = (
        (r.case, r.threads,
         *(f"{output.digits(getattr(r, p))} ({getattr(r, p + '_over'):.2f})" for p in PHASES),
         output.digits(r.difference, 1))
        for r in rows
    )  # fmt: skip
    about = "In brackets: how many times faster than one thread."
    return "\n".join(["# Threads", "", machine, "", about, "", *output.markdown(head, body)]) + "\n"


def main() -> None:
    """Measure and write."""
    parser = output.options(__doc__, repeats=3)
    parser.add_argument("--threads", type=int, default=os.cpu_count(), help="at most")
    given = parser.parse_args()
    load = os.getloadavg()[0]
    rows = [r for case, make in CASES.items()
            for r in measure(case, make, given.threads, given.repeats)]  # fmt: skip
    machine = output.machine(load, f"medians of {given.repeats} rounds")
    output.write(given.out, "threads", table(rows, machine), machine, rows)


if __name__ == "__main__":
    main()
