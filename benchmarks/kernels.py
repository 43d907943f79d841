"""Kernels alone: plain C of FFCx against lanes, µs a cell on one core, same flags on both sides.

    unit → both libraries → calls in turn on the same cells, several rounds → kernels.md and .json

Calls of one thread on deformed cells in turn, all in cache: no gather, no scatter, A is not
cleared; of a symmetric K the lanes form the lower triangle alone. Times are CPU time of the thread;
ratios are medians of the ratios within a round. The share of the peak counts the operations of the
instructions that run (flops.py) against fused multiply-adds in registers measured in the same run.
"""

from __future__ import annotations

import ctypes
import os
import statistics
from collections.abc import Iterator
from dataclasses import dataclass, replace

import flops
import native
import numpy as np
import output

import supple
from supple import laws
from supple.kernels import build
from supple.kernels.unit import Unit

LAWS = ("neo_hookean", "saint_venant_kirchhoff", "mooney_rivlin", "ogden", "holzapfel_ogden")
ELEMENTS = ("P1", "P2", "Q1", "Q2")
KERNELS = {"R": b"residual", "K": b"tangent"}
CELLS = 64
#: CPU seconds of one timing.
LONG_ENOUGH = 0.02
#: More instructions of the plain C and of lanes are not stepped through: each takes microseconds.
MOST_STEPS = (150_000, 800_000)


@dataclass(frozen=True)
class Row:
    """Medians, µs a cell; operations a cell; shares of the peak of one core."""

    law: str
    element: str
    kernel: str
    lanes: int
    plain_us: float
    lanes_us: float
    ratio: float
    plain_flops: float | None
    lanes_flops: float | None
    peak_gflops: float

    def share(self, which: str) -> float | None:
        """Of the peak."""
        operations = getattr(self, f"{which}_flops")
        if operations is None:
            return None
        return float(operations / getattr(self, f"{which}_us") / 1e3 / self.peak_gflops)


class Kernel:
    """One kernel of a library with the arrays of its calls."""

    def __init__(self, unit: Unit, name: bytes) -> None:
        self._c = native.load()
        self._library = self._c.open_library(laws.compiled(unit).encode())
        self._kernel = self._c.find(self._library, name)
        self.lanes = self._c.lanes(self._library)
        self.calls = -(-CELLS // self.lanes)
        x, fields = arrays(unit)
        w = [fields[self._name(k)] for k in range(self._c.field_count(self._kernel))]
        self._w, self._x = self._in_lanes(np.hstack(w)), self._in_lanes(x)

    def _name(self, place: int) -> str:
        return str(self._c.field_name(self._library, self._kernel, place).decode())

    def _in_lanes(self, rows: np.ndarray) -> np.ndarray:
        """(cells, entries) → (calls, entries, lanes)."""
        parts = rows.reshape(self.calls, self.lanes, -1)
        return np.ascontiguousarray(parts.transpose(0, 2, 1))

    def time(self, rounds: int) -> float:
        """µs a cell."""
        spent = self._c.time_calls(self._library, self._kernel, self._w.ctypes.data,
                                   self._x.ctypes.data, self.calls, rounds)  # fmt: skip
        return float(1e6 * spent / rounds / self.calls / self.lanes)

    def rounds(self) -> int:
        """Enough to be timed."""
        return max(1, round(LONG_ENOUGH * 1e6 / (self.time(1) * self.calls * self.lanes + 1e-9)))

    def flops(self, most: int) -> float | None:
        """Operations a cell; None where they cannot be counted."""
        steps = np.zeros(most, dtype=np.uint64)
        run = self._c.trace(self._library, self._kernel, self._w.ctypes.data, self._x.ctypes.data,
                            steps.ctypes.data_as(ctypes.c_void_p), most)  # fmt: skip
        return flops.count(steps[:run]) / self.lanes if 0 < run <= most else None


def arrays(unit: Unit) -> tuple[np.ndarray, dict[str, np.ndarray]]:
    """Coordinates (CELLS, 3m), m, and fields by name (CELLS, size) of cells deformed at random."""
    mesh = supple.Mesh.box((4, 4, 4), (4e-2, 4e-2, 4e-2), unit.element)
    kept = mesh.cells[:CELLS, mesh.table.from_vtk]
    rng = np.random.default_rng(0)
    moved = rng.normal(scale=3e-4, size=mesh.points.shape)
    fields = {"u": moved[kept].reshape(CELLS, -1)}
    if unit.law is None:
        raise ValueError(f"{unit.name} has no law")
    for parameter in laws.read_law(unit.law).parameters:
        value = np.ravel(np.asarray(parameter.default, dtype=float))
        fields[parameter.name] = np.tile(value, (CELLS, 1))
    return mesh.points[kept].reshape(CELLS, -1), fields


def pairs(names: tuple[str, ...], elements: tuple[str, ...]) -> Iterator[tuple[Unit, str]]:
    """Units in lanes and which of their kernels."""
    for law in names:
        for element in elements:
            for kernel in KERNELS:
                yield Unit("direct", element, laws.read_law(law).path), kernel


def measure(unit: Unit, kernel: str, repeats: int, peak: float) -> Row:
    """Both libraries in turn."""
    both = [Kernel(replace(unit, plain=plain), KERNELS[kernel]) for plain in (True, False)]
    rounds = [k.rounds() for k in both]
    times = [[k.time(n) for k, n in zip(both, rounds, strict=True)] for _ in range(repeats)]
    plain, lanes = (statistics.median(t[i] for t in times) for i in (0, 1))
    ratio = statistics.median(t[0] / t[1] for t in times)
    law = unit.name.split(".")[0]
    counts = [k.flops(most) for k, most in zip(both, MOST_STEPS, strict=True)]
    return Row(law, unit.element, kernel, both[1].lanes, plain, lanes, ratio, *counts, peak)


def table(rows: list[Row], machine: str) -> str:
    """Markdown."""
    head = ("energy", "element", "kernel", "lanes", "plain, µs", "lanes, µs", "plain / lanes",
            "flops a cell: plain, lanes", "share of peak: plain, lanes")  # fmt: skip
    body = (
        (r.law, r.element, r.kernel, r.lanes, output.digits(r.plain_us), output.digits(r.lanes_us),
         f"**{r.ratio:.1f}**", pair(output.digits(r.plain_flops), output.digits(r.lanes_flops)),
         pair(output.share(r.share("plain"), 1), output.share(r.share("lanes"), 1)))
        for r in rows
    )  # fmt: skip
    peak = rows[0].peak_gflops if rows else float("nan")
    about = f"{machine} Peak of one core: {peak:.1f} GFLOP/s. Flags: `{' '.join(build.FLAGS)}`."
    return "\n".join(["# Kernels alone", "", about, "", *output.markdown(head, body)]) + "\n"


def pair(first: str | None, second: str | None) -> str:
    """Both, a dash for none."""
    return f"{first or '–'}, {second or '–'}"


def main() -> None:
    """Measure and write."""
    parser = output.options(__doc__, repeats=5)
    parser.add_argument("--laws", nargs="+", default=LAWS, help="energies")
    parser.add_argument("--elements", nargs="+", default=ELEMENTS)
    given = parser.parse_args()
    load = os.getloadavg()[0]
    peak = native.peak_gflops()
    chosen = pairs(tuple(given.laws), tuple(given.elements))
    rows = [measure(unit, kernel, given.repeats, peak) for unit, kernel in chosen]
    machine = output.machine(load, f"one thread, medians of {given.repeats} rounds")
    output.write(given.out, "kernels", table(rows, machine), machine, rows)


if __name__ == "__main__":
    main()
