"""Pictures of a law: its five tests, and a fit beside its data. Axes carry units; PNG or SVG."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from ..errors import InputError
from .modes import MODES, Mode

if TYPE_CHECKING:
    from .curves import Curve
    from .inspect_law import Inspection
    from .limits import Limit

Floats = npt.NDArray[np.float64]

UNITS = (("GPa", 1e9), ("MPa", 1e6), ("kPa", 1e3), ("Pa", 1.0), ("mPa", 1e-3))
AXIS_OF = {"stretch": "stretch λ (1)", "shear": "amount of shear γ (1)",
           "volume ratio": "volume ratio J (1)"}  # fmt: skip
#: Colours told apart by the colour-blind; Okabe and Ito (2008).
COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00")
_STEEP = 10.0  # a largest stress over the median one, beyond which the axis is cut


def draw_inspection(found: Inspection, file: Path) -> Path:
    """The five tests of a law, with the stretches at which it is not elliptic shaded."""
    figure = new_figure(10.0, 6.6)
    panels = figure.subplots(2, 3).ravel()
    for mode, axes in zip(MODES.values(), panels, strict=False):
        drawn = [c for c in found.curves if c.mode is mode]
        _draw_mode(axes, mode, drawn, [x for x in found.losses if x.curve.mode is mode])
    _write_words(panels[-1], found)
    figure.suptitle(f"{found.law.name}: stress in five tests", fontsize=13)
    return save(figure, file)


def new_figure(width: float, height: float) -> Any:
    """A figure of its own, inches: nothing of pyplot, so nothing is global."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(width, height), dpi=150, layout="constrained")
    FigureCanvasAgg(figure)
    return figure


def save(figure: Any, file: Path) -> Path:
    """Write the figure in the format of the file's suffix.

    Raises:
        InputError: it is neither .png nor .svg.
    """
    if file.suffix not in (".png", ".svg"):
        raise InputError(f"a picture must end in .png or .svg, got {file.name}.")
    # no date in the file: the same law gives the same picture
    figure.savefig(file, metadata={"Date": None} if file.suffix == ".svg" else None)
    return file


def unit_of(stresses: Floats) -> tuple[str, float]:
    """The unit in which the largest of ``stresses``, Pa, is at least 1, with its size in Pa."""
    finite = np.abs(stresses[np.isfinite(stresses)])
    largest = finite.max(initial=0.0)
    return next((u for u in UNITS if largest >= u[1]), UNITS[-1] if largest else UNITS[3])


def shown_limits(stresses: Floats) -> tuple[float, float]:
    """Ends of a stress axis: all of it, or the greater part where a law grows exponentially."""
    finite = stresses[np.isfinite(stresses)]
    low, high = finite.min(initial=0.0), finite.max(initial=0.0)
    typical = _STEEP * np.median(np.abs(finite)) if finite.size else 0.0
    if typical > 0.0:
        low, high = max(low, -typical), min(high, typical)
    margin = 0.05 * (high - low) or 1.0
    return low - margin, high + margin


def _draw_mode(axes: Any, mode: Mode, drawn: list[Curve], lost: list[Limit]) -> None:
    lines = [line for curve in drawn for line in _lines(curve, several=len(drawn) > 1)]
    stresses = np.concatenate([stress for _, stress, *_ in lines])
    bottom, top = shown_limits(stresses)
    unit, size = unit_of(np.array([bottom, top]))
    for values, stress, label, colour, style in lines:
        axes.plot(values, stress / size, style, color=colour, label=label, linewidth=1.8)
    if len(drawn) == 1:
        _shade(axes, drawn[0], lost)
    axes.set_ylim(bottom / size, top / size)
    axes.axhline(0.0, color="0.6", linewidth=0.8, zorder=0)
    cut = np.nanmin(stresses) < bottom or np.nanmax(stresses) > top
    axes.set_title(f"{mode.title}, axis cut" if cut else mode.title, fontsize=11)
    axes.set_xlabel(AXIS_OF[mode.control])
    quantity = "shear stress" if mode.control == "shear" else "stress"
    axes.set_ylabel(f"{quantity if mode.measured else 'pressure'} ({unit})")
    axes.legend(fontsize=8.5, edgecolor="none", framealpha=0.8)


def _lines(curve: Curve, several: bool) -> list[tuple[Floats, Floats, str, str, str]]:
    """(values, stress, label, colour, style) of each line of a curve."""
    if curve.mode.measured is None:
        return [(curve.values, curve.stress, "−tr σ / 3", COLOURS[0], "-")]
    i, j = curve.mode.measured
    if several:
        names = "xyz"[curve.axes[i]] + "xyz"[curve.axes[j]]
        label = f"nominal, P{names}"
        style = ("-", "--", ":")[curve.axes[0]]
        return [(curve.values, curve.stress, label, COLOURS[curve.axes[0]], style)]
    lines = [(curve.values, curve.stress, f"nominal, P{i + 1}{j + 1}", COLOURS[0], "-")]
    if curve.mode.control != "shear":  # where both are the same
        true = (curve.values, curve.cauchy[:, i, j], f"true, σ{i + 1}{j + 1}", COLOURS[1], "--")
        lines.append(true)
    return lines


def _shade(axes: Any, curve: Curve, lost: list[Limit]) -> None:
    low, high = curve.values.min(), curve.values.max()
    axes.set_xlim(low, high)
    for count, limit in enumerate(lost):
        ends = (low, limit.value) if limit.side == "below" else (limit.value, high)
        axes.axvspan(*ends, color="0.85", label="" if count else "not elliptic", zorder=-1)


def _write_words(axes: Any, found: Inspection) -> None:
    axes.axis("off")
    lines = [f"{name} = {_value(v)}{_unit(found, name)}" for name, v in found.values.items()]
    if "isotropic" in found.law.exceptions:
        lines += ["", "Pxx: pulled along x;", "equibiaxial in xy, yz, zx;"]
        lines.append("planar: next axis held")
    text = "\n".join(["Parameters", "", *lines])
    axes.text(0.02, 0.98, text, transform=axes.transAxes, va="top",
              fontsize=10 if len(lines) < 16 else 8)  # fmt: skip


def _value(value: Any) -> str:
    if np.ndim(value):
        return "(" + ", ".join(f"{v:.3g}" for v in value) + ")"
    return f"{value:.5g}"


def _unit(found: Inspection, name: str) -> str:
    unit = next(p.unit for p in found.law.parameters if p.name == name)
    return "" if unit == "1" else f" {unit}"
