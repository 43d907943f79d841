"""Strain energies by name or by file, and the compiled kernels behind them."""

from __future__ import annotations

import importlib.util
import time
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING

from .errors import MaterialError
from .profile import phase

if TYPE_CHECKING:
    from .kernels.reader import Law, Parameter
    from .kernels.unit import Unit


@dataclass(frozen=True)
class Material:
    """A strain energy as a user sees it.

    Attributes:
        name: file name without suffix.
        parameters: name, unit, default and bounds of each, in SI.
        reference: formula and source, the first line of its file.
        exceptions: properties that it declares not to have, such as "barrier".
        path: its energy file.
    """

    name: str
    parameters: tuple[Parameter, ...]
    reference: str
    exceptions: frozenset[str]
    path: Path


def material(name_or_path: str | Path) -> Material:
    """The energy of that name, or of that file (anything that ends in .py).

    Raises:
        MaterialError: no such energy (the nearest is named), or a wrong file (line and remedy): not
            readable, not scalar, not objective, not free of energy and stress at rest.
    """
    law = read_law(name_or_path)
    if Path(name_or_path).suffix == ".py":  # those that ship are held to it by tests
        _require_sound(law)
    return _of(law)


def _of(law: Law) -> Material:
    return Material(law.name, law.parameters, law.reference, law.exceptions, law.path)


def _require_sound(law: Law) -> None:
    from .kernels import checks, reader

    try:
        checks.require_sound(law)
    except reader.EnergyFileError as problem:
        raise MaterialError(str(problem)) from None


def materials() -> list[Material]:
    """All shipped energies, by name."""
    names = sorted(path.stem for path in folder().glob("*.py"))
    return [_of(read_law(name)) for name in names if name != "__init__"]


def read_law(name_or_path: str | Path) -> Law:
    """The energy with its functions, as the generator reads it."""
    from .kernels import reader

    path = Path(name_or_path)
    if path.suffix != ".py":
        shipped = {p.stem: p for p in folder().glob("*.py")}
        if str(name_or_path) not in shipped:
            hint = reader.nearest(str(name_or_path), shipped)
            raise MaterialError(f"material: no energy is called {name_or_path}; {hint}")
        path = shipped[str(name_or_path)]
    try:
        return reader.read(path.resolve())
    except reader.EnergyFileError as problem:
        raise MaterialError(str(problem)) from None


def compiled(unit: Unit) -> str:
    """Path of the unit's kernels, compiled at first use.

    Raises:
        MaterialError: a wrong energy file, or a compilation that failed.
    """
    from .kernels import build, reader

    begin = time.time()
    try:
        with phase("kernels found") as part:
            library = build.library(unit, _ahead())
            if library.stat().st_mtime >= begin:
                part.name = "kernels compiled"
        return str(library)
    except (reader.EnergyFileError, build.BuildError) as problem:
        raise MaterialError(str(problem)) from None


@cache
def folder() -> Path:
    """Where the shipped energy files are."""
    found = importlib.util.find_spec("supple.materials")
    places = list(found.submodule_search_locations or ()) if found else []
    if not places:
        raise MaterialError("Supple's energy files are missing; run: make build.")
    return Path(places[0])


@cache
def _ahead() -> Path:
    """Where the kernels are that were compiled when Supple was built."""
    core = importlib.util.find_spec("supple._core")
    if core is None or core.origin is None:
        raise MaterialError("the compiled part of Supple is missing; run: make build.")
    return Path(core.origin).parent / "_kernels"
