"""What the benchmarks share: their options, the machine in a line, and how a table is written."""

from __future__ import annotations

import argparse
import json
import os
import platform
from collections.abc import Sequence
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
    return f"{platform.machine()}, {os.cpu_count()} cores, load {load:.1f} before the run, {how}."


def write(folder: Path, name: str, text: str, machine: str, rows: Sequence[Any] = ()) -> None:
    """``name``.md, printed too, and if there are rows (dataclasses) ``name``.json."""
    folder.mkdir(parents=True, exist_ok=True)
    (folder / f"{name}.md").write_text(text, encoding="utf-8")
    if rows:
        report = {"machine": machine, "rows": [asdict(r) for r in rows]}
        (folder / f"{name}.json").write_text(json.dumps(report, indent=1), encoding="utf-8")
    print(text)
