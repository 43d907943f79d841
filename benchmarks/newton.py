"""Newton on the benchmark cantilever: Supple beside DOLFINx, FElupe and FEBio, in one run.

    case → every code in turn, several times → tips checked → newton.md and .json in --out

Case, tolerance and published tips: peers/cantilever.py. Each code is a process of its own that
stays, so that imports and compilation do not count; its script in peers/ says what does. A round
is all codes on all cases; the first one warms up. Ratios are medians of the ratios within a round,
so that a busy machine slows all sides. The second solve is from zero too, of the same body with E
and ν 10 % larger; the peers do it in the first round only, where all answers must agree.
"""

from __future__ import annotations

import os
import statistics
import sys
import tempfile
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import output
import team
from peers.cantilever import DIVISIONS, LENGTH, TIPS, TRACTION, WIDTH, YOUNG

import supple

Answer = dict[str, Any]
#: Worst relative error of a tip; the codes stop at 1e-10 of the load.
BAR = 1e-6
#: Letters of a note that stands in the table; longer ones stand below.
SHORT = 20


@dataclass(frozen=True)
class Row:
    """Medians over the rounds; ms of a whole solve, of an iteration where it says so."""

    element: str
    law: str
    code: str
    note: str
    dofs: int
    iterations: int
    total_ms: float
    cpu_ms: float | None
    iteration_ms: float
    assembly_ms: float
    linear_ms: float
    second_ms: float | None
    second_iterations: int | None
    residual: float
    tip_error: float | None
    over_best: float | None = None  # best peer's total over this one's
    assembly_over: float | None = None  # DOLFINx' assembly, one rank, over this one's
    second_over: float | None = None  # this one's first solve over its second


@dataclass
class Case:
    """One element and law, and what every code answered, a list by round."""

    element: str
    law: str
    divisions: tuple[int, int, int]
    mesh: Path
    answers: dict[str, list[Answer]] = field(default_factory=dict)
    second_tips: dict[str, list[float]] = field(default_factory=dict)

    def request(self, second: bool) -> dict[str, Any]:
        """What every code is told."""
        return {"element": self.element, "law": self.law, "divisions": self.divisions,
                "mesh": str(self.mesh), "second": second}  # fmt: skip

    def tip(self) -> tuple[float, float, float] | None:
        """The published one, of the published mesh."""
        return TIPS[self.element, self.law] if self.divisions == DIVISIONS[self.element] else None


@contextmanager
def cases(divisions: dict[str, tuple[int, int, int]]) -> Iterator[list[Case]]:
    """All cases, their meshes in files for as long as the context lasts."""
    with tempfile.TemporaryDirectory() as folder:
        for element, counts in divisions.items():
            write_mesh(Path(folder) / f"{element}.npz", element, counts)
        yield [
            Case(element, law, divisions[element], Path(folder) / f"{element}.npz")
            for element, law in TIPS
            if element in divisions
        ]


def write_mesh(path: Path, element: str, divisions: tuple[int, int, int]) -> None:
    """Points, cells, facets in VTK's order, nodes held, consistent nodal loads."""
    mesh = supple.Mesh.box(divisions, (LENGTH, WIDTH, WIDTH), element)
    body = supple.Body(mesh, "neo_hookean", young=YOUNG, poisson=0.3)
    body.traction(lambda x: x[:, 0] > LENGTH - 1e-9, (0.0, TRACTION, 0.0))
    load = -supple.assemble(body, np.zeros_like(mesh.points))[1]
    held = np.flatnonzero(mesh.points[:, 0] < 1e-9)
    facets = mesh.boundary(lambda x: x[:, 0] > LENGTH - 1e-9)
    np.savez(path, points=mesh.points, cells=mesh.cells, facets=facets, held=held, load=load)


def measure(chosen: list[Case], codes: list[team.Code], repeats: int) -> list[str]:
    """All cases by all codes in turn; who was left out, and why."""
    left_out: dict[str, str] = {}
    for round_number in range(repeats + 1):
        for case in chosen:
            for code in codes:
                if code.name in left_out:
                    continue
                answer = code.ask(case.request(second=code.ours or not round_number))
                if "skip" in answer:
                    left_out[code.name] = answer["skip"]
                elif answer and not round_number:
                    require_right(case, code.name, answer)
                    case.answers[code.name] = []
                    case.second_tips[code.name] = answer["second"]["tip"]
                elif answer:
                    case.answers[code.name].append(answer)
    for case in chosen:
        case.answers = {n: a for n, a in case.answers.items() if len(a) == repeats}
    return [f"{name}: {reason}" for name, reason in left_out.items()]


def require_right(case: Case, name: str, answer: Answer) -> None:
    """Stop where a tip is off, before anything is timed."""
    error = distance(answer["tip"], case.tip())
    if error is not None and not error <= BAR:
        sys.exit(f"{name}, {case.element} {case.law}: the tip is off by {error:.1e}; not timed")


def require_agreement(case: Case) -> None:
    """Stop where two codes answer the second question differently."""
    first = next(iter(case.second_tips.values()), None)
    for name, found in case.second_tips.items():
        if not (distance(found, first) or 0.0) <= BAR:
            sys.exit(f"{case.element} {case.law}: second tips differ, {name} from the first code's")


def distance(found: list[float], wanted: tuple[float, ...] | list[float] | None) -> float | None:
    """Relative."""
    if wanted is None:
        return None
    return float(np.linalg.norm(np.subtract(found, wanted)) / np.linalg.norm(wanted))


def rows_of(case: Case, codes: list[team.Code]) -> list[Row]:
    """Medians of one case, ours first; ratios to the best of the peers."""
    require_agreement(case)
    peers = [c.name for c in codes if c.name in case.answers and not c.ours]
    best = min(peers, key=lambda name: median(case.answers[name], "total"), default=None)
    return [row(case, c.name, best) for c in codes if c.name in case.answers]


def row(case: Case, name: str, best: str | None) -> Row:
    """One code on one case."""
    rounds = case.answers[name]
    steps = rounds[0]["iterations"]
    linear = [{"linear": a["factor"] + a["solve"]} for a in rounds]
    seconds = [a["second"] for a in rounds if "second" in a]
    reference = case.answers.get(team.REFERENCE)
    return Row(
        case.element, case.law, name, rounds[0].get("note", ""), rounds[0]["dofs"], steps,
        median(rounds, "total"),
        median(rounds, "cpu") if "cpu" in rounds[0] else None,
        median(rounds, "total") / steps,
        median(rounds, "assembly") / steps,
        median(linear, "linear") / steps,
        median(seconds, "total") if seconds else None,
        seconds[0]["iterations"] if seconds else None,
        max(a.get("residual", float("nan")) for a in rounds),
        distance(rounds[0]["tip"], case.tip()),
        None if best is None else ratio(case.answers[best], rounds, "total"),
        None if reference is None else ratio(reference, rounds, "assembly"),
        ratio(rounds, seconds, "total") if seconds else None,
    )  # fmt: skip


def median(answers: list[Answer], key: str) -> float:
    """In ms."""
    return statistics.median(1e3 * a[key] for a in answers)


def ratio(above: list[Answer], below: list[Answer], key: str) -> float:
    """Median of the rounds' ratios."""
    return statistics.median(a[key] / b[key] for a, b in zip(above, below, strict=True))


def table(rows: list[Row], machine: str, left_out: list[str]) -> str:
    """Markdown."""
    head = ("case", "code", "dofs", "iterations", "solve, ms (CPU)", "best peer / this",
            "ms an iteration [assembly / factor + solve]", "DOLFINx' assembly / this",
            "second solve, ms", "first / second", "residual", "tip error")  # fmt: skip
    lines = ["# Newton on the benchmark cantilever", "", machine, "", *output.markdown(head, (
        (
            f"{r.element} {r.law}", named(r), r.dofs,
            r.iterations, spent(r), number(r.over_best),
            f"{r.iteration_ms:.1f} [{r.assembly_ms:.1f} / {r.linear_ms:.1f}]",
            number(r.assembly_over), output.digits(r.second_ms), number(r.second_over),
            f"{r.residual:.0e}", None if r.tip_error is None else f"{r.tip_error:.0e}",
        )
        for r in rows
    ))]  # fmt: skip
    said = [f"{r.code}, {r.element} {r.law}: {r.note}" for r in rows if len(r.note) > SHORT]
    lines += [f"\n{sentence}" for sentence in said]
    lines += [f"\nNot measured: {reason}" for reason in left_out]
    return "\n".join(lines) + "\n"


def named(row: Row) -> str:
    """The code, with its note where that is a word and no sentence."""
    return f"{row.code} ({row.note})" if 0 < len(row.note) <= SHORT else row.code


def spent(row: Row) -> str:
    """Wall time of a solve, and CPU time of the process, of rank 0 where there are two."""
    cpu = "" if row.cpu_ms is None else f" ({row.cpu_ms:.0f})"
    return f"**{row.total_ms:.0f}**{cpu}"


def number(value: float | None) -> str | None:
    """A ratio."""
    return None if value is None else f"{value:.2f}"


def main() -> None:
    """Measure and write."""
    parser = output.options(__doc__, repeats=5)
    team.add_options(parser)
    given = parser.parse_args()
    load = os.getloadavg()[0]
    with ExitStack() as stack:
        codes, absent = team.assemble(given, stack)
        chosen = stack.enter_context(cases(DIVISIONS))
        absent += measure(chosen, codes, given.repeats)
        rows = [r for case in chosen for r in rows_of(case, codes)]
    threads = os.environ.get("OMP_NUM_THREADS", "all cores")
    machine = output.machine(load, f"medians of {given.repeats} rounds, Supple on {threads}")
    output.write(given.out, "newton", table(rows, machine, absent), machine, rows)


if __name__ == "__main__":
    main()
