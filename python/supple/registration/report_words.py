"""The words and tables of the page; every string that a user may have chosen is escaped."""

from __future__ import annotations

from html import escape
from typing import TYPE_CHECKING

from supple.page import bullets, rows
from supple.registration.body_size import body_size
from supple.registration.measures import OF_A_BREAST, OF_BOTH

if TYPE_CHECKING:
    from supple.registration.measures import Measure
    from supple.registration.report import ReportData


def words(data: ReportData) -> dict[str, str]:
    """What the page's template names, as HTML."""
    m, volume = data.metrics, {s: data.measures.of("volume", s) for s in ("left", "right")}
    return {
        "title": escape(data.title or "Registered torso"),
        "verdict": _verdict(data),
        "surface": f"{m.surface_mae_mm:.1f}",
        "used": f"{100 * m.used_share:.0f}",
        "landmarks": "–" if m.landmark_mae_mm is None else f"{m.landmark_mae_mm:.1f}",
        "landmarks_note": _given(data),
        "volume_left": _with_sd(volume["left"], 0),
        "volume_right": _with_sd(volume["right"], 0),
        "on_scan": _on_scan(data),
        "sides": _sides(data),
        "both": _both(data),
        "metrics": rows(_metrics(data)),
        "landmark_rows": _landmarks(data),
        "said": bullets(data.said),
        "meanings": rows((_plain(k), v[1]) for k, v in (OF_A_BREAST | OF_BOTH).items()),
        "versions": rows(data.versions.items()),
        "sd_toggle": "" if data.registration.covariance is not None else "hidden",
    }


def _verdict(data: ReportData) -> str:
    if not data.registration.trustworthy:
        reasons = bullets(data.registration.warnings)
        return f'<div class="verdict bad"><b>✗ Do not rely on this result.</b>{reasons}</div>'
    count = len(data.registration.warnings)
    if count:
        words = f"✓ Trustworthy, with {count} warning{'s' if count > 1 else ''}."
        told = bullets(data.registration.warnings)
        return f'<div class="verdict warn"><b>{words}</b>{told}</div>'
    return '<p class="verdict good"><b>✓ The fit is trustworthy by its own checks.</b></p>'


def _given(data: ReportData) -> str:
    if not data.given:
        return "no landmarks were given to compare with"
    return escape(f"{len(data.metrics.landmarks)} given, to those of the fit")


def _on_scan(data: ReportData) -> str:
    on = sum(int(c.on_scan.sum()) for c in data.curves.values())
    return f"{100 * on / max(sum(len(c.points) for c in data.curves.values()), 1):.0f}"


def _sides(data: ReportData) -> str:
    of = data.measures.of
    lines = [(f"{_plain(name)} ({unit})", _with_sd(of(name, "right")), _with_sd(of(name, "left")))
             for name, (unit, _) in OF_A_BREAST.items()]  # fmt: skip
    return rows(
        [*lines, ("grade of ptosis", *(data.measures.ptosis[s] for s in ("right", "left")))]
    )


def _both(data: ReportData) -> str:
    return rows((f"{_plain(name)} ({unit})", _with_sd(data.measures.of(name)))
                for name, (unit, _) in OF_BOTH.items())  # fmt: skip


def _metrics(data: ReportData) -> list[tuple[str, str]]:
    m, size = data.metrics, body_size(data.registration)
    mean = "none given" if m.landmark_mae_mm is None else f"{m.landmark_mae_mm:.2f} mm"
    return [
        ("surface, mean distance", f"{m.surface_mae_mm:.2f} mm"),
        ("surface, 95 % closer than", f"{m.surface_p95_mm:.2f} mm"),
        ("share of the scan used", f"{100 * m.used_share:.0f} %"),
        ("landmarks, mean distance", mean),
        ("chest under the breasts", f"{size.girth_cm:.0f} cm around"),
        ("sternal notch to folds", f"{size.length_cm:.0f} cm"),
        ("time of the fit alone", f"{m.seconds:.2f} s"),
        ("iterations", str(m.iterations)),
    ]


def _landmarks(data: ReportData) -> str:
    errors = {row.name: f"{row.error_mm:.1f}" for row in data.metrics.landmarks}
    lines = []
    for name, carried in data.landmarks.items():
        x, y, z = 1e3 * carried.points[0]
        where = "scan" if carried.on_scan[0] else "fitted skin"
        lines.append((_plain(name), f"{x:.1f}", f"{y:.1f}", f"{z:.1f}", where,
                      errors.get(name, "–")))  # fmt: skip
    return rows(lines)


def _with_sd(measure: Measure, digits: int = 1) -> str:
    spread = "" if measure.sd is None else f" ± {measure.sd:.{digits}f}"
    return f"{measure.value:.{digits}f}{spread}"


def _plain(name: str) -> str:
    return name.replace("_", " ")
