"""Errors of registered torsos over what was varied, a panel each sweep, as SVG and PNG."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from .output import save

#: Axis of each sweep; the others are factors of a weight.
_AXES = {"landmarks": "landmarks given", "blendshapes": "blendshapes of the template"}
_SYMBOLS = {"data": "λ data", "scale": "λ$_s$ scale", "blendshape": "λ$_b$ blendshape",
            "joint": "λ$_j$ joint", "landmark": "λ$_l$ landmark"}  # fmt: skip
_COLOURS = {"standing": "tab:blue", "supine": "tab:orange", "arms_up": "tab:green",
            "tilted": "tab:red"}  # fmt: skip
#: Lines of each pair of templates.
_STYLES = ("-", "--", ":")
_ERRORS = (("surface_mm", "surface, mm"), ("landmark_mm", "landmarks, mm"))


def draw(rows: Sequence[dict[str, Any]], path: Path) -> Path:
    """Columns: sweeps; rows: surface and landmark error; ``path`` ends in .svg or .png."""
    from matplotlib.figure import Figure

    sweeps = list(dict.fromkeys(row["sweep"] for row in rows))
    figure = Figure(figsize=(max(5.5, 3.2 * len(sweeps)), 6.4), layout="constrained")
    panels = figure.subplots(2, len(sweeps), squeeze=False, sharey="row", sharex="col")
    for column, sweep in enumerate(sweeps):
        own = [row for row in rows if row["sweep"] == sweep]
        for axes, (error, _) in zip(panels[:, column], _ERRORS, strict=True):
            _panel(axes, own, error)
        panels[-1, column].set_xlabel(_AXES.get(sweep, f"factor of {_SYMBOLS.get(sweep, sweep)}"))
    for axes, (error, label) in zip(panels[:, 0], _ERRORS, strict=True):
        axes.set_ylabel(label)
        axes.set_ylim(0, 1.05 * max(row[error] for row in rows))  # of the whole line of panels
    bodies = len({row.get("shape") for row in rows})
    figure.suptitle(f"Template registered to scans with a known answer, bodies a pose: {bodies}",
                    fontsize=10)  # fmt: skip
    legend = {label: handle for axes in panels.flat for handle, label in
              zip(*axes.get_legend_handles_labels(), strict=True)}  # fmt: skip
    figure.legend(legend.values(), legend.keys(), loc="outside lower center", fontsize=9,
                  ncols=3 if len(sweeps) > 1 else 1)  # fmt: skip
    return save(figure, path)


def _panel(axes: Any, rows: Sequence[dict[str, Any]], error: str) -> None:
    """Mean over bodies by pose and pair, from the least to the largest shaded, failures crossed."""
    pairs = list(dict.fromkeys(row["pair"] for row in rows))
    for pose, pair in dict.fromkeys((row["pose"], row["pair"]) for row in rows):
        own = [row for row in rows if (row["pose"], row["pair"]) == (pose, pair)]
        at = sorted({row["at"] for row in own})
        values = [np.array([row[error] for row in own if row["at"] == x]) for x in at]
        colour, style = _COLOURS.get(pose, "tab:grey"), _STYLES[pairs.index(pair) % len(_STYLES)]
        axes.plot(at, [v.mean() for v in values], marker="o", ms=4, color=colour, ls=style,
                  label=f"{pair.replace('→', ' scanned, ')} fitted: {pose}")  # fmt: skip
        axes.fill_between(at, [v.min() for v in values], [v.max() for v in values],
                          color=colour, alpha=0.12, lw=0)  # fmt: skip
    bad = [row for row in rows if row["failed"]]
    if bad:
        axes.plot([row["at"] for row in bad], [row[error] for row in bad], "x", color="black", ms=8,
                  mew=1.5, label="failed: surface > 5 mm or a landmark > 20 mm")  # fmt: skip
    if rows and rows[0]["sweep"] not in _AXES:
        axes.set_xscale("log")
    axes.grid(True, alpha=0.25)
