"""The single tetrahedra: errors of each method, and forward solves over the strain."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from .output import save
from .single_tetrahedron_run import BAR, MAX_SOLVES, THESIS, Result

_STYLE = {
    "inverse": ("o", "tab:blue", "inverse, one solve"),
    "sellier_1e-6": ("^", "tab:orange", "Sellier to 1e-6"),
    "sellier_same_accuracy": ("s", "tab:red", "Sellier to 1e-12"),
    "anderson_same_accuracy": ("D", "tab:green", "Anderson–Sellier to 1e-12"),
}


def draw(results: Sequence[Result], path: Path) -> Path:
    """``path`` ends in .svg or .png."""
    from matplotlib.figure import Figure
    from matplotlib.ticker import NullFormatter

    figure = Figure(figsize=(12, 5), layout="constrained")
    left, right = figure.subplots(1, 2)
    moved = np.array([r.moved for r in results])
    for name, (marker, colour, label) in _STYLE.items():
        found = [r.found[name] for r in results]
        error = np.maximum([f.error for f in found], 1e-18)
        left.loglog(moved, error, marker, ms=4, color=colour, mfc="none", label=label)
        if name in THESIS:
            thesis, side = THESIS[name][0], "left" if name == "inverse" else "right"
            left.axhline(thesis, color=colour, lw=1, ls="--", alpha=0.7)
            place = moved.min() if side == "left" else moved.max()
            left.text(place, thesis, f"thesis {thesis:.2e}", va="bottom", ha=side,
                      color=colour, fontsize=8)  # fmt: skip
        if name == "inverse":
            continue
        solves, good = np.array([f.solves for f in found]), ~np.isnan(error)
        shown = f"{label}: mean {solves[good].mean():.1f}, {(~good).sum()} failed"
        right.semilogx(moved[good], solves[good], marker, ms=4, color=colour, mfc="none",
                       label=shown)  # fmt: skip
        right.semilogx(moved[~good], solves[~good], "x", ms=7, color=colour)
    left.axhline(BAR, color="grey", lw=1, ls=":")
    left.text(moved.min(), BAR, "bar of the inverse's mean", va="top", fontsize=8, color="grey")
    left.set(ylabel="mean distance of the nodes to the drawn shape, m", ylim=(5e-19, 1e-2))
    left.legend(fontsize=8, loc="upper left", ncols=2)
    right.axhline(1, color="tab:blue", lw=1, label="inverse: one solve")
    right.set(ylabel="forward solves (× failed in 50)", ylim=(0, MAX_SOLVES + 2))
    right.legend(fontsize=8)
    for axes in (left, right):
        axes.xaxis.set_minor_formatter(NullFormatter())
        axes.set_xlabel("way of the free node / height of the tetrahedron")
        axes.grid(True, alpha=0.3)
    figure.suptitle(f"Single tetrahedron: {len(results)} loaded shapes taken back to rest")
    return save(figure, path)
