"""python -m kernels UNIT --materials DIR --contract kernel.h --out FILE.c: what CMake calls."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

from .generate import source
from .reader import EnergyFileError
from .unit import parse


def main() -> None:
    """Write the C source of one unit."""
    options = argparse.ArgumentParser(prog="kernels", description=__doc__)
    options.add_argument("unit")
    options.add_argument("--materials", type=Path, required=True)
    options.add_argument("--contract", type=Path, required=True)
    options.add_argument("--out", type=Path, required=True)
    given = options.parse_args()
    try:
        text = source(
            parse(given.unit, given.materials), given.contract.read_text(encoding="utf-8")
        )
    except (EnergyFileError, ValueError) as problem:
        sys.exit(str(problem))
    given.out.parent.mkdir(parents=True, exist_ok=True)
    aside = given.out.with_suffix(".tmp")
    aside.write_text(text, encoding="utf-8")
    aside.replace(given.out)


main()
