"""The tables of the registration benchmark, in Markdown."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
import output

#: Of the thesis' own fits (tables 2 and 3): standing and supine.
_THESIS = "thesis: surface 2.41 / 2.28 mm, landmarks 8.46 / 7.61 mm, 1.85 / 2.20 s (slowest 3.01)"

Row = dict[str, Any]


def text(rows: Sequence[Row], machine: str) -> str:
    """All tables of one page."""
    ours = [row for row in rows if "peer" not in row]
    peers = [row for row in rows if "peer" in row]
    lines = ["# Torso registration on synthetic scans", "", machine, "", f"{_THESIS}.", ""]
    lines += ["## Errors, mm", "", *_errors(ours), ""]
    lines += ["## Seconds", "", *_seconds(ours), ""]
    lines += ["## Failures", "", *_failures(ours)]
    if peers:
        lines += ["", "## Beside trimesh's non-rigid registration", "", *_peers(ours, peers)]
    return "\n".join(lines) + "\n"


def _groups(rows: Sequence[Row], key: Callable[[Row], Any]) -> list[tuple[Any, list[Row]]]:
    """Rows by what ``key`` says of them, in the order of first sight."""
    names = list(dict.fromkeys(key(row) for row in rows))
    return [(name, [row for row in rows if key(row) == name]) for name in names]


def _noise(row: Row) -> str:
    return "none" if row["noise_mm"] == 0 else "1–3"


def _errors(rows: Sequence[Row]) -> list[str]:
    head = ("scan → fitted", "noise", "pose", "n", "surface", "worst", "scan's points",
            "landmarks", "95 %", "max", "vertices", "past rim", "in 95 % band", "failed",
            "not trusted")  # fmt: skip
    table = []
    for (pair, noise), part in sorted(_groups(rows, lambda r: (r["pair"], _noise(r)))):
        for pose, own in [*_groups(part, lambda r: r["pose"]), ("all", part)]:
            table.append((pair, noise, pose, *_error(own)))
    return output.markdown(head, table)


def _error(rows: Sequence[Row]) -> tuple[Any, ...]:
    def mean(name: str) -> float:
        return float(np.mean([row[name] for row in rows]))

    each = [mm for row in rows for mm in row["landmarks"].values()]
    surface = [row["surface"] for row in rows]
    return (
        len(rows), f"{mean('surface'):.2f}", f"{max(surface):.2f}", f"{mean('scan'):.2f}",
        f"{np.mean(each):.2f}", f"{np.percentile(each, 95):.1f}", f"{max(each):.1f}",
        output.digits(mean("vertices")), f"{100 * mean('beyond'):.1f} %",
        f"{100 * mean('covered'):.0f} %", sum(row["failed"] for row in rows),
        sum(not row["trusted"] for row in rows),
    )  # fmt: skip


def _seconds(rows: Sequence[Row]) -> list[str]:
    head = ("scan → fitted", "n", "cold, median", "95 %", "processor", "warm, median", "95 %",
            "processor", "warm surface, mm", "warm failed")  # fmt: skip
    table = []
    noisy = [row for row in rows if row["noise_mm"] > 0]
    for pair, own in [*_groups(noisy, lambda r: r["pair"]), ("all", noisy)]:
        cells = [
            f"{f(some):.3f}" if (some := _finite(own, name)) else "–"
            for name, f in (("seconds", np.median), ("seconds", _late), ("cpu", np.median),
                            ("warm_seconds", np.median), ("warm_seconds", _late),
                            ("warm_cpu", np.median))
        ]  # fmt: skip
        warm = f"{np.mean(some):.2f}" if (some := _finite(own, "warm_surface")) else "–"
        failed = sum(bool(row["warm_failed"]) for row in own)
        table.append((pair, len(own), *cells, warm, failed))
    return output.markdown(head, table) if noisy else ["none with noise"]


def _finite(rows: Sequence[Row], name: str) -> list[float]:
    """Of the rows that have it: not all have a next frame."""
    return [row[name] for row in rows if np.isfinite(row[name])]


def _late(values: Sequence[float]) -> float:
    return float(np.percentile(values, 95))


def _failures(rows: Sequence[Row]) -> list[str]:
    failed = [row for row in rows if row["failed"]]
    head = ("case", "surface", "worst landmark", "mm", "trusted")
    table = [(r["key"], f"{r['surface']:.2f}", r["worst"], f"{r['worst_mm']:.1f}",
              "yes" if r["trusted"] else "no") for r in failed]  # fmt: skip
    return output.markdown(head, table) if failed else ["None."]


def _peers(ours: Sequence[Row], peers: Sequence[Row]) -> list[str]:
    head = ("method", "n", "surface, mm", "landmarks, mm", "max", "failed", "seconds, median")
    cases = {row["of"] for row in peers}
    groups = [("ours", [row for row in ours if row["key"] in cases])]
    groups += _groups(peers, lambda r: r["peer"])
    return output.markdown(head, [(name, *_peer(own)) for name, own in groups])


def _peer(rows: Sequence[Row]) -> tuple[Any, ...]:
    mean = {name: np.mean([row[name] for row in rows]) for name in ("surface", "landmark")}
    return (
        len(rows), f"{mean['surface']:.2f}", f"{mean['landmark']:.2f}",
        f"{max(row['worst_mm'] for row in rows):.1f}", sum(row["failed"] for row in rows),
        output.digits(float(np.median([row["seconds"] for row in rows]))),
    )  # fmt: skip
