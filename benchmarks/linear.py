"""Factorisation and triangular solves on the benchmark's tangents, beside what the machine can.

    tangents of newton.py's bodies → dgemm, triad → analysis, factor, solve → linear.md and .json

The matrix is the tangent on the free dofs of the body, bent a little. A factorisation is held
against dgemm of 256 × 256 on as many threads as it may use (one core's times the cores); a solve,
which reads the factor twice, against the triad's bandwidth: 16 bytes an entry. What stays in the
cache may pass 100 %. The share of a core is by CPU time, against one core's dgemm: what threads
that wait and other processes cost is left out of it.
"""

from __future__ import annotations

import os
import statistics
import time
from dataclasses import dataclass
from typing import Any

import bodies
import native
import numpy as np
import output
from peers.cantilever import DIVISIONS

import supple
from supple.core import core


@dataclass(frozen=True)
class Row:
    """Medians, ms; flops and entries of the factor; of the machine."""

    case: str
    unknowns: int
    ordering: str
    entries: float
    flops: float
    analysis_ms: float
    factor_ms: float
    factor_cpu_ms: float
    solve_ms: float
    dgemm_gflops: float  # one core
    threads: int
    triad_gbs: float

    @property
    def gflops(self) -> float:
        return self.flops / self.factor_ms / 1e6

    @property
    def gbs(self) -> float:
        return 16 * self.entries / self.solve_ms / 1e6


def reduced(body: supple.Body) -> tuple[Any, np.ndarray]:
    """Pattern and values of the lower triangle of K on the free dofs of a body bent a little."""
    from scipy.sparse import tril

    points = body.mesh.points
    u = 1e-2 * (points / np.ptp(points, axis=0)) ** 2 * body.mesh.size
    tangent = supple.assemble(body, u)[2]
    free = np.flatnonzero(~body._fixed.ravel())
    lower = tril(tangent[free][:, free]).tocsc()
    lower.sort_indices()
    group = np.unique(free // 3, return_inverse=True)[1].astype(np.int32)
    start, row = lower.indptr.astype(np.int64), lower.indices.astype(np.int64)
    return core().LowerPattern(start, row, group), lower.data


def milliseconds(call: Any, *arguments: Any) -> float:
    """Of one call."""
    begin = time.perf_counter()
    call(*arguments)
    return 1e3 * (time.perf_counter() - begin)


def both(call: Any, *arguments: Any) -> tuple[float, float]:
    """Milliseconds of one call: on the wall, of all its threads."""
    cpu = time.process_time()
    wall = milliseconds(call, *arguments)
    return wall, 1e3 * (time.process_time() - cpu)


def measure(
    case: str, pattern: Any, values: np.ndarray, repeats: int, dgemm: float, triad: float
) -> Row:
    """Factorisations and solves in turn, after a first one; the second of two analyses."""
    factor = core().Cholesky()
    analysis = [milliseconds(factor.analyse, pattern) for _ in range(2)][1]
    rhs = np.ones(factor.size)
    times = [
        (*both(factor.factorise, values), milliseconds(factor.solve, rhs))
        for _ in range(repeats + 1)
    ]
    middle = [statistics.median(t[i] for t in times[1:]) for i in range(3)]
    return Row(case, factor.size, factor.ordering, factor.nonzeros, factor.flops, analysis,
               *middle, dgemm, core().threads(), triad)  # fmt: skip


def table(rows: list[Row], machine: str) -> str:
    """Markdown."""
    head = ("matrix", "unknowns", "ordering", "entries of L", "GFLOP", "analysis, ms",
            "factor, ms", "GFLOP/s", "of dgemm", "a core's share", "solve, ms", "GB/s",
            "of the triad")  # fmt: skip
    body = (
        (r.case, r.unknowns, r.ordering, output.digits(r.entries), output.digits(r.flops / 1e9),
         output.digits(r.analysis_ms), f"**{output.digits(r.factor_ms)}**", output.digits(r.gflops),
         output.share(r.gflops, r.dgemm_gflops * r.threads),
         output.share(r.flops / r.factor_cpu_ms / 1e6, r.dgemm_gflops),
         f"**{output.digits(r.solve_ms)}**", output.digits(r.gbs),
         output.share(r.gbs, r.triad_gbs))
        for r in rows
    )  # fmt: skip
    limits = ""
    if rows:
        dgemm, triad = rows[0].dgemm_gflops, rows[0].triad_gbs
        limits = f" dgemm {dgemm:.1f} GFLOP/s a core, triad {triad:.1f} GB/s."
    lines = ["# Factor and solve", "", machine + limits, "", *output.markdown(head, body)]
    return "\n".join(lines) + "\n"


def main() -> None:
    """Measure and write."""
    parser = output.options(__doc__, repeats=5)
    parser.add_argument("--blocks", nargs="*", type=int, default=[15, 31], help="cells an edge")
    given = parser.parse_args()
    load = os.getloadavg()[0]
    cases = {f"cantilever {e}": bodies.cantilever(e, counts) for e, counts in DIVISIONS.items()}
    cases |= {f"block P1, {n}³": bodies.block(n) for n in given.blocks}
    threads, triad = core().threads(), native.triad_gbs()
    dgemm = core().blas_report().gflops
    rows = [measure(case, *reduced(b), given.repeats, dgemm, triad) for case, b in cases.items()]
    machine = output.machine(load, f"{threads} threads, medians of {given.repeats} rounds")
    output.write(given.out, "linear", table(rows, machine), machine, rows)


if __name__ == "__main__":
    main()
