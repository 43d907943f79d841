"""The sagging block's errors over μ and λ, and over the mesh, as SVG and PNG."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from . import sagging_block_convergence as convergence
from .journal import Journal
from .output import save
from .sagging_block import BAR, LMBDA, MU, NO_FORWARD, PRINTED, SOLVED
from .sagging_block_samples import column, outcomes


def draw(journal: Journal, printed: Mapping[tuple[float, float], float], path: Path) -> Path:
    """MAE of the rest shape and of reversed gravity; ``printed`` has ours at the thesis' points.

    ``path`` ends in .svg or .png.
    """
    from matplotlib.figure import Figure

    figure = Figure(figsize=(13, 5), layout="constrained")
    left, right = figure.subplots(1, 2, sharey=True)
    title = "Inverse: distance of the rest shape to the cube"
    _panel(figure, left, journal, "mae_m", (1e-18, 1e-8), title)
    _thesis(left, printed)
    title = "Reversed gravity, the same samples"
    _panel(figure, right, journal, "reversed_gravity_mae_m", None, title)
    left.set_ylabel("λ, MPa")
    count = outcomes(journal).count(SOLVED)
    figure.suptitle(
        f"Sagging block, mixed P2–P1: {count} samples, largest MAE "
        f"{np.nanmax(column(journal, 'mae_m'), initial=0.0):.1e} m (bar {BAR:g} m)"
    )
    return save(figure, path)


def _panel(figure: Any, axes: Any, journal: Journal, name: str, limits: Any, title: str) -> None:
    from matplotlib.colors import LogNorm

    mu, lmbda, error = (column(journal, n) for n in ("mu_pa", "lambda_pa", name))
    outcome = np.array(outcomes(journal))
    apart, failed = outcome == NO_FORWARD, (outcome != NO_FORWARD) & np.isnan(error)
    low, high = limits or (None, None)
    norm = LogNorm(low, high)
    shown = axes.scatter(
        mu / 1e3, lmbda / 1e6, c=error, norm=norm, s=14, cmap="viridis", rasterized=True
    )
    figure.colorbar(shown, ax=axes, label="MAE, m", extend="both" if limits else "neither")
    label = f"no stable shape under the weight ({apart.sum()})"
    axes.plot(mu[apart] / 1e3, lmbda[apart] / 1e6, "x", ms=5, color="tab:red", label=label)
    if failed.any():
        label = f"failed ({failed.sum()})"
        axes.plot(mu[failed] / 1e3, lmbda[failed] / 1e6, "k*", ms=9, label=label)
    axes.set(xlabel="μ, kPa", xscale="log", xlim=(0.9 * MU[0] / 1e3, 1.1 * MU[1] / 1e3))
    axes.set(ylim=(0.0, 1.2 * LMBDA[1] / 1e6))
    axes.set_title(title, fontsize=10)
    axes.legend(loc="upper left", fontsize=8)


def _thesis(axes: Any, printed: Mapping[tuple[float, float], float]) -> None:
    """The two points whose error the thesis prints."""
    for (mu, lmbda), ours in printed.items():
        place = (mu / 1e3, lmbda / 1e6)
        axes.plot(*place, "o", ms=11, mfc="none", mec="tab:red", mew=1.5)
        text = f"thesis {PRINTED[mu, lmbda]:.2e} m\nhere {ours:.0e} m"
        axes.annotate(
            text, place, (-12, 12), textcoords="offset points", fontsize=8, ha="right",
            bbox={"boxstyle": "round", "fc": "white", "ec": "tab:red", "alpha": 0.9},
        )  # fmt: skip


def draw_convergence(rows: Sequence[convergence.Row], path: Path) -> Path:
    """Sag of the top's centre and processor time over the unknowns; ``path`` as in `draw`."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(11, 4.5), layout="constrained")
    left, right = figure.subplots(1, 2)
    for name in dict.fromkeys(row.name for row in rows):
        own = [row for row in rows if row.name == name]
        dofs = [row.dofs for row in own]
        left.semilogx(dofs, [1e3 * row.found.sag for row in own], "o-", label=name)
        right.loglog(dofs, [row.found.mae for row in own], "o-", label=name)
    left.set(xlabel="unknowns", ylabel="the top's centre sinks by, mm")
    left.set_title("Forward", fontsize=10)
    right.axhline(BAR, color="grey", ls=":", label=f"bar {BAR:g} m")
    right.set(xlabel="unknowns", ylabel="MAE of the round trip, m", ylim=(1e-18, 1e-8))
    right.set_title("Forward, then inverse: back to the cube", fontsize=10)
    for axes in (left, right):
        axes.grid(True, alpha=0.3)
        axes.legend(fontsize=8)
    figure.suptitle(
        f"Sagging block, μ = {convergence.MU / 1e3:g} kPa, λ = {convergence.LMBDA / 1e6:g} MPa"
    )
    return save(figure, path)
