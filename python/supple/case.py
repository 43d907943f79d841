"""A case file (TOML), read strictly: every value typed, every error names file, table and key.

A reader asks a `Table` for each key that it knows and then calls `done`, which refuses whatever is
left over and offers the nearest key that was asked for.
"""

from __future__ import annotations

import difflib
import math
import sys
import tomllib
from collections.abc import Collection, Iterable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from .errors import InputError


def read_case(path: str | Path) -> Table:
    """The top table of a case file; paths in it are relative to its folder.

    Raises:
        InputError: the file is missing, is no text in UTF-8 or is no TOML.
    """
    file = Path(path)
    if not file.is_file():
        raise InputError(f"case {file} is not a file; give the path of a TOML file.")
    try:
        return Table(tomllib.loads(file.read_text(encoding="utf-8")), file)
    except UnicodeDecodeError as error:
        raise InputError(f"case {file} is not text in UTF-8; give a TOML file.") from error
    except tomllib.TOMLDecodeError as error:
        raise InputError(f"case {file} is not valid TOML: {error}.") from error


def nearest(name: str, known: Iterable[str]) -> str:
    """The remedy for an unknown name, to end a message with: the nearest known ones, or all."""
    names = sorted(known)
    close = difflib.get_close_matches(name, names, n=2, cutoff=0.6)
    if close:
        return "did you mean " + " or ".join(f'"{word}"' for word in close) + "?"
    return "known are " + ", ".join(names) + "." if names else "none is known here."


class Table:
    """One table of a case file. Every getter raises InputError where the value is not as asked."""

    def __init__(self, values: Mapping[str, Any], file: Path, name: str = "") -> None:
        self.file = file
        self.name = name
        self._values = values
        self._asked: set[str] = set()

    def __contains__(self, key: str) -> bool:
        self._asked.add(key)
        return key in self._values

    def number(
        self,
        key: str,
        default: float | None = None,
        *,
        above: float = -math.inf,
        below: float = math.inf,
    ) -> float:
        """A finite number, above < number < below; without a default the key is required."""
        value = self._get(key, default)
        if _is_number(value) and above < value < below:
            return float(value)
        raise self.wrong(key, f"a number{_range(above, below)}", value)

    def integer(self, key: str, default: int | None = None, *, minimum: int = 0) -> int:
        """A whole number of at least `minimum`."""
        value = self._get(key, default)
        if isinstance(value, int) and not isinstance(value, bool) and value >= minimum:
            return value
        raise self.wrong(key, f"a whole number of at least {minimum}", value)

    def flag(self, key: str, default: bool | None = None) -> bool:
        """True or false."""
        value = self._get(key, default)
        if isinstance(value, bool):
            return value
        raise self.wrong(key, "true or false", value)

    def text(
        self, key: str, default: str | None = None, *, choices: Collection[str] | None = None
    ) -> str:
        """A text, one of `choices` where those are given."""
        value = self._get(key, default)
        if not isinstance(value, str) or not value:
            raise self.wrong(key, "a text in quotes", value)
        if choices is not None and value not in choices:
            raise self.wrong(key, "one of " + ", ".join(f'"{c}"' for c in choices), value)
        return value

    def vector(
        self, key: str, default: tuple[float, ...] | None = None, *, size: int = 3
    ) -> tuple[float, ...]:
        """`size` finite numbers."""
        value = self._get(key, default)
        if isinstance(value, list | tuple) and len(value) == size and all(map(_is_number, value)):
            return tuple(float(item) for item in value)
        raise self.wrong(key, f"a list of {size} numbers", value)

    def path(self, key: str) -> Path:
        """An existing file or folder, relative to the case file."""
        given = self.text(key)
        path = self.file.parent / given
        if not path.exists():
            raise InputError(f"{self.at(key)}: {path} does not exist; give an existing path.")
        return path

    def value(self, key: str) -> Any:
        """A required value of any type, for the caller to check."""
        return self._get(key, None)

    def table(self, key: str) -> Table | None:
        """The table [key], None if it is absent."""
        return self.required(key) if key in self else None

    def required(self, key: str) -> Table:
        """The table [key], which must be there."""
        value = self._get(key, None)
        if isinstance(value, Mapping):
            return type(self)(value, self.file, self._below(key))
        raise self.wrong(key, f"a table, written [{self._below(key)}]", value)

    def tables(self, key: str) -> list[Table]:
        """The tables [[key]], none if it is absent; they are counted from 1 in messages."""
        value = self._take(key)
        if value is None:
            return []
        if not isinstance(value, list) or not all(isinstance(item, Mapping) for item in value):
            raise self.wrong(key, f"a list of tables, each written [[{self._below(key)}]]", value)
        names = (f"{self._below(key)} {number}" for number in range(1, len(value) + 1))
        return [type(self)(item, self.file, name) for item, name in zip(value, names, strict=True)]

    def numbers(self, sizes: Mapping[str, int]) -> dict[str, Any]:
        """The keys of `sizes` that are there, as one or several finite numbers; no other key."""
        self._asked.update(sizes)
        self.done()
        return {
            key: self.number(key) if size == 1 else self.vector(key, size=size)
            for key, size in sizes.items()
            if key in self._values
        }

    def done(self) -> None:
        """Refuse every key that nobody asked for."""
        for key in self._values:
            if key not in self._asked:
                raise InputError(f"{self.at(key)}: unknown key; {nearest(key, self._asked)}")

    def at(self, key: str = "") -> str:
        """Where a message points: file, table and key."""
        return f"{self.file}: " + " ".join(filter(None, [self.name and f"[{self.name}]", key]))

    def wrong(self, key: str, expected: str, got: object) -> InputError:
        """The error for a value that is not as expected."""
        return InputError(f"{self.at(key)} must be {expected}, got {got!r}; correct it.")

    @contextmanager
    def named(self, key: str = "") -> Iterator[None]:
        """Errors of the library raised inside point at this table and key."""
        try:
            yield
        except InputError as error:
            raise type(error)(f"{self.at(key)}: {error}") from error

    def _below(self, key: str) -> str:
        return f"{self.name}.{key}" if self.name else key

    def _take(self, key: str) -> Any:
        self._asked.add(key)
        return self._values.get(key)

    def _get(self, key: str, default: object) -> Any:
        value = self._take(key)
        if value is not None:
            return value
        if default is None:
            raise self._missing(key)
        return default

    def _missing(self, key: str) -> InputError:
        unknown = [name for name in self._values if name not in self._asked]
        misspelt = difflib.get_close_matches(key, unknown, n=1)
        hint = f', there is "{misspelt[0]}": is that it?' if misspelt else "; add it."
        return InputError(f"{self.at(key)} is missing{hint}")


def _is_number(value: object) -> bool:
    if isinstance(value, bool) or not isinstance(value, int | float):
        return False
    return abs(value) <= sys.float_info.max  # so neither NaN nor a whole number beyond floats


def _range(above: float, below: float) -> str:
    low = "" if above == -math.inf else f" above {above:g}"
    high = "" if below == math.inf else f" below {below:g}"
    return " and".join(filter(None, [low, high]))
