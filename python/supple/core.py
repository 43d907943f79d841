"""The compiled runtime, loaded once with a BLAS that knows the processor.

Debian 12's OpenBLAS takes its slowest kernels on processors that it does not know, five times
slower, unless the variable below is set before it is loaded; it is set for that moment only.
"""

from __future__ import annotations

import os
from functools import cache
from pathlib import Path
from types import ModuleType

from .errors import SuppleError

_VARIABLE = "OPENBLAS_CORETYPE"


@cache
def core() -> ModuleType:
    """``supple._core``.

    Raises:
        SuppleError: it was not built.
    """
    chosen = None if _VARIABLE in os.environ else _core_type()
    if chosen:
        os.environ[_VARIABLE] = chosen
    try:
        from supple import _core
    except ImportError as problem:
        raise SuppleError(f"the compiled part of Supple is missing ({problem}); run: make build.")
    finally:
        if chosen:
            del os.environ[_VARIABLE]
    _core.set_blas_threads(1)
    return _core


def _core_type() -> str | None:
    """OpenBLAS' name of the kernels for this processor, by its vector units."""
    try:
        flags = Path("/proc/cpuinfo").read_text(encoding="utf-8").split("flags", 1)[1].split("\n")[0]
    except (OSError, IndexError):
        return None
    words = set(flags.split())
    if {"avx512f", "avx512dq", "avx512bw", "avx512vl"} <= words:
        return "SkylakeX"
    return "Haswell" if {"avx2", "fma"} <= words else None
