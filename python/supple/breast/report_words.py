"""The words and tables of the report; every string that a user may have chosen is escaped."""

from __future__ import annotations

from html import escape
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from supple.breast.report_scene import most_movement
from supple.breast.result import NIPPLE_ESTIMATED
from supple.page import bullets, rows

if TYPE_CHECKING:
    from supple.breast.report import ReportData
    from supple.breast.result import Point, Result

AXES = (("left", "right"), ("back (posterior)", "front (anterior)"), ("head", "feet"))


def words(data: ReportData) -> dict[str, str]:
    """What the page's template names, as HTML."""
    result, tumour = data.result, data.result.tumour
    shift = np.subtract(tumour.supine_mm, tumour.prone_mm)
    return {
        "title": escape(data.title or "Prone to supine prediction"),
        "depth": f"{tumour.depth_mm:.0f}",
        "clock": escape(_clock(tumour.clock)),
        "breast": escape(tumour.breast),
        "nipple_distance": f"{tumour.nipple_distance_mm:.0f}",
        "nipple_note": _nipple_note(result),
        "shift": f"{np.linalg.norm(shift):.0f}",
        "shift_words": escape(_directions(shift)),
        "prone_mm": _coordinates(tumour.prone_mm),
        "supine_mm": _coordinates(tumour.supine_mm),
        "verdict": _verdict(result),
        "error_bar": _error_bar(result),
        "warnings": bullets(result.warnings),
        "assumed": rows(_assumed(data)),
        "checks": _checks(result),
        "figures": rows(_figures(result)),
        "versions": rows(list(result.versions.items())),
        "ticks": "".join(f"<span>{v:g}</span>" for v in np.linspace(0, most_movement(data), 5)),
        "scan_toggle": "" if data.scan is not None else "hidden",
        "gland_toggle": "" if data.gland is not None else "hidden",
        "chest_toggle": "" if data.chest is not None else "hidden",
    }


def _nipple_note(result: Result) -> str:
    estimated = NIPPLE_ESTIMATED in result.warnings
    return "; <b>the nipple is estimated</b>, up to 20 mm off" if estimated else ""


def _clock(clock: str) -> str:
    return "behind the nipple" if clock == "central" else f"{clock} o'clock"


def _coordinates(point: Point) -> str:
    signs = [("L", "R"), ("P", "A"), ("S", "I")]
    return " ".join(
        f"{pair[int(v < 0)]}&nbsp;{abs(v):.1f}" for v, pair in zip(point, signs, strict=True)
    )


def _directions(shift: NDArray[np.float64]) -> str:
    """The parts of a shift that reach 1 mm, largest first, in anatomical words."""
    parts = [
        (abs(v), f"{abs(v):.0f} mm to the {pair[int(v < 0)]}")
        for v, pair in zip(shift, AXES, strict=True)
        if abs(v) >= 1.0
    ]
    return ", ".join(text for _, text in sorted(parts, reverse=True)) or "less than 1 mm"


def _verdict(result: Result) -> str:
    failed = [name for name, check in result.checks.items() if not check.passed]
    if failed:
        names = ", ".join(escape(name) for name in failed)
        return f'<p class="verdict bad"><b>✗ Do not rely on this result.</b> Failed: {names}.</p>'
    count = len(result.warnings)
    note = f" {count} warning{'s' if count > 1 else ''} below." if count else ""
    kind = "warn" if count else "good"
    total = len(result.checks)
    return f'<p class="verdict {kind}"><b>✓ All {total} checks passed.</b>{note}</p>'


def _error_bar(result: Result) -> str:
    parts = [f"No 95 % region: {escape(result.tumour.ellipsoid95_reason)}."]
    if result.skin_mae_mm is not None:
        parts.insert(0, f"Predicted skin to scan: {result.skin_mae_mm:.1f} mm mean distance.")
    if result.truth is not None:
        parts.insert(
            0,
            f"Synthetic patient: true error {result.truth.tumour_error_mm:.1f} mm "
            f"(rigid alignment alone: {result.truth.rigid_error_mm:.1f} mm).",
        )
    return " ".join(parts)


def _assumed(data: ReportData) -> list[tuple[str, str]]:
    rows = list(data.assumptions.items())
    for name, parameter in data.result.parameters.items():
        unit = "" if parameter.unit in ("", "1") else f" {parameter.unit}"
        sd = " (given, not measured)" if parameter.sd is None else f" ± {parameter.sd:.3g} (sd)"
        rows.append((name, f"{parameter.value:g}{unit}{sd}"))
    return rows


def _figures(result: Result) -> list[tuple[str, str]]:
    mesh = result.mesh
    rows = [
        ("mesh", f"{mesh.nodes:,} nodes, {mesh.cells:,} cells"),
        ("worst cell quality", f"{mesh.min_quality:.2f}"),
        ("volume", f"{mesh.volume_ml:.0f} ml"),
    ]
    return rows + [(f"time, {name}", f"{value:.1f} s") for name, value in result.seconds.items()]


def _checks(result: Result) -> str:
    rows = []
    for name, check in result.checks.items():
        figure = check.figure if isinstance(check.figure, str) else f"{check.figure:.4g}"
        mark = '<td class="pass">✓ pass</td>' if check.passed else '<td class="fail">✗ FAIL</td>'
        rows.append(f"<tr><th>{escape(name)}</th>{mark}<td>{escape(figure)}</td></tr>")
    return "".join(rows)
