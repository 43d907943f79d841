"""Where the library of a unit is: compiled ahead by CMake, in the user's cache, or compiled now.

    ahead of time, by this generator?  → its path
    in the cache?   → hash checked → its path
    else            → generate → compile aside → rename into the cache

A hit imports neither UFL nor FFCx. Two processes that compile the same unit do so side by side and
the second finds the first's result in place; one that is killed leaves a folder that nobody reads.
"""

from __future__ import annotations

import contextlib
import hashlib
import os
import platform
import shutil
import stat
import subprocess
import tempfile
import time
from functools import cache
from importlib.metadata import version
from pathlib import Path

from . import fingerprint, reader
from .unit import Unit

OPTIMISATION = (
    "-O2", "-fno-math-errno", "-fno-trapping-math", "-fno-signed-zeros", "-ffp-contract=fast",
)  # fmt: skip
#: Kernels are long straight lines: these passes find next to nothing there and take half of GCC's
#: time. Measured without them: the same speed or up to 8 % more.
GCC_ONLY = (
    "-fno-tree-pre", "-fno-gcse", "-fira-region=one", "-fira-algorithm=priority",
    "--param=lra-max-considered-reload-pseudos=0",
)  # fmt: skip
FLAGS = (
    "-std=c17", "-march=native", *OPTIMISATION, *GCC_ONLY, "-fPIC", "-shared",
    "-fvisibility=hidden",
)  # fmt: skip
#: Seconds after which an unfinished compilation's folder counts as abandoned.
_ABANDONED = 3600.0


class BuildError(Exception):
    """A kernel could not be compiled, or the cache cannot be trusted: one sentence."""


def library(unit: Unit, ahead: Path, folder: Path | None = None) -> Path:
    """Path of the unit's shared library, compiled now if need be.

    Args:
        unit: what is wanted.
        ahead: folder of the libraries and of kernel.h that CMake installed.
        folder: the cache; None for the user's own.

    Raises:
        EnergyFileError: the energy file is wrong.
        BuildError: no compiler, a failed compilation, or a cache that others can write to.
    """
    law_hash = reader.read(unit.law).source_hash if unit.law else ""
    built = ahead / f"{unit.name}.so"
    if not unit.plain and built.exists() and fingerprint.mark(law_hash).encode() in built.read_bytes():
        return built
    contract = (ahead / "kernel.h").read_text(encoding="utf-8")
    cached = _trusted(folder or user_folder()) / f"{unit.name}-{_key(unit, law_hash, contract)}"
    if not _is_whole(cached):
        _compile(unit, contract, cached)
    return cached / "kernels.so"


def user_folder() -> Path:
    """The user's cache folder for kernels."""
    home = os.environ.get("XDG_CACHE_HOME")
    return (Path(home) if home else Path.home() / ".cache") / "supple" / "kernels"


def _key(unit: Unit, law_hash: str, contract: str) -> str:
    parts = [unit.name, "plain" if unit.plain else "lanes", law_hash, contract]
    parts += [_generator(), _processor(), _compiler_state(), *FLAGS]
    return hashlib.sha256("\0".join(parts).encode()).hexdigest()[:32]


@cache
def _generator() -> str:
    """The generator's own sources and the versions of what it stands on."""
    digest = hashlib.sha256()
    for file in sorted([*Path(__file__).parent.rglob("*.py"), *fingerprint.headers()]):
        digest.update(file.read_bytes())
    versions = [version(f"fenics-{name}") for name in ("ffcx", "ufl", "basix")]
    return digest.hexdigest() + " ".join(versions)


@cache
def _processor() -> str:
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").split("\n\n")[0].splitlines()
    except OSError:
        return platform.processor() + platform.machine()
    return "".join(line for line in lines if line.startswith(("model name", "flags", "Features")))


@cache
def _compiler() -> str:
    for name in ("cc", "gcc", "clang"):
        path = shutil.which(name)
        if path:
            return os.path.realpath(path)
    raise BuildError("no C compiler was found to compile this energy; install gcc or clang.")


def _compiler_state() -> str:
    state = os.stat(_compiler())
    return f"{_compiler()} {state.st_size} {state.st_mtime_ns}"


def _trusted(folder: Path) -> Path:
    """The folder, made if need be; refused where someone else could have put a library into it."""
    folder.mkdir(mode=0o700, parents=True, exist_ok=True)
    state = folder.stat()
    if state.st_uid != os.getuid() or state.st_mode & (stat.S_IWGRP | stat.S_IWOTH):
        raise BuildError(
            f"the kernel cache {folder} can be written by others than you; "
            f"run: chmod 700 {folder}, or remove it."
        )
    return folder


def _is_whole(cached: Path) -> bool:
    """Whether a cached library is there with the hash that was noted when it was compiled."""
    try:
        noted = (cached / "sha256").read_text(encoding="ascii")
        return noted == hashlib.sha256((cached / "kernels.so").read_bytes()).hexdigest()
    except OSError:
        return False


def _compile(unit: Unit, contract: str, cached: Path) -> None:
    from .generate import source  # UFL and FFCx: only here

    compiler = _compiler()
    _sweep(cached.parent)
    aside = Path(tempfile.mkdtemp(prefix=".compiling-", dir=cached.parent))
    try:
        text = source(unit, contract)
        (aside / "kernels.c").write_text(text, encoding="utf-8")
        command = [compiler, *FLAGS, "kernels.c", "-o", "kernels.so", "-lm"]
        done = subprocess.run(command, cwd=aside, capture_output=True, text=True, check=False)
        if done.returncode != 0:
            raise BuildError(
                f"{compiler} could not compile {unit.name}: {done.stderr.strip()[:500]}"
            )
        digest = hashlib.sha256((aside / "kernels.so").read_bytes()).hexdigest()
        (aside / "sha256").write_text(digest, encoding="ascii")
        (aside / "kernels.c").unlink()
        if cached.exists() and not _is_whole(cached):
            shutil.rmtree(cached)
        aside.rename(cached)
    except OSError:
        if not _is_whole(cached):  # someone else's result is as good as ours
            raise
    finally:
        shutil.rmtree(aside, ignore_errors=True)


def _sweep(folder: Path) -> None:
    """Remove what killed processes left behind."""
    for left in folder.glob(".compiling-*"):
        with contextlib.suppress(FileNotFoundError):  # its own process has just finished it
            if time.time() - left.stat().st_mtime > _ABANDONED:
                shutil.rmtree(left, ignore_errors=True)
