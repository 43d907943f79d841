"""MKL's Pardiso for those who have it (`pip install "supple[mkl]"`), looked up when asked for."""

from __future__ import annotations

import sys
import sysconfig
from pathlib import Path

from .core import core
from .errors import InputError


def load() -> None:
    """Make Pardiso available to the runtime, from where pip installs MKL.

    Raises:
        InputError: MKL is not installed, or what was found is not MKL.
    """
    if core().pardiso_loaded():
        return
    library = find()
    if library is None:
        raise InputError(
            f'solver="pardiso" needs MKL, and no libmkl_rt is in {_folders()[0]}; '
            'pip install "supple[mkl]", or choose solver="auto".'
        )
    try:
        core().load_pardiso(str(library))
    except RuntimeError as problem:
        raise InputError(f'solver="pardiso" cannot be used: {problem}.') from None


def find() -> Path | None:
    """MKL's single library, the newest if there are several."""
    for folder in _folders():
        found = sorted(folder.glob("libmkl_rt.so*"), key=lambda path: (len(path.name), path.name))
        if found:
            return found[-1]
    return None


def _folders() -> list[Path]:
    """Where pip puts a package's libraries: for this environment, and with --user."""
    prefixes = [sys.prefix, sysconfig.get_config_var("userbase") or sys.prefix]
    return [Path(prefix) / "lib" for prefix in prefixes]
