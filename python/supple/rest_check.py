"""The check of a rest shape: loaded again, it must be the shape that was given."""

from __future__ import annotations

from dataclasses import dataclass, replace
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
    """What `Rest.round_trip` returns."""
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
