"""What Supple raises. Each message says argument, expected, got and remedy in one sentence."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    import numpy as np
    import numpy.typing as npt


class SuppleError(Exception):
    """Base of everything that Supple raises on purpose."""


class InputError(SuppleError):
    """An argument, a file or a case that cannot be used as given (command line: exit 2)."""


class MaterialError(InputError):
    """An energy file or one of its parameters is wrong."""


class MeshError(InputError):
    """A mesh or a surface is wrong: inverted or duplicate cells, NaN, no such element or tag."""


class ConvergenceError(SuppleError):
    """A solver stopped without a solution, or with one not to be trusted (command line: exit 3).

    Attributes:
        history: one dict a Newton iteration: step, load factor, residual and step norms.
        cells: ids of the worst cells, worst first (may be empty).
        load_factor: largest fraction of the load that was in equilibrium, 0 to 1.
        cause: likely cause, one phrase.
        points: (n, 3) m, where the nodes are in the last equilibrium found, that at `load_factor`;
            None where there is none to show.
    """

    def __init__(
        self,
        message: str,
        history: Sequence[dict[str, Any]] = (),
        cells: Sequence[int] = (),
        load_factor: float = 0.0,
        cause: str = "",
        points: npt.NDArray[np.float64] | None = None,
    ) -> None:
        super().__init__(message)
        self.history = list(history)
        self.cells = list(cells)
        self.load_factor = load_factor
        self.cause = cause
        self.points = points
