"""Inverse shear: the shapes, errors where the field is in the space, rates where it is not."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from .inverse_shear import LAWS, Outcome
from .inverse_shear_table import BAR, ELEMENTS, rates, series
from .output import save

_COLOURS = dict(zip(LAWS, ("tab:blue", "tab:orange", "tab:green"), strict=True))


def draw(outcomes: Sequence[Outcome], path: Path) -> Path:
    """``path`` ends in .svg or .png."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(15, 4.8), layout="constrained")
    shapes, exact, slopes = figure.subplots(1, 3)
    _shapes(shapes)
    _exact(exact, outcomes)
    _rates(slopes, series(outcomes))
    figure.suptitle("Inverse shear: the unit cube from its sheared shape and the loads on it")
    return save(figure, path)


def _shapes(axes: Any) -> None:
    """The face Z = 0 at rest and sheared."""
    t, lines = np.linspace(0, 1, 41), np.linspace(0, 1, 5)
    for shift, power, label in ((0.0, 1, "simple, γ = 0.5"), (2.3, 2, "generalised, k = 1")):
        amount = 0.5 if power == 1 else 1.0
        for c in lines:
            for X, Y in ((t, np.full_like(t, c)), (np.full_like(t, c), t)):
                axes.plot(X + shift, Y, color="0.75", lw=1)
                axes.plot(X + amount * Y**power + shift, Y, color="tab:blue", lw=1)
        axes.text(shift + 0.05, -0.12, label, va="top", fontsize=9)
    axes.set(aspect="equal", ylim=(-0.3, 1.1))
    axes.set_title("The sheared shapes that are given, and the cube", fontsize=10)
    axes.set_axis_off()


def _exact(axes: Any, outcomes: Sequence[Outcome]) -> None:
    for number, law in enumerate(LAWS):
        for kind, marker in (("simple", "o"), ("generalised", "s")):
            own = [o for o in outcomes if o.case.is_in_space and o.case.law == law]
            own = [o for o in own if o.case.kind == kind]
            at = [ELEMENTS.index(o.case.element) + 0.2 * (number - 1) for o in own]
            label = f"{law.replace('_', ' ')}, {kind}"
            for name, filled in (("place", "none"), ("stress", None)):
                axes.semilogy(
                    at, [max(getattr(o, name), 1e-18) for o in own], marker, ms=5,
                    color=_COLOURS[law], mfc=filled, label=label if filled is None else None,
                )  # fmt: skip
    axes.axhline(BAR, color="grey", ls=":", label=f"bar {BAR:g}")
    axes.set_xticks(range(len(ELEMENTS)), ELEMENTS)
    axes.set(ylim=(1e-17, 1e-9), ylabel="relative error: place (open), σ (filled)")
    axes.set_title("The field is in the space", fontsize=10)
    axes.legend(fontsize=7, ncols=2, loc="upper left")


def _rates(axes: Any, found: Sequence[Sequence[Outcome]]) -> None:
    from matplotlib.ticker import FixedLocator, NullLocator

    counts = sorted({o.case.cells for own in found for o in own})
    for own in found:
        case, (place, stress) = own[0].case, rates(own)
        h, marker = [1 / o.case.cells for o in own], "o" if case.element == "P1" else "s"
        label = f"{case.law.replace('_', ' ')} {case.element}"
        for name, rate, line in (("stress", stress, "-"), ("place", place, "--")):
            if not np.isnan(rate):
                axes.loglog(
                    h, [getattr(o, name) for o in own], marker + line, ms=5, mfc="none",
                    color=_COLOURS[case.law], label=f"{label}, {name}: {rate:.2f}",
                )  # fmt: skip
    axes.set(xlabel="cell size h, m", ylabel="relative error")
    axes.set_title("The field is not in the space: Y² on P1 and Q1", fontsize=10)
    axes.xaxis.set_major_locator(FixedLocator([1 / n for n in counts]))
    axes.xaxis.set_minor_locator(NullLocator())
    axes.set_xticklabels([f"1/{n}" for n in counts])
    axes.set_ylim(bottom=1e-8)
    axes.grid(True, alpha=0.3)
    axes.legend(fontsize=7, loc="lower right", title="rate (theory: σ 1, place 2)",
                title_fontsize=7)  # fmt: skip
