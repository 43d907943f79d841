"""Values of shape functions at the points: uniform numbers, folded where they are known."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]


@dataclass
class Tables:
    """Tables (points, shape functions), by the names that C gives them.

    Attributes:
        weights: of the points (points,).
        values: name → (points or 1, shape functions).
        used: name → table, in the order of their first use in C.
    """

    weights: Array
    values: dict[str, Array]
    used: dict[str, Array] = field(default_factory=dict)

    @property
    def points(self) -> int:
        return len(self.weights)

    def at(self, name: str, place: str) -> str:
        """C of an entry: ``place`` is the number of a shape function or an index of C."""
        table = self.values[name]
        self.used[name] = table
        return f"{name}[{'iq' if len(table) > 1 else '0'}][{place}]"

    def weighted(self, name: str) -> str:
        """Name of a table times the points' weights."""
        own = f"{name}_weighted"
        self.values[own] = self.values[name] * self.weights[:, None]
        return own

    def constant(self, name: str) -> Array | None:
        """Values (shape functions,) of a table that is the same at every point, otherwise None."""
        table = self.values[name]
        return table[0] if len(table) == 1 else None

    def definitions(self) -> str:
        """C of the tables in use."""
        return "\n".join(
            f"static const double {name}[{table.shape[0]}][{table.shape[1]}] = {_braces(table)};"
            for name, table in self.used.items()
        )


def number(value: float) -> str:
    """A double in C, exact."""
    return repr(float(value))


def _braces(table: Array) -> str:
    rows = (", ".join(number(value) for value in row) for row in table)
    return "{" + ", ".join(f"{{{row}}}" for row in rows) + "}"
