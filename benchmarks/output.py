"""What the benchmarks share: their options, the machine in a line, and how a table is written."""

from __future__ import annotations

import argparse
import json
import os
import platform
from collections.abc import Iterable, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any


def options(about: str, repeats: int, out: str = "out/bench") -> argparse.ArgumentParser:
    """A parser with --repeats and --out."""
    parser = argparse.ArgumentParser(description=about.splitlines()[0])
    parser.add_argument("--repeats", type=int, default=repeats)
    parser.add_argument("--out", type=Path, default=Path(out))
    return parser


def machine(load: float, how: str) -> str:
    """Its processors, what else ran on it before, and ``how`` was measured."""
    return (
        f"{platform.machine()}, {processor()}, {os.cpu_count()} cores, load {load:.1f} before the "
        f"run, {how}."
    )


def processor() -> str:
    """Its model as the system names it."""
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
    except OSError:
        return platform.processor()
    names = [line.split(":", 1)[1].strip() for line in lines if line.startswith("model name")]
    return names[0] if names else platform.processor()


def markdown(head: Sequence[str], rows: Iterable[Sequence[Any]]) -> list[str]:
    """Lines of a table; None becomes a dash."""
    lines = ["| " + " | ".join(head) + " |", "|" + "---|" * len(head)]
    for row in rows:
        lines.append("| " + " | ".join("–" if x is None else str(x) for x in row) + " |")
    return lines


def digits(value: float | None, count: int = 3) -> str | None:
    """With ``count`` significant digits and no exponent where that is short."""
    if value is None or value != value:
        return None
    if value == 0 or not 1e-4 <= abs(value) < 1e7:
        return f"{value:.{count - 1}e}" if value else "0"
    rounded = float(f"{value:.{count}g}")
    decimals = max(0, count - 1 - len(str(int(abs(rounded)))) + 1) if abs(rounded) >= 1 else None
    return f"{rounded:.{count}g}" if decimals is None else f"{rounded:.{decimals}f}"


def share(part: float | None, whole: float | None) -> str | None:
    """In percent."""
    if part is None or not whole:
        return None
    percent = 100 * part / whole
    return f"{percent:.0f} %" if percent >= 10 else f"{percent:.1f} %"


def write(folder: Path, name: str, text: str, machine: str, rows: Sequence[Any] = ()) -> None:
    """``name``.md, printed too, and if there are rows (dataclasses) ``name``.json."""
    folder.mkdir(parents=True, exist_ok=True)
    (folder / f"{name}.md").write_text(text, encoding="utf-8")
    if rows:
        report = {"machine": machine, "rows": [asdict(r) for r in rows]}
        (folder / f"{name}.json").write_text(json.dumps(report, indent=1), encoding="utf-8")
    print(text)
