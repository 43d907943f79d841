"""What CMake calls.

python -m kernels UNIT --materials DIR --contract kernel.h --out FILE.c   the C source of one unit
python -m kernels --list demo|all --materials DIR                         which units, as CMake code
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

from . import ahead
from .reader import EnergyFileError
from .unit import parse


def main() -> None:
    """Write one unit's C source, or the list of units to standard output."""
    options = argparse.ArgumentParser(
        prog="kernels", description=__doc__, formatter_class=argparse.RawTextHelpFormatter
    )
    options.add_argument("unit", nargs="?")
    options.add_argument("--list", choices=ahead.CHOICES)
    options.add_argument("--materials", type=Path, required=True)
    options.add_argument("--contract", type=Path)
    options.add_argument("--out", type=Path)
    given = options.parse_args()
    if not given.list and not (given.unit and given.contract and given.out):
        options.error("give --list, or UNIT with --contract and --out")
    try:
        if given.list:
            sys.stdout.write(ahead.as_cmake(given.list, given.materials))
        else:
            _write(given)
    except (EnergyFileError, ValueError) as problem:
        sys.exit(str(problem))


def _write(given: argparse.Namespace) -> None:
    from .generate import source  # UFL and FFCx: only here

    contract = given.contract.read_text(encoding="utf-8")
    text = source(parse(given.unit, given.materials), contract)
    if given.out.exists() and given.out.read_text(encoding="utf-8") == text:
        return  # ninja then compiles nothing
    given.out.parent.mkdir(parents=True, exist_ok=True)
    aside = given.out.with_suffix(".tmp")
    aside.write_text(text, encoding="utf-8")
    aside.replace(given.out)


main()
