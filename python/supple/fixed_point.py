"""Rest shapes by forward solves alone: Sellier's fixed point, plain or accelerated.

    X = loaded shape → forward solve x(X) → miss x(X) - loaded → next X → … until every node is met

The plain step X - (x(X) - loaded) multiplies a miss by I - ∂x/∂X: it converges only while stretches
stay below 2 and rotations below 60°, where |1 - exp(iθ)| = 1. Source: Sellier (2011), Engineering
Computations 28; Mazier 2022, algorithm 1.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import numpy.typing as npt

from . import failures, newton, terms
from .acceleration import Acceleration, Aitken, Anderson, Relaxation
from .choices import FIXED_POINTS
from .errors import ConvergenceError, InputError, MeshError
from .state import PHASES, Rest, outcome

if TYPE_CHECKING:
    from .body import Body

Floats = npt.NDArray[np.float64]

#: Times that a step to where no forward solve succeeds is halved.
_CUTS = 4
#: Solves without a better miss, and growth of the first miss, after which it has diverged.
_PATIENCE, _GROWTH = 12, 3.0


@dataclass(frozen=True)
class FixedPoint:
    """How a fixed point runs.

    Attributes:
        relaxation: factor of the plain step, above 0; of Aitken's the first.
        depth: iterates that Anderson's method looks back on.
        tolerance: largest miss of a node, as a share of the body's size, to stop at.
        max_solves: forward solves after which it gives up.
        warm: start forward solves at the loaded shape, which is near; from zero where that fails.
        exact: solve forward to the full tolerance each time, instead of as far as the miss is
            worth; the last solve always is.
    """

    relaxation: float = 1.0
    depth: int = 8
    tolerance: float = 1e-9
    max_solves: int = 100
    warm: bool = True
    exact: bool = False

    def __post_init__(self) -> None:
        for name in ("depth", "max_solves"):
            if not isinstance(getattr(self, name), int):
                raise InputError(f"{name} must be a whole number, got {getattr(self, name)!r}.")
        for name in ("relaxation", "depth", "tolerance", "max_solves"):
            value = getattr(self, name)
            if not (np.isfinite(value) and value > 0):
                raise InputError(f"{name} must be above 0, got {value}.")

    def acceleration(self, method: str) -> Acceleration:
        """What ``method`` names."""
        if method == "sellier-anderson":
            return Anderson(self.depth, self.relaxation)
        if method == "sellier-aitken":
            return Aitken(self.relaxation)
        return Relaxation(self.relaxation)


def options(given: dict[str, Any], method: str) -> FixedPoint:
    """The settings of these names.

    Raises:
        InputError: an unknown name, one that ``method`` does not take, or a senseless value.
    """
    known = FixedPoint.__dataclass_fields__
    for name in given:
        if name not in known or method not in FIXED_POINTS:
            raise InputError(
                f"rest_shape with method {method!r} takes no {name!r}; "
                f"{', '.join(FIXED_POINTS)} take {', '.join(known)}."
            )
    return FixedPoint(**given)


class Shot(NamedTuple):
    """A forward solve from rest points, and how far it misses the loaded shape.

    Attributes:
        points: (n, 3) m, at rest.
        residual: (n, 3) m, from where the nodes went to where they should be.
        miss: the largest of them as a share of the size.
        result, built: what the runtime found, and its system.
    """

    points: Floats
    residual: Floats
    miss: float
    result: Any
    built: terms.Built


class Forward:
    """Forward solves of one body from ever other rest points, in one system.

    Args:
        body: on the loaded shape.
        density_of: as in `Body.rest_shape`.
    """

    def __init__(self, body: Body, density_of: str = "rest") -> None:
        self.target, self.size = body.mesh.points, body.mesh.size
        self.history: list[dict[str, float]] = []
        self.timings: dict[str, float] = dict.fromkeys(PHASES, 0.0)
        self.solves = 0
        self.body = body._weighed_in(density_of)
        self._scalars = np.zeros(len(terms.pressure_nodes(body._description)))  # Pa

    def shoot(self, points: Floats, settings: newton.Settings, near: bool = False) -> Shot:
        """Solve from rest at ``points`` (n, 3) m, from zero or if ``near`` from the loaded shape.

        Raises:
            ConvergenceError: no equilibrium. MeshError: ``points`` have inverted cells.
        """
        body = self.body.on(self.body.mesh.moved(points))
        body._built = self.body._built
        for built in body._built.values():
            built.system.move_points(np.ascontiguousarray(points).ravel())
        self.solves += 1
        start = np.append(self.target - points, self._scalars) if near else None
        return self._solve(body, settings, start)

    def _solve(self, body: Body, settings: newton.Settings, start: Floats | None) -> Shot:
        result, built = newton.run(body, settings, start)
        for name in PHASES:
            self.timings[name] += getattr(built.system.timings, name)
        rows = [newton.as_dict(i) | {"solve": float(self.solves)} for i in result.history]
        self.history += rows
        failures.require_converged(result, built, body._description)
        flat, n = result.u, self.target.size
        self._scalars = flat[n:] * built.scalar_unit
        points = body.mesh.points
        residual = self.target - points - flat[:n].reshape(-1, 3)
        miss = float(np.linalg.norm(residual, axis=1).max() / self.size)
        rows[-1]["miss"] = miss
        return Shot(points, residual, miss, result, built)


def rest_shape(
    body: Body,
    method: str,
    settings: newton.Settings,
    chosen: FixedPoint,
    density_of: str,
    start: Rest | None,
) -> Rest:
    """The rest shape by one of `FIXED_POINTS`; `Body.rest_shape` says the rest.

    Raises:
        ConvergenceError: the fixed point diverges or stalls, or a forward solve fails.
    """
    forward, misses = Forward(body, density_of), list[float]()
    trial = forward.target if start is None else start.points
    shot = _search(forward, trial, method, settings, chosen, misses)
    fields = outcome(shot.result, shot.built, body._description, body._fixed) | {
        "u": shot.points - forward.target,
        "iterations": sum(1 for row in forward.history if row["iteration"] > 0),
        "history": forward.history,
        "timings": {"solver": str(shot.built.solver), **forward.timings},
    }
    solved = terms.snapshot(body._description)
    return Rest(
        **fields, _solved=solved, _form="inverse", method=method, density_of=density_of,
        solves=forward.solves, misses=tuple(misses), _body=forward.body.on(body.mesh),
    )  # fmt: skip


def _search(
    forward: Forward, trial: Floats, method: str, settings: newton.Settings, chosen: FixedPoint,
    misses: list[float],
) -> Shot:  # fmt: skip
    """Iterate until a shot meets every node; its misses are added to ``misses``."""
    acceleration, body = chosen.acceleration(method), forward.body
    shot: Shot | None = None
    while True:
        worth = settings if chosen.exact else _worth(settings, misses)
        shot = _shoot(forward, trial, shot, worth, method, chosen.warm)
        if shot.miss <= chosen.tolerance and worth != settings:
            shot = _shoot(forward, shot.points, shot, settings, method, chosen.warm)
        misses.append(shot.miss)
        if shot.miss <= chosen.tolerance:
            return shot
        _require_hope(forward, misses, chosen, method)
        step = acceleration.step(shot.points.ravel(), shot.residual.ravel())
        trial = step.reshape(-1, 3)
        trial[body._fixed] = (forward.target - body._prescribed)[body._fixed]


def _worth(settings: newton.Settings, misses: list[float]) -> newton.Settings:
    """Tolerances a little below the miss that the next shot can be hoped to have."""
    expected = 0.1 * misses[-1] if misses else 0.0
    rtol = max(settings.rtol, min(0.1 * expected, 1e-3))
    return replace(settings, rtol=rtol, step_tol=max(settings.step_tol, expected))


def _shoot(
    forward: Forward,
    trial: Floats,
    last: Shot | None,
    settings: newton.Settings,
    method: str,
    warm: bool,
) -> Shot:
    """Shoot from ``trial``, or from nearer to the last shot's points where that fails.

    The way from the loaded shape is the shorter one, the way from zero the surer one.
    """
    ways = (True, False) if warm and last is not None else (False,)
    for near in ways if last is None else _CUTS * ways:
        try:
            return forward.shoot(trial, settings, near)
        except (ConvergenceError, MeshError) as problem:
            failure: Exception = problem
        except InputError as problem:
            if last is None:
                raise  # the body's own; later it is a start whose forces are not finite
            failure = problem
        if last is not None and not near:
            trial = 0.5 * (trial + last.points)
    raise _failure(f"a forward solve of {method} fails", method, forward, failure) from failure


def _require_hope(forward: Forward, misses: list[float], chosen: FixedPoint, method: str) -> None:
    """Refuse misses that grow, do not fall any more, or take too long."""
    best = int(np.argmin(misses))
    if misses[-1] > _GROWTH * misses[0]:
        raise _failure(f"{method} diverges", method, forward)
    if len(misses) - 1 - best >= _PATIENCE:
        cause = f"{method} stalls at a miss of {misses[best]:.2g} of the size"
        raise _failure(cause, method, forward)
    if len(misses) >= chosen.max_solves:
        cause = f"{method} has not converged in max_solves = {chosen.max_solves}"
        raise _failure(cause, method, forward)


def _failure(
    cause: str, method: str, forward: Forward, inner: Exception | None = None
) -> ConvergenceError:
    """The error for ``cause``, with all that was tried."""
    because = "" if inner is None else f" ({str(inner).rstrip('.')})"
    better = "" if method == "sellier-anderson" else ' or "sellier-anderson"'
    known = inner if isinstance(inner, ConvergenceError) else None
    return ConvergenceError(
        f"no rest shape was found: {cause} after {forward.solves} forward solves{because}; "
        f'try method="inverse"{better}, a smaller load or a smaller relaxation.',
        history=forward.history,
        cells=() if known is None else known.cells,
        load_factor=known.load_factor if known is not None and forward.solves == 1 else 0.0,
        cause=cause,
    )
