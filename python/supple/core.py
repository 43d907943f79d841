"""The compiled runtime, loaded once with settings that its libraries read only at that moment.

Debian 12's OpenBLAS takes its slowest kernels on processors that it does not know, five times
slower, unless it is told; GCC's OpenMP lets waiting threads spin for milliseconds, which on a busy
machine takes the time from the thread that they wait for. A value that the user set stays.
"""

from __future__ import annotations

import os
from functools import cache
from pathlib import Path
from types import ModuleType

from .errors import SuppleError
from .profile import phase


@cache
@phase("imports")
def core() -> ModuleType:
    """``supple._core``.

    Raises:
        SuppleError: it was not built.
    """
    wanted = {"OPENBLAS_CORETYPE": _core_type(), "GOMP_SPINCOUNT": "2000"}
    mine = {name: v for name, v in wanted.items() if v and name not in os.environ}
    os.environ.update(mine)
    try:
        from supple import _core
    except ImportError as problem:
        raise SuppleError(
            f"the compiled part of Supple is missing ({problem}); run: make build."
        ) from None
    finally:
        for name in mine:
            del os.environ[name]
    _core.set_blas_threads(1)
    module: ModuleType = _core
    return module


def _core_type() -> str | None:
    """OpenBLAS' name of the kernels for this processor, by its vector units."""
    try:
        flags = (
            Path("/proc/cpuinfo").read_text(encoding="utf-8").split("flags", 1)[1].split("\n")[0]
        )
    except (OSError, IndexError):
        return None
    words = set(flags.split())
    if {"avx512f", "avx512dq", "avx512bw", "avx512vl"} <= words:
        return "SkylakeX"
    return "Haswell" if {"avx2", "fma"} <= words else None
