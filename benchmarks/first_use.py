"""What the first use of an energy on an element costs: kernels generated and compiled.

    units, each in a fresh process with an empty cache → first_use.md and .json in --out

Generation is the process' own CPU time, imports of UFL and FFCx too; compilation that of the
compilers it starts. A later use finds the library in the cache.
"""

from __future__ import annotations

import argparse
import json
import os
import resource
import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path

import output

from supple import laws
from supple.kernels import build
from supple.kernels.unit import parse

UNITS = (
    "neo_hookean.P1.direct", "neo_hookean.P2.direct", "neo_hookean.Q1.direct",
    "neo_hookean.Q2.direct", "neo_hookean.P2.inverse", "mooney_rivlin.P2.mixed_direct",
    "holzapfel_ogden.P1.direct", "holzapfel_ogden.P2.direct", "ogden.P2.direct",
)  # fmt: skip


@dataclass(frozen=True)
class Row:
    """Seconds: wall of all, CPU of the parts, wall of a later use; kB of the library."""

    unit: str
    first: float
    generation: float
    compilation: float
    later: float
    kilobytes: float


def one(name: str) -> Row:
    """Compile one unit in this process, with nothing in the cache."""
    begin = time.perf_counter()
    unit = parse(name, laws.folder())
    with tempfile.TemporaryDirectory() as folder:
        ahead, cache = Path(folder) / "ahead", Path(folder) / "cache"
        ahead.mkdir()
        (ahead / "kernel.h").write_bytes((laws._ahead() / "kernel.h").read_bytes())
        library = build.library(unit, ahead, cache)
        first = time.perf_counter() - begin
        own, children = (
            sum(resource.getrusage(who)[:2])
            for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)
        )
        begin = time.perf_counter()
        build.library(unit, ahead, cache)
        later = time.perf_counter() - begin
        return Row(name, first, own, children, later, library.stat().st_size / 1e3)


def measure(name: str) -> Row:
    """The same in a fresh process."""
    command = [sys.executable, __file__, "--one", name]
    done = subprocess.run(command, check=True, stdout=subprocess.PIPE, text=True)
    return Row(**json.loads(done.stdout))


def table(rows: list[Row], machine: str) -> str:
    """Markdown."""
    head = ("unit", "first use, s", "generation, CPU s", "compilation, CPU s", "later use, ms",
            "library, kB")  # fmt: skip
    body = (
        (r.unit, f"**{output.digits(r.first)}**", output.digits(r.generation),
         output.digits(r.compilation), output.digits(1e3 * r.later), f"{r.kilobytes:.0f}")
        for r in rows
    )  # fmt: skip
    return "\n".join(["# First use", "", machine, "", *output.markdown(head, body)]) + "\n"


def main() -> None:
    """Measure and write."""
    parser = output.options(__doc__, repeats=1)
    parser.add_argument("--units", nargs="+", default=UNITS)
    parser.add_argument("--one", help=argparse.SUPPRESS)
    given = parser.parse_args()
    if given.one:
        print(json.dumps(vars(one(given.one))))
        return
    load = os.getloadavg()[0]
    rows = [measure(name) for name in given.units]
    machine = output.machine(load, "one compilation a unit, empty cache")
    output.write(given.out, "first_use", table(rows, machine), machine, rows)


if __name__ == "__main__":
    main()
