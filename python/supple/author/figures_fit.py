"""The picture of a fit: data, fitted law, and what is left between them."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from .curves import along, reading
from .data import Series
from .figures import AXIS_OF, COLOURS, new_figure, save, unit_of
from .fit_result import Fit
from .points import PointLaw


def draw_fit(found: Fit, file: Path) -> Path:
    """Data and fitted curve above, residuals below, a column for each series."""
    from ..laws import read_law

    law = PointLaw(read_law(found.material), **found.values)
    figure = new_figure(max(7.0, 4.2 * len(found.series)), 6.6)
    grid = figure.subplots(
        2, len(found.series), sharex="col", squeeze=False, height_ratios=(2.6, 1.0)
    )
    for column, series in enumerate(found.series):
        _draw_series(grid[:, column], law, found, column, series)
    figure.suptitle(f"{law.law.name}: R² = {found.r_squared:.5f}", fontsize=13)
    return save(figure, file)


def _draw_series(axes: Any, law: PointLaw, found: Fit, column: int, series: Series) -> None:
    predicted = found.predicted[column]
    unit, size = unit_of(np.concatenate([series.stress, predicted]))
    top, bottom = axes
    values, stress = _curve(law, series)
    top.plot(values, stress / size, "-", color=COLOURS[0], linewidth=1.8, label="fitted law")
    top.plot(series.values, series.stress / size, "o", color=COLOURS[1], markersize=5,
             markerfacecolor="none", label="measured")  # fmt: skip
    top.set_title(f"{series.label}\nR² = {found.r_squared_of[column]:.5f}", fontsize=11)
    top.set_ylabel(f"{'pressure' if series.kind == 'pressure' else 'stress'} ({unit})")
    top.legend(fontsize=9, edgecolor="none", framealpha=0.8)
    left = series.stress - predicted
    unit, size = unit_of(left)
    bottom.axhline(0.0, color="0.6", linewidth=0.8, zorder=0)
    bottom.plot(series.values, left / size, "o", color=COLOURS[1], markersize=4)
    bottom.set_ylabel(f"measured − law ({unit})")
    bottom.set_xlabel(AXIS_OF[series.mode.control])
    bottom.margins(y=0.2)


def _curve(law: PointLaw, series: Series) -> tuple[Any, Any]:
    """The law from rest over the whole of the data: values and stress of the series' kind."""
    ends = np.append(series.values, series.mode.rest)
    values = np.linspace(ends.min(), ends.max(), 101)
    curve = along(law, series.mode, values)
    tensor = curve.nominal if series.kind == "nominal" else curve.cauchy
    return values, reading(series.mode, tensor)
