"""Processors that kernels are compiled ahead for, and which of those kernels this processor runs.

CMake's SUPPLE_KERNEL_TARGETS names some; the kernels of each have a folder of its name. A wheel to
hand out holds several, and the best that the processor's own flags allow is taken, nothing else
asked: neither the environment nor a file of settings.
"""

from __future__ import annotations

import re
from functools import cache
from pathlib import Path

#: The machine that builds: the one folder of a build that stays there.
NATIVE = "native"

_V2 = frozenset(["sse2", "cx16", "lahf_lm", "popcnt", "pni", "sse4_1", "sse4_2", "ssse3"])
_V3 = _V2 | frozenset(["avx", "avx2", "bmi1", "bmi2", "f16c", "fma", "abm", "movbe", "xsave"])
_V4 = _V3 | frozenset(["avx512f", "avx512bw", "avx512cd", "avx512dq", "avx512vl"])
#: -march of GCC and Clang → flags that Linux shows where such code runs; weakest first.
#: Source: x86-64 psABI 1.0, §3.1.1, table 3.1.
NEEDS: dict[str, frozenset[str]] = {
    "armv8-a": frozenset({"asimd"}),
    "x86-64": frozenset({"sse2"}),
    "x86-64-v2": _V2,
    "x86-64-v3": _V3,
    "x86-64-v4": _V4,
}
KNOWN = (NATIVE, *NEEDS)


def best(ahead: Path, flags: frozenset[str]) -> Path | None:
    """The folder in ``ahead`` whose kernels a processor with these flags runs fastest, if any."""
    runs = [name for name, needs in NEEDS.items() if needs <= flags]
    for name in (NATIVE, *reversed(runs)):
        if (ahead / name).is_dir():
            return ahead / name
    return None


@cache
def flags() -> frozenset[str]:
    """What Linux says that this processor can; empty where there is no Linux to ask."""
    try:
        text = Path("/proc/cpuinfo").read_text(encoding="utf-8")
    except OSError:
        return frozenset()
    found = re.search(r"^(?:flags|Features)\s*:(.*)$", text, re.MULTILINE)
    return frozenset(found[1].split()) if found else frozenset()
