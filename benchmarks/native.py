"""native.c, compiled and loaded: calls of kernels, and what the machine can at most."""

from __future__ import annotations

import ctypes
import platform
import subprocess
import tempfile
from functools import cache
from pathlib import Path

from supple import laws

HERE = Path(__file__).parent
#: -mno-red-zone: `trace` pushes onto the stack behind the compiler's back.
FLAGS = ("-std=c17", "-O3", "-march=native", "-ffp-contract=fast", "-fopenmp", "-fPIC", "-shared")
_ONLY_X86 = ("-mno-red-zone",)
_TYPES = {
    "open_library": (ctypes.c_void_p, (ctypes.c_char_p,)),
    "lanes": (ctypes.c_int, (ctypes.c_void_p,)),
    "find": (ctypes.c_void_p, (ctypes.c_void_p, ctypes.c_char_p)),
    "field_count": (ctypes.c_int, (ctypes.c_void_p,)),
    "field_name": (ctypes.c_char_p, (ctypes.c_void_p, ctypes.c_void_p, ctypes.c_int)),
    "time_calls": (ctypes.c_double, (*[ctypes.c_void_p] * 4, ctypes.c_long, ctypes.c_long)),
    "trace": (ctypes.c_long, (*[ctypes.c_void_p] * 5, ctypes.c_long)),
    "peak": (ctypes.c_double, (ctypes.c_long,)),
    "triad": (ctypes.c_double, (ctypes.c_long, ctypes.c_int)),
}


@cache
def load() -> ctypes.CDLL:
    """The functions of native.c."""
    contract = laws._ahead()
    with tempfile.TemporaryDirectory() as folder:
        target = Path(folder) / "native.so"
        red = _ONLY_X86 if platform.machine() == "x86_64" else ()
        command = ["cc", *FLAGS, *red, f"-I{contract}", str(HERE / "native.c"), "-o", str(target)]
        subprocess.run([*command, "-ldl", "-lm"], check=True)
        native = ctypes.CDLL(str(target))
    for name, (result, arguments) in _TYPES.items():
        function = getattr(native, name)
        function.restype, function.argtypes = result, arguments
    return native


def peak_gflops() -> float:
    """Best of a few: fused multiply-adds of one core, GFLOP/s."""
    return max(load().peak(2_000_000) for _ in range(3)) / 1e9


def triad_gbs(size: int = 20_000_000) -> float:
    """a = b + s c far out of the caches, all threads, GB/s."""
    return float(load().triad(size, 4)) / 1e9
