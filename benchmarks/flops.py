"""Floating-point operations of one call of a kernel, counted from the instructions that it runs.

    single steps → addresses → objdump of the files they lie in → operations of each instruction

An addition, multiplication, division, root, minimum or maximum counts one a lane, a fused
multiply-add two. Conversions, comparisons, shuffles and moves count nothing.
"""

from __future__ import annotations

import re
import subprocess
from collections import Counter
from pathlib import Path

import numpy as np
import numpy.typing as npt

_ONE = re.compile(r"^v?(add|sub|mul|div|sqrt|min|max)(p|s)d$")
_TWO = re.compile(r"^vfn?m(add|sub|addsub|subadd)\d{3}(p|s)d$")
_LINE = re.compile(r"^\s*([0-9a-f]+):\s+(\S+)\s*(.*)$")
_WIDTH = {"z": 8, "y": 4, "x": 2}


def count(addresses: npt.NDArray[np.uint64]) -> int:
    """Operations of all instructions at ``addresses``, as often as they are there."""
    times = Counter(addresses.tolist())
    total = 0
    for path, start, end, offset in _executable():
        inside = {a - start + offset: n for a, n in times.items() if start <= a < end}
        if inside:
            table = _operations(path, min(inside), max(inside) + 16)
            total += sum(n * table.get(place, 0) for place, n in inside.items())
    return total


def operations(mnemonic: str, operands: str) -> int:
    """Of one instruction in AT&T's notation."""
    for pattern, each in ((_ONE, 1), (_TWO, 2)):
        match = pattern.match(mnemonic)
        if match:
            registers = re.findall(r"%([xyz])mm", operands)
            scalar = match.group(2) == "s"
            return each * (1 if scalar else max((_WIDTH[r] for r in registers), default=2))
    return 0


def _operations(path: str, first: int, last: int) -> dict[int, int]:
    """By address in a library, where linkers give code equal offsets and addresses."""
    shown = subprocess.run(
        ["objdump", "-d", "--no-show-raw-insn", f"--start-address={first:#x}",
         f"--stop-address={last:#x}", path], check=True, capture_output=True, text=True,
    ).stdout  # fmt: skip
    found = {}
    for line in shown.splitlines():
        match = _LINE.match(line)
        if match:
            found[int(match.group(1), 16)] = operations(match.group(2), match.group(3))
    return found


def _executable() -> list[tuple[str, int, int, int]]:
    """Path, start, end, offset of the executable parts of files that this process maps."""
    parts = []
    for line in Path("/proc/self/maps").read_text(encoding="utf-8").splitlines():
        words = line.split()
        if len(words) == 6 and "x" in words[1] and words[5].startswith("/"):
            start, end = (int(x, 16) for x in words[0].split("-"))
            parts.append((words[5], start, end, int(words[2], 16)))
    return parts
