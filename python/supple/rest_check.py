"""The check of a rest shape: loaded again, it must be the shape that was given."""

from __future__ import annotations

from dataclasses import dataclass, replace
from time import perf_counter
from typing import TYPE_CHECKING, Any

import numpy as np

from .errors import ConvergenceError
from .fixed_point import Forward
from .newton import Settings
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
        state: the forward solve on the rest shape, from zero.
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


def round_trip(rest: Rest, **settings: Any) -> RoundTrip:
    """Solve the body at rest forward and measure how far it misses the shape that was given.

    Args:
        rest: as `Body.rest_shape` found it, by whatever method.
        **settings: of `Body.solve`.

    Raises:
        ConvergenceError: loading the rest shape from zero leads to no stable equilibrium.
    """
    again, begin = rest.body(), perf_counter()
    state = again.solve(**settings)
    seconds, distance = perf_counter() - begin, _distance(state, rest)
    relative = distance / rest.loaded.size
    given = "reached" if relative <= CLOSES else _given(again, rest, state, settings)
    return RoundTrip(state, distance, relative, seconds, given)


def _distance(state: State, rest: Rest) -> float:
    return float(np.linalg.norm(state.points - rest.loaded.points, axis=1).max())


def _given(again: Body, rest: Rest, other: State, settings: dict[str, Any]) -> str:
    """What a solve that starts from the given shape says of it."""
    start = replace(other, u=-rest.u, pressure=rest.pressure)
    try:
        near = again.solve(start=start, **settings)
    except ConvergenceError as error:
        return "unstable" if "unstable" in error.cause else "no equilibrium"
    near_enough = _distance(near, rest) <= CLOSES * rest.loaded.size
    return "another equilibrium" if near_enough else "no equilibrium"


def round_trip_error(body: Body, rest: Rest, near: bool = False, **settings: Any) -> float:
    """Largest distance of a node from where it should be after a forward solve, as share of size.

    Args:
        body: the one whose `Body.rest_shape` gave ``rest``, on the loaded shape.
        near: start the solve at the loaded shape instead of at rest. A body may have several
            equilibria under one load; this asks whether the loaded shape is one, and stable.
        **settings: load_steps, rtol, atol, max_iterations, progress of `Body.solve`.

    Raises:
        ConvergenceError: no equilibrium was found.
    """
    return Forward(body, rest.density_of).shoot(rest.points, Settings(**settings), near).miss


def reversed_gravity_error(body: Body, rest: Rest) -> float:
    """Largest distance of a node between ``rest`` and the shortcut's rest shape, as share of size.

    The shortcut reverses the loads on the loaded shape (Mazier 2022, chapter 5). NaN where they
    have no equilibrium then.
    """
    try:
        rough = body.rest_shape(method="reversed-gravity", density_of=rest.density_of)
    except ConvergenceError:
        return float("nan")
    away = np.linalg.norm(rough.points - rest.points, axis=1)
    return float(away.max() / body.mesh.size)
