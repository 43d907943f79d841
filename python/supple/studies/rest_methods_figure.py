"""How far each way to a rest shape goes and how long it takes, as bars, SVG or PNG."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from .output import save
from .rest_methods import METHODS, RACERS

if TYPE_CHECKING:
    from .rest_methods import Outcome

_COLOURS = ("tab:blue", "tab:grey", "tab:olive", "tab:orange", "tab:red", "tab:pink", "tab:brown")
_COLOUR = dict(zip(RACERS, _COLOURS, strict=True))


def draw(outcomes: Sequence[Outcome], path: Path) -> Path:
    """Limits on the left, times over the inverse's on the right; ``path`` ends in .svg or .png."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(12, 5), layout="constrained")
    left, right = figure.subplots(1, 2, width_ratios=(2, 3))
    limits = {m: [o.limit(m) for o in outcomes] for m in METHODS}
    _bars(left, [o.case for o in outcomes], limits)
    left.set(ylabel="largest multiple of gravity taken off", title="Reach")
    races = [(o, load) for o in outcomes for load in o.reversed_gravity]
    factors = [next(r.factor for r in o.racers if r.load == load) for o, load in races]
    names = [f"{o.case}\n{factor:.2g} g" for (o, _), factor in zip(races, factors, strict=True)]
    ratios = {m: [o.ratio(m, load) for o, load in races] for m in RACERS if m != "inverse"}
    _bars(right, names, ratios)
    right.axhline(1.0, color=_COLOUR["inverse"], lw=1.5)
    right.axhline(5.0, color="black", lw=1, ls=":")
    right.set(
        ylabel="time over that of the inverse solve", title="Time (dotted: bar; ×: none found)"
    )
    figure.legend(*_legend(left, right), loc="outside lower center", ncols=4, fontsize=9)
    figure.suptitle("Rest shapes: inverse solve against fixed points of forward solves")
    return save(figure, path)


def _bars(axes: Any, names: Sequence[str], values: dict[str, list[float]]) -> None:
    """Groups of bars, log scale; a cross where there is no value."""
    places, width = np.arange(len(names)), 0.8 / len(values)
    for number, (label, heights) in enumerate(values.items()):
        at = places + (number - (len(values) - 1) / 2) * width
        axes.bar(at, heights, 0.9 * width, color=_COLOUR[label], label=label)
        missing = np.isnan(heights)
        level = np.full(missing.sum(), 0.03)
        axes.plot(
            at[missing], level, "x", color=_COLOUR[label], ms=5,
            transform=axes.get_xaxis_transform(),
        )  # fmt: skip
    axes.set_yscale("log")
    axes.yaxis.set_major_formatter("{x:g}")
    axes.yaxis.set_minor_formatter("{x:g}")
    axes.set_ylim(bottom=min(0.8, 0.5 * np.nanmin(list(values.values()))))
    axes.set_xticks(places, names, fontsize=8)
    axes.grid(True, axis="y", which="both", alpha=0.25)


def _legend(*panels: Any) -> tuple[list[Any], list[str]]:
    """Each method once."""
    found: dict[str, Any] = {}
    for axes in panels:
        handles, labels = axes.get_legend_handles_labels()
        found |= dict(zip(labels, handles, strict=True))
    return list(found.values()), list(found)
