"""`--profile`: a table of the phases of a run, and what would make the costly ones cheaper."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import nullcontext
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, TypeVar

import click

from .. import profile
from ..core import core
from ..threads import available
from ._run import Run

if TYPE_CHECKING:
    from contextlib import AbstractContextManager

    from ..profile import Profile
    from ..state import Equilibrium

Work = TypeVar("Work", bound=Callable[..., Any])

#: What the table calls a phase.
_NAMES = {
    "checks": "checks of mesh and supports",
    "analysis": "pattern, ordering, symbolic factor",
    "assembly": "tangents",
    "residual": "forces, energies, volume ratios",
    "factor": "factorisation",
    "solve": "solves with the factor",
}
#: Share above which a phase is worth a word, and seconds below which none is.
_LARGE, _SHORT = 0.3, 0.2
#: GFLOP/s of one core below which a BLAS has not found the processor's vectors.
_SLOW_BLAS = 15.0


@dataclass(frozen=True)
class Facts:
    """What advice depends on besides the phases' shares."""

    element: str
    steps: int  # load steps that were made
    threads: int
    cores: int
    gflops: float
    solver: str = ""  # what was picked and why


def option(work: Work) -> Work:
    """The option ``--profile`` of a command, as its argument ``profiled``."""
    return click.option(
        "--profile", "profiled", is_flag=True,
        help="Say where the time went, and what would help.",
    )(work)  # fmt: skip


def collecting(wanted: bool) -> AbstractContextManager[Profile | None]:
    """A context for what is to be profiled, if ``wanted``."""
    return profile.collect() if wanted else nullcontext()


def report(run: Run, found: Profile | None, state: Equilibrium) -> None:
    """Add the profile to the result of the run, and a table for people."""
    if found is None:
        return
    element = state._solved.mesh.element
    steps = len({i["load_factor"] for i in state.history})
    solver = str(state.timings.get("solver", ""))
    gflops = core().blas_report().gflops
    facts = Facts(element, steps, core().threads(), available(), gflops, solver)
    described = described_as(found, facts)
    if solver:
        described["solver"] = solver
    run.result["profile"] = described
    for line in table(described):
        run.say(line)


def described_as(found: Profile, facts: Facts) -> dict[str, Any]:
    """The profile as a result: seconds and shares by phase, the costliest first, and advice."""
    phases = [
        {"phase": name, "calls": p.calls, "seconds": p.seconds, "share": p.seconds / found.seconds}
        for name, p in found.phases.items()
    ]
    rest = found.seconds - sum(p.seconds for p in found.phases.values())
    phases.append({"phase": "other", "calls": 1, "seconds": rest, "share": rest / found.seconds})
    phases.sort(key=lambda row: -float(str(row["seconds"])))
    return {
        "seconds": found.seconds,
        "phases": phases,
        "threads": facts.threads,
        "cores": facts.cores,
        "blas_gflops": facts.gflops,
        "advice": list(advice(found, facts)) or ["no phase stands out."],
    }


def table(described: dict[str, Any]) -> Iterator[str]:
    """Lines of text."""
    yield f"{'phase':36}{'calls':>7}{'seconds':>10}{'share':>8}"
    for row in described["phases"]:
        name = _NAMES.get(row["phase"], row["phase"])
        yield f"{name:36}{row['calls']:7}{row['seconds']:10.3f}{100 * row['share']:6.0f} %"
    yield f"{'whole':36}{'':7}{described['seconds']:10.3f}{100:6} %"
    yield (
        f"{described['threads']} of {described['cores']} cores, "
        f"BLAS at {described['blas_gflops']:.0f} GFLOP/s a core"
    )
    if "solver" in described:
        yield f"solver: {described['solver']}"
    for sentence in described["advice"]:
        yield f"- {sentence}"


def advice(found: Profile, facts: Facts) -> Iterator[str]:
    """What would help, of the costliest phases only."""
    seconds = {name: p.seconds for name, p in found.phases.items() if p.seconds > _SHORT}
    share = {name: s / found.seconds for name, s in seconds.items()}
    if "kernels compiled" in seconds:
        yield (
            f"kernels were compiled at first use, {seconds['kernels compiled']:.1f} s; they are "
            "kept, so the next run with these laws and elements takes none of it."
        )
    linear = share.get("factor", 0.0) + share.get("solve", 0.0)
    cells = share.get("assembly", 0.0) + share.get("residual", 0.0)
    if linear > _LARGE:
        yield (
            f"linear algebra takes {100 * linear:.0f} %: it grows faster than the mesh, half as "
            "many nodes take about a third of it" + _lower_order(facts) + "."
        )
        if facts.solver.startswith("direct: as asked") and share.get("factor", 0.0) > _LARGE:
            yield (
                'every tangent was factorised, as solver "direct" asks; "auto" keeps a factor '
                "while it serves."
            )
        if facts.gflops < _SLOW_BLAS:
            yield (
                f"this machine's BLAS makes {facts.gflops:.0f} GFLOP/s where one that knows the "
                "processor makes 30 or more: install a newer OpenBLAS, or set OPENBLAS_CORETYPE."
            )
    if cells > _LARGE:
        yield f"the cells take {100 * cells:.0f} %: it grows as their number" + (
            _lower_order(facts) + "."
        )
    if linear + cells > _LARGE and facts.threads < facts.cores:
        yield (
            f"{facts.threads} of {facts.cores} cores work; OMP_NUM_THREADS={facts.cores} lets all."
        )
    if share.get("analysis", 0.0) > _LARGE:
        yield (
            "pattern and ordering are made once a body: further solves of the same body in one "
            "Python process, body.solve_many for instance, have them already."
        )
    if facts.steps > 3 and linear + cells > _LARGE:
        yield (
            f"{facts.steps} load steps were made; where none are asked for, the whole load is "
            "tried at once, and a smaller load or stiffer material needs no more."
        )
    if share.get("reading", 0.0) > _LARGE:
        yield "reading takes long: write the mesh once as .vtu, which is binary."
    if share.get("checks", 0.0) > _LARGE:
        yield "the mesh is checked when it is read: many solves in one process check it once."
    if share.get("writing", 0.0) > _LARGE:
        yield "most of the time goes into what is written, none of it into the solve."


def _lower_order(facts: Facts) -> str:
    if facts.element in ("P1", "Q1", "Pr1"):
        return ""
    lower = {"P2": "P1", "Pr2": "Pr1"}.get(facts.element, "Q1")
    return f", and {lower} cells are cheaper than {facts.element}"
