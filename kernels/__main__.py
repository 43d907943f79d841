"""What CMake calls.

python -m kernels UNIT... --materials DIR --contract kernel.h --out DIR   one C source a unit
python -m kernels --list demo|all --materials DIR                         which units, as CMake code
"""

from __future__ import annotations

import argparse
import gc
import sys
from pathlib import Path

from . import ahead
from .reader import EnergyFileError
from .unit import parse


def main() -> None:
    """Write the C sources of some units, or the list of units to standard output."""
    options = argparse.ArgumentParser(
        prog="kernels", description=__doc__, formatter_class=argparse.RawTextHelpFormatter
    )
    options.add_argument("units", nargs="*")
    options.add_argument("--list", choices=ahead.CHOICES)
    options.add_argument("--materials", type=Path, required=True)
    options.add_argument("--contract", type=Path)
    options.add_argument("--out", type=Path)
    given = options.parse_args()
    if not given.list and not (given.units and given.contract and given.out):
        options.error("give --list, or units with --contract and --out")
    try:
        if given.list:
            sys.stdout.write(ahead.as_cmake(given.list, given.materials))
        else:
            _write(given)
    except (EnergyFileError, ValueError) as problem:
        sys.exit(str(problem))


def _write(given: argparse.Namespace) -> None:
    """One file a unit."""
    from .generate import source  # UFL and FFCx: only here

    gc.disable()  # a tenth of the time, and the process ends soon
    contract = given.contract.read_text(encoding="utf-8")
    given.out.mkdir(parents=True, exist_ok=True)
    for name in given.units:
        text = source(parse(name, given.materials), contract)
        aside = given.out / f"{name}.tmp"
        aside.write_text(text, encoding="utf-8")
        aside.replace(given.out / f"{name}.c")


main()
