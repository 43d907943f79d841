"""Log–log plot of growth.py's rows: seconds by phase for each solver, and memory."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

#: Colours that stay apart for colour-blind eyes (Okabe, Ito 2008), and which are drawn.
COLOURS = {
    "mesh": "#999999",
    "pattern": "#56B4E9",
    "analysis": "#E69F00",
    "assembly": "#009E73",
    "factor": "#0072B2",
    "solve": "#CC79A7",
    "total": "#000000",
}


def draw(rows: Sequence[Any], folder: Path) -> None:
    """growth.svg and growth.png; nothing without rows."""
    if not rows:
        return
    from matplotlib.figure import Figure

    solvers = list(dict.fromkeys(r.solver for r in rows))
    figure = Figure(figsize=(4.2 * (len(solvers) + 1), 3.8), layout="constrained")
    axes = figure.subplots(1, len(solvers) + 1)
    for panel, solver in zip(axes, solvers, strict=False):
        _times(panel, [r for r in rows if r.solver == solver])
        panel.set_title(f"solver = {solver}")
    for panel in axes[:-1]:
        panel.sharey(axes[0])
    _memory(axes[-1], rows, solvers)
    for name in ("growth.svg", "growth.png"):
        figure.savefig(folder / name, dpi=150)


def _times(panel: Any, rows: Sequence[Any]) -> None:
    dofs = [r.dofs for r in rows]
    for name, colour in COLOURS.items():
        y = [getattr(r, name) for r in rows]
        shown = [(x, v) for x, v in zip(dofs, y, strict=True) if v > 0]
        if shown:
            width = 2.2 if name == "total" else 1.4
            panel.loglog(*zip(*shown, strict=True), "o-", ms=3, lw=width, color=colour, label=name)
    first, last = min(dofs), max(dofs)
    base = next(r.total for r in rows if r.dofs == last)
    panel.loglog([first, last], [base * first / last, base], ":", color="#999999", label="∝ dofs")
    panel.set_xlabel("dofs")
    panel.set_ylabel("seconds")
    panel.legend(fontsize=7, loc="lower right", ncols=2)
    panel.grid(True, which="major", lw=0.3)


def _memory(panel: Any, rows: Sequence[Any], solvers: Sequence[str]) -> None:
    for solver, mark in zip(solvers, ("o-", "s--"), strict=False):
        own = [r for r in rows if r.solver == solver]
        panel.loglog([r.dofs for r in own], [r.megabytes for r in own], mark, ms=3, label=solver)
    panel.set_title("peak memory with Python")
    panel.set_xlabel("dofs")
    panel.set_ylabel("MB")
    panel.yaxis.set_major_formatter("{x:.0f}")
    panel.yaxis.set_minor_formatter("{x:.0f}")
    panel.legend(fontsize=7)
    panel.grid(True, which="major", lw=0.3)
