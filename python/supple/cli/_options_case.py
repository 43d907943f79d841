"""Options that describe a body in a mesh file, as the case that they stand for.

Its errors name the option and not the key of a TOML file that the user has not written.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from ..case import Table
from ..errors import InputError
from ._values import values

#: Option of each key of a table; parameters of a law are --set.
_OPTIONS = {
    "mesh": {"file": "MESH", "unit": "--unit", "element": "--element"},
    "material": {"law": "--law", "density": "--density", "formulation": "--formulation",
                 "quadrature": "--quadrature"},
    "fix": {},
    "gravity": {"acceleration": "--gravity"},
    "solve": {"load_steps": "--load-steps", "rtol": "--rtol", "max_iterations": "--max-iterations"},
}  # fmt: skip
_REST = {"material": "--set", "fix": "--fix"}
#: How the library and a case say things, and how options do.
_WORDS = (
    (r"\b(unit|element)=' ?(\w+)'", r"--\1 \2"),
    (r"\b(unit|element)=(?!\w)", r"--\1"),
    (r"\bleave unit out", "leave --unit out"),
    (r'"min", "max", a number or \[low, high\]', "min, max, a number or low:high"),
    (r'a tag, a list of ids or a place such as { z = "min" }', "a tag or a place such as z=min"),
    (r"unknown key", "unknown parameter"),
)


class OptionsCase(Table):
    """A case whose values came as options; the key of a message is the option's name."""

    def at(self, key: str = "") -> str:
        """Where a message points: an option, or the file where it is about none."""
        table = self.name.split()[0] if self.name else ""
        name = key.split(".")[0]
        if table in ("", "mesh") and not key:
            return str(self.file)
        option = _OPTIONS.get(table, {}).get(name) or (key and _REST.get(table, ""))
        if not option:
            return str(self.file)
        return f"{option} {key}" if option == "--set" else option

    def done(self) -> None:
        with _reworded():
            super().done()

    def wrong(self, key: str, expected: str, got: object) -> InputError:
        return InputError(_words(str(super().wrong(key, expected, got))))

    @contextmanager
    def named(self, key: str = "") -> Iterator[None]:
        """Errors of the library raised inside point at this option, in the command's words."""
        with _reworded(), super().named(key):
            yield


def case_of(mesh: Path, given: dict[str, Any]) -> OptionsCase:
    """The case that the options describe.

    Args:
        given: `MESH_OPTIONS` by name, None or () where not given.

    Raises:
        InputError: --set or --fix of another form than their help says.
    """
    material = {"law": _law(given["law"] or "neo_hookean"), "density": 1000.0}
    material |= _present(given, "density", "formulation", "quadrature")
    tables: dict[str, Any] = {
        "mesh": {"file": mesh.name} | _present(given, "unit", "element"),
        "material": material | values("--set", given["values"]),
        "fix": [{"where": place(text)} for text in given["fixed"]],
        "gravity": {"acceleration": list(given["gravity"] or (0.0, 0.0, -9.81))},
        "solve": _present(given, "load_steps", "rtol", "max_iterations"),
    }
    return OptionsCase(tables, mesh)


def place(text: str) -> Any:
    """What --fix says: a tag, or {axis: "min", "max", coordinate or [low, high]} of axis=….

    "z=max", "z=0.1", "x=0:0.1" and several of those with commas between.
    """
    if "=" not in text:
        return text
    found: dict[str, Any] = {}
    for part in text.split(","):
        axis, _, value = part.partition("=")
        ends = [_number(end) for end in value.split(":")]
        found[axis.strip()] = ends[0] if len(ends) == 1 else ends
    return found


def _present(given: dict[str, Any], *names: str) -> dict[str, Any]:
    return {name: given[name] for name in names if given[name] is not None}


def _law(name: str) -> str:
    return str(Path(name).absolute()) if name.endswith(".py") else name


def _number(text: str) -> float | str:
    try:
        return float(text)
    except ValueError:
        return text.strip()


@contextmanager
def _reworded() -> Iterator[None]:
    try:
        yield
    except InputError as error:
        raise type(error)(_words(str(error))) from error


def _words(message: str) -> str:
    for library, command in _WORDS:
        message = re.sub(library, command, message)
    return message
