"""How studies write what they found: figures, and tables of rows by name."""

from __future__ import annotations

import csv
import io
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..files import replacing

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def save(figure: Figure, path: Path) -> Path:
    """Write a figure as the SVG or PNG that the end of ``path`` names."""
    with replacing(path) as aside:
        figure.savefig(aside, format=path.suffix[1:], dpi=130)
    return path


def table(rows: Sequence[Mapping[str, Any]]) -> str:
    """Rows as CSV, cells that a row lacks empty; floats to four digits."""
    buffer = io.StringIO()
    keys = list(dict.fromkeys(key for row in rows for key in row))
    writer = csv.DictWriter(buffer, keys, lineterminator="\n")
    writer.writeheader()
    for row in rows:
        writer.writerow({k: f"{v:.4g}" if isinstance(v, float) else v for k, v in row.items()})
    return buffer.getvalue()
