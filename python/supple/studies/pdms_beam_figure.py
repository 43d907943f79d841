"""The PDMS beam as a picture: hanging and straight, convergence, and the printed numbers."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from . import pdms_beam as pdms
from .output import save
from .pdms_beam import Outcome
from .pdms_beam_report import printed

_STYLES = {
    ("Q2L", "mixed"): ("tab:blue", "s", "Q2L–Q1, mixed"),
    ("P2", "mixed"): ("tab:orange", "o", "P2–P1, mixed"),
    ("Q2", "displacement"): ("tab:red", "D", "Q2"),
    ("P2", "displacement"): ("tab:green", "^", "P2"),
    ("P1", "displacement"): ("tab:brown", "v", "P1"),
}
_COLOURS = {"o": "tab:blue", "s": "tab:grey", "d": "black"}
_AXES = {
    "elastica": ("k-", "elastica, round section"),
    "hanging": ("o", "hanging, Q2L–Q1"),
    "inverse": ("s", "its rest shape"),
    "reversed-gravity": ("x", "gravity reversed instead"),
}


def draw(outcome: Outcome, path: Path) -> Path:
    """Three panels; ``path`` ends in .svg or .png."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(13, 4.6), layout="constrained")
    shapes, curves, numbers = figure.subplots(1, 3)
    _shapes(shapes, outcome)
    _curves(curves, outcome)
    _numbers(numbers, outcome)
    figure.suptitle("Silicone beam, 182 × 8.5 mm, under its own weight")
    return save(figure, path)


def _shapes(axes: Any, outcome: Outcome) -> None:
    for name, (style, label) in _AXES.items():
        if name not in outcome.axes:  # it was not found
            continue
        x, y = 1e3 * outcome.axes[name].T
        axes.plot(x, y, style, ms=5, mfc="none", label=label)
    x, below = pdms.EXPERIMENT_TIP
    axes.plot(1e3 * x, -1e3 * below, "r*", ms=11, label="measured tip")
    axes.set(
        xlabel="along the beam, mm", ylabel="height, mm", title="shape of the axis", ylim=(-160, 55)
    )
    axes.set_aspect("equal")
    axes.legend(fontsize=7, loc="lower left")


def _curves(axes: Any, outcome: Outcome) -> None:
    for (element, form), (colour, marker, label) in _STYLES.items():
        own = [t for t in outcome.tips if (t.element, t.formulation) == (element, form)]
        size = [1e3 * t.size for t in own]
        axes.semilogx([t.dofs for t in own], size, f"{marker}-", color=colour, mfc="none",
                      label=label)  # fmt: skip
    elastica = 1e3 * float(np.hypot(*(outcome.axes["elastica"][-1] - [pdms.LENGTH, 0.0])))
    axes.axhline(elastica, color="k", lw=1, label=f"elastica {elastica:.1f}")
    axes.axhline(1e3 * pdms.EXPERIMENT, color="r", ls="--", lw=1, label="experiment 127.7")
    axes.set(xlabel="dofs", ylabel="|u| of the tip, mm", title="round section, curved elements")
    axes.legend(fontsize=8, loc="center left")


def _numbers(axes: Any, outcome: Outcome) -> None:
    rows = [(n, v, "d" if n.startswith("elastica") else "s") for n, v, _ in printed(outcome)]
    last = {t.element: t for t in outcome.tips if t.formulation == "mixed"}
    rows += [(f"Supple, round {name}", t.size, "o") for name, t in last.items()]
    if outcome.given:
        rows.append(("Supple, mesh given, largest", outcome.given.tip.largest, "o"))
    rows.sort(key=lambda row: row[1])
    for place, (_, value, marker) in enumerate(rows):
        colour = _COLOURS[marker]
        axes.plot(1e3 * value, place, marker, color=colour)
        axes.annotate(f"{1e3 * value:.2f}", (1e3 * value, place), (6, -3),
                      textcoords="offset points", fontsize=8)  # fmt: skip
    axes.set_yticks(range(len(rows)), [row[0] for row in rows], fontsize=8)
    axes.margins(x=0.3)
    axes.grid(axis="x", alpha=0.3)
    axes.set(xlabel="|u| of the tip, mm", title="published, beam theory, Supple")
