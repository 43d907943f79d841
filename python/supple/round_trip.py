"""How good a rest shape is, by forward solves: whatever the method that found it."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from .errors import ConvergenceError
from .fixed_point import Forward
from .newton import Settings

if TYPE_CHECKING:
    from .body import Body
    from .state import Rest


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
