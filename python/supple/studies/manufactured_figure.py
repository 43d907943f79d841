"""The manufactured solution's errors over the cell size, log-log, as SVG and PNG."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from .output import save

if TYPE_CHECKING:
    from .manufactured import Series

_COLOURS = {
    "P1": "tab:blue", "P2": "tab:orange", "Q1": "tab:green", "Q2": "tab:red",
    "Q2L": "tab:purple", "Pr1": "tab:brown", "Pr2": "tab:pink",
}  # fmt: skip
_MARKERS = {"Q1": "s", "Q2": "s", "Q2L": "D", "Pr1": "^", "Pr2": "^"}
_ERRORS = (("u", "displacement u"), ("strain", "Green–Lagrange strain E"))


def draw(series: Sequence[Series], path: Path) -> Path:
    """One row of panels a law, one column for u and one for E; ``path`` ends in .svg or .png."""
    from matplotlib.figure import Figure

    laws = list(dict.fromkeys(s.case.name for s in series))
    figure = Figure(figsize=(9, 0.8 + 3.2 * len(laws)), layout="constrained")
    panels = figure.subplots(len(laws), 2, squeeze=False, sharex=True)
    for row, law in zip(panels, laws, strict=True):
        own = [s for s in series if s.case.name == law]
        for number, (axes, (name, title)) in enumerate(zip(row, _ERRORS, strict=True)):
            _panel(axes, own, name, number)
            axes.set_title(f"{law.replace('_', ' ')}: {title}", fontsize=10)
            axes.set_ylabel("relative error, L2 norm")
    for axes in panels[-1]:
        axes.set_xlabel("cell size h, m")
    figure.suptitle("Manufactured solution on the unit cube, u = 1e-2 z (eˣ, eʸ, eᶻ) m")
    return save(figure, path)


def _panel(axes: Any, series: Sequence[Series], name: str, number: int) -> None:
    from matplotlib.ticker import FixedLocator, NullLocator

    counts = sorted({n for s in series for n in s.cells})
    for s in series:
        h, error = 1 / np.array(s.cells), getattr(s, name)
        label = f"{s.element}, slope {s.rates[number, -1]:.2f}"
        colour, marker = _COLOURS.get(s.element), _MARKERS.get(s.element, "o")
        axes.loglog(h, error, f"{marker}-", color=colour, ms=5, mfc="none", lw=1, label=label)
    for degree in sorted({s.degree for s in series}):
        lowest = min((s for s in series if s.degree == degree), key=lambda s: getattr(s, name)[-1])
        h, order = 1 / np.array(lowest.cells), degree + 1 - number
        line = 0.7 * getattr(lowest, name)[-1] * (h / h[-1]) ** order
        axes.loglog(h, line, ":", color="grey", lw=1.5, label=f"theory, slope {order}")
    axes.xaxis.set_major_locator(FixedLocator([1 / n for n in counts]))
    axes.xaxis.set_minor_locator(NullLocator())
    axes.set_xticklabels([f"1/{n}" for n in counts])
    axes.grid(True, which="major", alpha=0.3)
    axes.legend(fontsize=7, loc="lower left")
