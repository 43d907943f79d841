"""The mark that a library carries: by it one knows whether the generator of now would write it."""

from __future__ import annotations

import hashlib
from functools import cache
from pathlib import Path

#: Files of this folder that decide what is built or refused, but no line of C.
WITHOUT_C = ("__main__.py", "ahead.py", "build.py", "checks.py")


def sources() -> list[Path]:
    """The files that generated C depends on."""
    folder = Path(__file__).parent
    without = {folder / name for name in WITHOUT_C}
    return [file for file in sorted(folder.rglob("*.py")) if file not in without] + headers()


def headers() -> list[Path]:
    """C that is copied into the kernels."""
    return sorted(Path(__file__).parent.rglob("*.h"))


def mark(law_hash: str) -> str:
    """Of the C that the generator of now makes of an energy with that hash ("" for a load)."""
    return hashlib.sha256(f"{law_hash} {_generator()}".encode()).hexdigest()


@cache
def _generator() -> str:
    digest = hashlib.sha256()
    for file in sources():
        digest.update(file.read_bytes())
    return digest.hexdigest()
