"""Runs the runtime's Newton solver for a body and says in words why it stopped, if it did."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from .core import core
from .errors import ConvergenceError, InputError, MeshError

if TYPE_CHECKING:
    from .mesh import Mesh
    from .state import Rest
    from .terms import Built, Description

Floats = npt.NDArray[np.float64]
Progress = Callable[[dict[str, float]], None]

_FIELDS = ("load_factor", "iteration", "residual", "tolerance", "step", "length", "shift")

_CAUSES = {
    "unstable": "unstable equilibrium: a small push leaves it (buckling)",
    "inverted": "inverted cell: the load is too large for this material or mesh",
    "singular": "singular stiffness: a part is not held or has no stiffness",
    "limit_point": "load past a limit point: no stable equilibrium beyond it",
    "stalled": "the residual does not fall any more",
}
_CAUSES_INVERSE = {
    "inverted": "no rest shape: a cell collapses on the way to it (too soft for this load)",
    "singular": "no rest shape: the way to it ends at a limit point (too soft for this load)",
    "stalled": "no rest shape was found: the way to it ends before the whole load is off",
}


@dataclass(frozen=True)
class Settings:
    """How a body is solved; see `Body.solve`."""

    load_steps: int | None = None
    rtol: float = 1e-10
    atol: float | None = None
    max_iterations: int = 25
    progress: Progress | None = None
    step_tol: float = 1e-8  # of the size

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
        native.size, native.step_tol = mesh.size, self.step_tol
        native.atol = rounding if self.atol is None else self.atol
        return native


def solve(system: Any, start: Floats, prescribed: Floats, native: Any, settings: Settings) -> Any:
    """Run from ``start`` (dofs); the result's unknowns are ``result.u``, displacements first."""
    if not np.isfinite(system.residual(start, 1.0)).all():
        raise InputError(
            "the forces are not finite at the start: a parameter is outside of what its law can "
            "carry (a skin of this law wants poisson below 0.5), or the start is inverted."
        )
    report = settings.progress
    hook = None if report is None else lambda i: report(as_dict(i))
    return system.solve(start, np.nan_to_num(prescribed), native, hook)


def require_converged(
    result: Any, built: Built, description: Description, inverse: bool = False
) -> None:
    """Raise for a result that is no stable equilibrium under the whole load.

    Raises:
        ConvergenceError: cause, load factor, worst cells, history.
    """
    name = result.outcome.name
    if name == "converged":
        return
    cause = (_CAUSES_INVERSE if inverse else {}).get(name, _CAUSES[name])
    cells = worst_cells(result, built, description)
    last = result.history[-1]
    raise ConvergenceError(
        f"no {'rest shape' if inverse else 'equilibrium'}: {cause}; "
        f"{100 * result.load_factor:.3g} % of the load was reached, the residual is "
        f"{last.residual:.3g} N where {last.tolerance:.3g} N was asked for, "
        f"worst cells {cells[:3]}; try a smaller load, a stiffer material or a finer mesh.",
        history=[as_dict(i) for i in result.history],
        cells=cells,
        load_factor=result.load_factor,
        cause=cause,
    )


def require_usable(rest: Rest) -> None:
    """Refuse a rest shape with cells that are inside out between the quadrature points.

    Raises:
        ConvergenceError: the cells.
    """
    try:
        _ = rest.mesh
    except MeshError:
        cause = _CAUSES_INVERSE["inverted"]
        raise ConvergenceError(
            f"{cause}: the shape found has cells that are inside out at their corners; "
            "try a smaller load, a stiffer material, a skin or a finer mesh.",
            history=rest.history,
            load_factor=1.0,
            cause=cause,
        ) from None


def worst_cells(result: Any, built: Built, description: Description, count: int = 5) -> list[int]:
    """Cells of the mesh: the most compressed one, then those around the largest residual."""
    cells: list[int] = []
    if result.worst.value <= 0:
        terms = [
            r for r, t in zip(description.regions, built.regions, strict=True) if t is not None
        ]
        cells.append(int(terms[result.worst.term].ids[result.worst.cell]))
    if len(result.last_residual):
        n = description.mesh.points.size
        size = np.linalg.norm(result.last_residual[:n].reshape(-1, 3), axis=1)
        around = np.nan_to_num(size, nan=np.inf)[description.mesh.cells].max(axis=1)
        cells += [int(c) for c in np.argsort(-around, kind="stable")[:count] if c not in cells]
    return cells[:count]


def as_dict(iteration: Any) -> dict[str, float]:
    """One iteration of the history."""
    return {name: getattr(iteration, name) for name in _FIELDS}
