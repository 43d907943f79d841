"""The check of a rest shape: loaded again, it must be the shape that was given."""

from __future__ import annotations

from dataclasses import dataclass, fields
from time import perf_counter
from typing import TYPE_CHECKING, Any

import numpy as np

from .errors import ConvergenceError
from .state import State

if TYPE_CHECKING:
    from .body import Body
    from .state import Rest

#: Of the size of the given shape: how far off the rest shape may come out when loaded again.
CLOSES = 1e-6


@dataclass(frozen=True, eq=False)
class RoundTrip:
    """A rest shape under its loads again.

    Attributes:
        state: the forward solve on the rest shape.
        distance: m, the largest of a node from where it was given.
        relative: the same over the size of the given shape.
        seconds: wall time of the forward solve.
        given: what the given shape is to this rest shape: "reached", to within `CLOSES`; "another
            equilibrium", a stable one that loading from zero does not lead to; "unstable", an
            equilibrium that a push would leave; "no equilibrium" of it.
    """

    state: State
    distance: float
    relative: float
    seconds: float
    given: str


def round_trip(rest: Rest, near: bool = False, **settings: Any) -> RoundTrip:
    """Solve the body at rest forward and measure how far it misses the shape that was given.

    Args:
        rest: as `Body.rest_shape` found it, by whatever method.
        near: start at the given shape instead of from zero. A body may have several equilibria
            under one load; this asks whether the given shape is one, and stable.
        **settings: load_steps, rtol, atol, max_iterations, progress of `Body.solve`.

    Raises:
        ConvergenceError: the solve leads to no stable equilibrium.
    """
    again, begin = rest.body(), perf_counter()
    state = again.solve(start=_as_given(rest) if near else None, **settings)
    seconds, distance = perf_counter() - begin, _distance(state, rest)
    relative = distance / rest.loaded.size
    if relative <= CLOSES:
        given = "reached"
    else:
        given = "no equilibrium" if near else _given(again, rest, settings)
    return RoundTrip(state, distance, relative, seconds, given)


def _as_given(rest: Rest) -> State:
    """The given shape as a state of the body at rest, to start from."""
    shared = {f.name: getattr(rest, f.name) for f in fields(State)}
    return State(**shared | {"u": -rest.u})


def _distance(state: State, rest: Rest) -> float:
    return float(np.linalg.norm(state.points - rest.loaded.points, axis=1).max())


def _given(again: Body, rest: Rest, settings: dict[str, Any]) -> str:
    """What a solve that starts from the given shape says of it."""
    try:
        near = again.solve(start=_as_given(rest), **settings)
    except ConvergenceError as error:
        return "unstable" if "unstable" in error.cause else "no equilibrium"
    near_enough = _distance(near, rest) <= CLOSES * rest.loaded.size
    return "another equilibrium" if near_enough else "no equilibrium"


def reversed_gravity_error(rest: Rest) -> float:
    """Largest distance of a node between ``rest`` and the shortcut's rest shape, as share of size.

    The shortcut reverses the loads on the loaded shape (Mazier 2022, chapter 5), here with the
    laws' directions at rest. NaN where the loads have no equilibrium then.
    """
    try:
        rough = rest._body.rest_shape(method="reversed-gravity", density_of=rest.density_of)
    except ConvergenceError:
        return float("nan")
    away = np.linalg.norm(rough.points - rest.points, axis=1)
    return float(away.max() / rest.loaded.size)
