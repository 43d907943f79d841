"""The check of a rest shape: loaded again, it must be the shape that was given."""

from __future__ import annotations

from dataclasses import dataclass, replace
from time import perf_counter
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from .errors import ConvergenceError
from .state import State

if TYPE_CHECKING:
    from .body import Body
    from .mesh import Mesh
    from .state import Rest

Floats = npt.NDArray[np.float64]

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


def round_trip(body: Body, rest: Rest, density_of: str = "rest", **settings: Any) -> RoundTrip:
    """Solve ``body`` forward from its rest shape and measure how far it misses the given shape.

    Args:
        body: the loaded one that ``rest`` was found for, its loads unchanged.
        density_of: as it was in `Body.rest_shape`.
        **settings: of `Body.solve`.

    Raises:
        ConvergenceError: loading the rest shape from zero leads to no stable equilibrium.
    """
    again, begin = _at_rest(body, rest, density_of), perf_counter()
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


def _at_rest(body: Body, rest: Rest, density_of: str) -> Body:
    """The body on its rest shape, as heavy as the loaded one."""
    again = body.on(rest.mesh)
    if density_of == "rest":
        return again
    everywhere = np.arange(len(rest.mesh.points))
    return again.gravity((0.0, 0.0, 0.0)).force(everywhere, _weights(body, rest.loaded))


def _weights(body: Body, loaded: Mesh) -> Floats:
    """Nodal forces (n, 3) N of gravity where the density counts in the loaded shape."""
    from .body import assemble

    heavy, still = body.on(loaded), np.zeros_like(loaded.points)
    light = body.on(loaded).gravity((0.0, 0.0, 0.0))
    residuals = [assemble(b, still)[1].ravel()[: still.size] for b in (light, heavy)]
    return np.asarray(residuals[0] - residuals[1]).reshape(-1, 3)
