"""Test data: columns of a CSV file, or arrays, as stretches and stresses in SI.

    mode,stretch,nominal_stress_kPa        uniaxial,strain_percent,cauchy_stress_MPa
    uniaxial,1.10,12.5                     …

Measure and unit stand in the name of a column.
"""

from __future__ import annotations

import csv
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import numpy.typing as npt

from ..errors import InputError
from .modes import Mode, mode_of

Floats = npt.NDArray[np.float64]

_PASCAL = {"Pa": 1.0, "kPa": 1e3, "MPa": 1e6, "GPa": 1e9}
#: Other spellings of them; mPa is none, it is a milli.
_SPELT = {"pa": "Pa", "kpa": "kPa", "KPa": "kPa", "mpa": "MPa", "MPA": "MPa", "gpa": "GPa"}
#: Column → (what of a test it drives, to its value).
_DEFORMATIONS: dict[str, tuple[str, Callable[[float], float]]] = {
    "stretch": ("stretch", lambda x: x),
    "strain": ("stretch", lambda x: 1 + x),
    "strain_percent": ("stretch", lambda x: 1 + x / 100),
    "true_strain": ("stretch", lambda x: float(np.exp(x))),
    "shear": ("shear", lambda x: x),
    "volume_ratio": ("volume ratio", lambda x: x),
    "volume_strain": ("volume ratio", lambda x: 1 + x),
}
#: Column without its unit → kind of stress.
_STRESSES = {
    "stress": "nominal", "nominal_stress": "nominal", "engineering_stress": "nominal",
    "cauchy_stress": "cauchy", "true_stress": "cauchy", "pressure": "pressure",
}  # fmt: skip


@dataclass(frozen=True, eq=False)
class Series:
    """Measurements of one test; row i is one point.

    Attributes:
        mode: the test.
        values: (n,) stretch, amount of shear, or volume ratio.
        stress: (n,) Pa.
        kind: "nominal" (per rest area), "cauchy" (true) or "pressure" (positive in compression).
        weight: (n,) factors on the residuals.
    """

    mode: Mode
    values: Floats
    stress: Floats
    kind: str
    weight: Floats

    @property
    def label(self) -> str:
        words = {"nominal": "nominal stress", "cauchy": "true stress", "pressure": "pressure"}
        return f"{self.mode.title}, {words[self.kind]}"


#: What `supple.fit` takes: a file, files or arrays (values, nominal stress in Pa) by mode.
Data = str | Path | Mapping[str, str | Path | tuple[npt.ArrayLike, npt.ArrayLike]]


def read(data: Data | Sequence[Series]) -> list[Series]:
    """The measurements, one series for each test and kind of stress.

    Raises:
        InputError: a file, row and column that cannot be read; too few or wrong numbers.
    """
    if isinstance(data, str | Path):
        return read_csv(Path(data))
    if isinstance(data, Mapping):
        return [s for name, item in data.items() for s in _of_mode(mode_of(name), item)]
    return list(data)


def _of_mode(mode: Mode, item: str | Path | tuple[npt.ArrayLike, npt.ArrayLike]) -> list[Series]:
    if isinstance(item, str | Path):
        return read_csv(Path(item), mode)
    values, stress = (np.asarray(column, dtype=float) for column in item)
    if values.ndim != 1 or values.shape != stress.shape or not len(values):
        raise InputError(
            f"data of {mode.name} must be two arrays of one length, "
            f"got shapes {values.shape} and {stress.shape}."
        )
    if not (np.isfinite(values).all() and np.isfinite(stress).all()):
        raise InputError(f"data of {mode.name} must be finite numbers.")
    if mode.control != "shear" and values.min() <= 0:
        raise InputError(f"{mode.name}: each {mode.control} must be above 0, got {values.min():g}.")
    kind = "nominal" if mode.measured else "pressure"
    return [Series(mode, values, stress, kind, np.ones_like(values))]


def read_csv(file: Path, mode: Mode | None = None) -> list[Series]:
    """The series of a CSV file with a heading; ``mode`` if it has no column of that name.

    A row takes the deformation and the stress that its test knows; other cells may be empty.
    """
    table = _Table(file, mode)
    rows: dict[tuple[str, str], list[tuple[float, float, float]]] = {}
    for number, cells in table.rows():
        tested = table.mode(number, cells)
        kind, stress = table.stress(number, cells, tested)
        point = (table.value(number, cells, tested), stress, table.weight(number, cells))
        rows.setdefault((tested.name, kind), []).append(point)
    if not rows:
        raise InputError(f"{file}: has no rows of data below its heading.")
    found = []
    for (name, kind), points in rows.items():
        values, stress_values, weight = np.array(points).T
        found.append(Series(mode_of(name), values, stress_values, kind, weight))
    return found


class _Table:
    """A CSV file; every complaint names its row and column."""

    def __init__(self, file: Path, mode: Mode | None) -> None:
        self.file, self.given = file, mode
        try:
            with file.open(encoding="utf-8-sig", newline="") as stream:
                lines = list(csv.reader(stream))
        except (OSError, UnicodeDecodeError, csv.Error) as problem:
            raise InputError(f"{file}: cannot be read as CSV ({problem}).") from None
        numbered = [(i, [c.strip() for c in line]) for i, line in enumerate(lines, 1)]
        self.lines = [(i, c) for i, c in numbered if any(c) and not c[0].startswith("#")]
        if not self.lines:
            raise InputError(f"{file}: is empty; begin with a heading: mode,stretch,stress_Pa.")
        self.head = [_normal(c) for c in self.lines[0][1]]
        self._check_heading()

    def _check_heading(self) -> None:
        stresses = {c: _stress_column(c) for c in self.head}
        known = {"mode", "weight", *_DEFORMATIONS}
        for column in self.head:
            if column not in known and stresses[column] is None:
                names = ", ".join([*sorted(known), "nominal_stress_kPa", "cauchy_stress_Pa",
                                   "pressure_MPa"])  # fmt: skip
                raise InputError(
                    f"{self.file}: unknown column {column!r}; there are {names} (or Pa … GPa)."
                )
        if len(set(self.head)) < len(self.head):
            raise InputError(f"{self.file}: a column stands twice in the heading.")
        if "mode" not in self.head and self.given is None:
            raise InputError(
                f"{self.file}: has no column 'mode'; add it, or name the test with its file, "
                "such as --uniaxial FILE."
            )
        if not any(stresses.values()):
            raise InputError(f"{self.file}: has no column of stress, such as nominal_stress_kPa.")

    def fail(self, number: int, column: str, what: str) -> InputError:
        return InputError(f"{self.file}: row {number}, column {column}: {what}")

    def rows(self) -> list[tuple[int, dict[str, str]]]:
        """Line number in the file, and column → text."""
        found = []
        for number, cells in self.lines[1:]:
            if len(cells) > len(self.head):
                raise InputError(
                    f"{self.file}: row {number}: has {len(cells)} cells, "
                    f"but the heading has {len(self.head)}."
                )
            filled = cells + [""] * (len(self.head) - len(cells))
            found.append((number, dict(zip(self.head, filled, strict=True))))
        return found

    def number(self, number: int, column: str, text: str) -> float:
        try:
            value = float(text)
        except ValueError:
            raise self.fail(number, column, f"expected a number, got {text!r}.") from None
        if not np.isfinite(value):
            raise self.fail(number, column, f"must be finite, got {text}.")
        return value

    def mode(self, number: int, cells: dict[str, str]) -> Mode:
        text = cells.get("mode", "")
        if not text and self.given:
            return self.given
        try:
            return mode_of(text.lower().replace(" ", "_").replace("-", "_"))
        except InputError as problem:
            raise self.fail(number, "mode", str(problem)) from None

    def value(self, number: int, cells: dict[str, str], mode: Mode) -> float:
        for column, (control, convert) in _DEFORMATIONS.items():
            volume = mode.control == "volume ratio" and control == "stretch"
            if cells.get(column) and (control == mode.control or volume):
                value = convert(self.number(number, column, cells[column]))
                if mode.control != "shear" and value <= 0:
                    raise self.fail(number, column, f"means a {control} of {value:g}, not above 0.")
                return value**3 if volume else value
        columns = " or ".join(c for c, (x, _) in _DEFORMATIONS.items() if x == mode.control)
        raise self.fail(number, columns, f"is missing; a {mode.title} test needs one of them.")

    def stress(self, number: int, cells: dict[str, str], mode: Mode) -> tuple[str, float]:
        for column, text in cells.items():
            described = _stress_column(column)
            if described is None or not text:
                continue
            kind, factor = described
            if (kind == "pressure") != (mode.measured is None):
                continue
            return kind, factor * self.number(number, column, text)
        wanted = "pressure_Pa" if mode.measured is None else "nominal_stress_Pa"
        raise self.fail(number, wanted, f"is missing; a {mode.title} test needs a stress.")

    def weight(self, number: int, cells: dict[str, str]) -> float:
        text = cells.get("weight", "")
        value = self.number(number, "weight", text) if text else 1.0
        if value < 0:
            raise self.fail(number, "weight", f"must be at least 0, got {text}.")
        return value


def _normal(heading: str) -> str:
    """A heading as in our lists: ``Nominal stress [kPa]`` is ``nominal_stress_kPa``."""
    words = re.sub(r"[\s\[\]()/_-]+", "_", heading.replace("%", "percent")).strip("_")
    stem, _, unit = words.rpartition("_")
    unit = _SPELT.get(unit, unit)
    return f"{stem.lower()}_{unit}" if unit in _PASCAL else words.lower()


def _stress_column(column: str) -> tuple[str, float] | None:
    """(kind, Pa of one) of a column of stress; a unit is demanded."""
    stem, _, unit = column.rpartition("_")
    if stem in _STRESSES and unit in _PASCAL:
        return _STRESSES[stem], _PASCAL[unit]
    return None
