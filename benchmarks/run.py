"""`make bench`: every benchmark that this machine can run, into benchmarks/results.md and .json.

    parts, each a script in a process of its own → their tables in --out → one page, one file

A part that fails leaves its last words on the page and the others run. --only names parts.
"""

from __future__ import annotations

import argparse
import json
import shutil
import subprocess
import sys
import time
from dataclasses import dataclass
from pathlib import Path

import output
import team

HERE = Path(__file__).parent
#: In the order of the page; the script of each has its name.
PARTS = ("newton", "linear", "kernels", "growth", "threads", "first_use", "rest_shape")
#: Which of the options the parts take.
TAKES = {"newton": ("dolfinx", "felupe", "febio"), "growth": ("largest", "largest_direct")}


@dataclass(frozen=True)
class Done:
    """How a part ended: seconds, and what it said last if it failed."""

    part: str
    seconds: float
    failure: str = ""


def run(part: str, given: argparse.Namespace) -> Done:
    """One part; its errors are shown as they come."""
    command = [sys.executable, str(HERE / f"{part}.py"), "--out", str(given.out)]
    for name in TAKES.get(part, ()):
        value = getattr(given, name)
        if value is not None:
            command += [f"--{name.replace('_', '-')}", str(value)]
    if part == "rest_shape" and not given.large:
        command.append("--skip-large")
    if given.repeats:
        command += ["--repeats", str(given.repeats)]
    begin = time.perf_counter()
    done = subprocess.run(command, stderr=subprocess.PIPE, text=True, check=False)
    words = done.stderr.strip().splitlines() or ["no word"]
    failure = f"status {done.returncode}: {words[-1]}" if done.returncode else ""
    return Done(part, time.perf_counter() - begin, failure)


def page(parts: list[Done], folder: Path) -> str:
    """Markdown of all parts, their headings one level down."""
    texts = ["# Benchmarks\n\nWritten by `make bench`; how to read it: README.md."]
    for done in parts:
        if done.failure:
            texts.append(f"## {done.part}\n\nNot measured: {done.failure}")
            continue
        text = (folder / f"{done.part}.md").read_text(encoding="utf-8").strip()
        texts.append(f"#{text}\n\nTook {done.seconds:.0f} s.")
    return "\n\n".join(texts) + "\n"


def collected(parts: list[Done], folder: Path) -> dict[str, object]:
    """The numbers of all parts by name."""
    files = {d.part: folder / f"{d.part}.json" for d in parts if not d.failure}
    return {n: json.loads(f.read_text(encoding="utf-8")) for n, f in files.items() if f.exists()}


def main() -> None:
    """Measure and write."""
    parser = output.options(__doc__, repeats=0)
    team.add_options(parser)
    parser.add_argument("--only", nargs="+", choices=PARTS, default=PARTS)
    parser.add_argument("--largest", type=int, help="dofs of the growth with multigrid")
    parser.add_argument("--largest-direct", type=int, help="dofs of the growth with factors")
    parser.add_argument("--large", action="store_true", help="rest shapes of 100,000 dofs too")
    parser.add_argument("--results", type=Path, default=HERE, help="folder of the page")
    given = parser.parse_args()
    parts = [run(part, given) for part in PARTS if part in given.only]
    given.results.mkdir(parents=True, exist_ok=True)
    (given.results / "results.md").write_text(page(parts, given.out), encoding="utf-8")
    numbers = json.dumps(collected(parts, given.out), indent=1)
    (given.results / "results.json").write_text(numbers + "\n", encoding="utf-8")
    for picture in given.out.glob("growth.*g"):
        shutil.copy(picture, given.results / picture.name)
    if any(done.failure for done in parts):
        sys.exit("; ".join(f"{d.part}: {d.failure}" for d in parts if d.failure))


if __name__ == "__main__":
    main()
