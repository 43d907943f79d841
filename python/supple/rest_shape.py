"""The rest shape of a loaded body: what was asked for, found by its method, and looked at."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from . import assembly, directions, failures, fixed_point, newton, overlap, terms
from .choices import FIXED_POINTS, METHODS, SOLVERS, STATES
from .core import core
from .errors import InputError
from .mesh_jacobian import smallest_jacobian
from .state import Rest, outcome

if TYPE_CHECKING:
    from .body import Body

Floats = npt.NDArray[np.float64]


@dataclass(frozen=True)
class Request:
    """What was asked for; `Body.rest_shape` says what the names mean.

    Raises:
        InputError: a choice that there is not, or an option that the method does not take.
    """

    method: str
    density_of: str
    directions_of: str
    solver: str
    check_overlap: bool
    settings: newton.Settings
    options: dict[str, Any] = field(default_factory=dict)  # of a fixed point

    def __post_init__(self) -> None:
        _require_one("method", self.method, METHODS)
        _require_one("density_of", self.density_of, STATES)
        _require_one("directions_of", self.directions_of, STATES)
        _require_one("solver", self.solver, SOLVERS)
        _ = self.fixed_point

    @cached_property
    def fixed_point(self) -> fixed_point.FixedPoint:
        """How a fixed point runs, where ``method`` is one."""
        return fixed_point.options(self.options, self.method)


def find(body: Body, asked: Request, start: Rest | None) -> Rest:
    """The rest shape of ``body``.

    Raises:
        InputError: ``start`` is no rest shape of this mesh.
        ConvergenceError: there is none, or none was found.
    """
    if start is not None and not isinstance(start, Rest):
        raise InputError(f"start must be a rest shape, got {type(start).__name__}.")
    if asked.directions_of == "rest" or not directions.has_any(body):
        rest = _find(body, asked, start)
    else:
        mirrored = asked.method == "reversed-gravity"
        rounding = directions.ROUNDING
        if asked.method in FIXED_POINTS:  # nodes are off by the tolerance, strains by more
            rounding = 100 * asked.fixed_point.tolerance
        rest = directions.rest_of_loaded(
            body, start, lambda b, s: _find(b, asked, s), mirrored, rounding
        )
    if asked.check_overlap:
        rest = overlap.require_apart(rest)
    return rest


def _find(body: Body, asked: Request, start: Rest | None) -> Rest:
    """With the body's directions those at rest."""
    if asked.method in FIXED_POINTS:
        rest = fixed_point.rest_shape(
            body, asked.method, asked.settings, asked.fixed_point, asked.density_of, start
        )
    else:
        rest = _solved(body, asked, start)
    failures.require_usable(rest)
    return rest


def _solved(body: Body, asked: Request, start: Rest | None) -> Rest:
    """By one solve: of the inverse form, or with the loads reversed."""
    begin = None if start is None else assembly.unknowns_of(body, start)
    if asked.method == "inverse":
        smooth = not body._description.has_kinks  # at which inexact steps lose the way
        gmres = asked.solver == "gmres" or (asked.solver == "auto" and smooth)
        result, built = newton.run(
            body,
            asked.settings,
            begin,
            True,
            asked.density_of,
            gmres,
            Judge(body, asked.density_of),
        )
    else:
        result, built = newton.run(body._reversed(), asked.settings, begin)
    failures.require_converged(result, built, body._description, asked.method)
    return Rest(
        **outcome(result, built, body._description, body._fixed),
        _solved=terms.snapshot(body._description),
        _form="inverse",
        method=asked.method,
        density_of=asked.density_of,
        _body=body._weighed_in(asked.density_of),
    )


class Judge:
    """Whether a body, loaded, would rest on the rest shapes that are found for it.

    One that any push leaves cannot have been seen in the given shape. Loads without an energy, such
    as a pressure that follows, hide it.

    Args:
        body: on the given shape.
        density_of: of the inverse form that is solved, as in `Body.rest_shape`.
    """

    def __init__(self, body: Body, density_of: str = "rest") -> None:
        self._given, self._form = body, (True, density_of)
        self._body = body.on(body.mesh)
        self._body._built = body._judging

    def __call__(self, found: Floats, _load_factor: float) -> Any:
        """Converged, inverted or unstable, of the unknowns ``found`` of the inverse form."""
        outcome, mesh = core().Outcome, self._body.mesh
        points = mesh.points + found[: mesh.points.size].reshape(-1, 3)
        if (smallest_jacobian(points, mesh.cells, mesh.table) <= 0).any():
            return outcome.inverted
        assembly.system(self._body).system.move_points(points.ravel())
        loaded = found.copy()
        loaded[: mesh.points.size] *= -1
        inverse = self._given._built[self._form].system
        unstable = newton.unstable_directions(self._body, loaded, inverse)
        return outcome.unstable if unstable else outcome.converged


def _require_one(name: str, value: str, choices: tuple[str, ...]) -> None:
    if value not in choices:
        raise InputError(f"{name} must be one of {choices}, got {value!r}.")
