"""Runs the runtime's Newton solver for a body; failures.py says in words why it stopped."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from .core import core
from .errors import InputError

if TYPE_CHECKING:
    from .mesh import Mesh

Floats = npt.NDArray[np.float64]
Progress = Callable[[dict[str, float]], None]

_FIELDS = ("load_factor", "iteration", "residual", "tolerance", "step", "length", "shift")


@dataclass(frozen=True)
class Settings:
    """How a body is solved; see `Body.solve`."""

    load_steps: int | None = None
    rtol: float = 1e-10
    atol: float | None = None
    max_iterations: int = 25
    progress: Progress | None = None

    def checked(self, rounding: float, mesh: Mesh) -> Any:
        """The runtime's settings; ``rounding`` is that of the internal forces, N.

        Raises:
            InputError: a tolerance or a count that makes no sense.
        """
        if not 0 < self.rtol < 1:
            raise InputError(f"rtol must lie between 0 and 1, got {self.rtol}.")
        if self.max_iterations < 1:
            raise InputError(f"max_iterations must be at least 1, got {self.max_iterations}.")
        if self.load_steps is not None and self.load_steps < 1:
            raise InputError(f"load_steps must be at least 1 or None, got {self.load_steps}.")
        native = core().NewtonSettings()
        native.rtol, native.max_iterations = self.rtol, self.max_iterations
        native.load_steps = self.load_steps or 0
        native.size = mesh.size
        native.atol = rounding if self.atol is None else self.atol
        return native


def solve(
    system: Any,
    start: Floats,
    prescribed: Floats,
    native: Any,
    settings: Settings,
    judge: Callable[[Floats, float], Any] | None = None,
) -> Any:
    """Run from ``start`` (dofs); the result's unknowns are ``result.u``, displacements first.

    Args:
        judge: says of the unknowns under a load factor what is wrong with them, as an Outcome.
    """
    if not np.isfinite(system.residual(start, 1.0)).all():
        raise InputError(
            "the forces are not finite at the start: a parameter is outside of what its law can "
            "carry (a skin of this law wants poisson below 0.5), or the start is inverted."
        )
    report = settings.progress
    hook = None if report is None else lambda i: report(as_dict(i))
    return system.solve(start, np.nan_to_num(prescribed), native, hook, judge)


def as_dict(iteration: Any) -> dict[str, float]:
    """One iteration of the history."""
    return {name: getattr(iteration, name) for name in _FIELDS}
