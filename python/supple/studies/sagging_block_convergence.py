"""The sagging block on finer and finer meshes: P1, P2 and the mixed pair P2–P1."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from .sagging_block import Block, Outcome

#: Element and formulation by the name of their series.
SERIES = {
    "P1": ("P1", "displacement"),
    "P2": ("P2", "displacement"),
    "P2–P1 mixed": ("P2", "mixed"),
}
CUBES = (1, 2, 3, 4, 5, 6)
#: Pa: the softer of the thesis' two printed samples, ν = 0.497, where volume locks.
MU, LMBDA = 20e3, 30e5


@dataclass(frozen=True)
class Row:
    """One mesh and what it gave at μ = MU, λ = LMBDA."""

    name: str
    cubes: int
    dofs: int
    found: Outcome


def run(
    cubes: Sequence[int] = CUBES, progress: Callable[[str, float], None] | None = None
) -> list[Row]:
    """Every series on every mesh."""
    todo, rows = [(name, n) for name in SERIES for n in cubes], []
    for number, (name, n) in enumerate(todo):
        if progress:
            progress(f"{name}, {n} cubes", number / len(todo))
        rows.append(_row(name, n))
    return rows


def _row(name: str, cubes: int) -> Row:
    element, formulation = SERIES[name]
    block = Block(cubes, element, formulation)
    found = block.run(MU, LMBDA)
    points = block.mesh.points
    pressures = (cubes + 1) ** 3 if formulation == "mixed" else 0
    dofs = 3 * int((points[:, 1] > 1e-9).sum()) + pressures
    return Row(name, cubes, dofs, found)


def csv(rows: Sequence[Row]) -> str:
    """The table."""
    head = "element,cubes_per_edge,unknowns,mu_pa,lambda_pa,outcome,top_sinks_m,mae_m,"
    lines = [head + "reversed_gravity_mae_m,cpu_s"]
    for r in rows:
        o = r.found
        start = f"{r.name},{r.cubes},{r.dofs},{MU:g},{LMBDA:g},{o.outcome}"
        lines.append(
            f"{start},{o.sag:.6e},{o.mae:.3e},{o.reversed_gravity:.3e},{o.cpu_seconds:.3f}"
        )
    return "\n".join(lines) + "\n"
