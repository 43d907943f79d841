"""Where a solve starts that has neighbours: what was solved for parameters nearby, carried on."""

from __future__ import annotations

from collections import deque
from collections.abc import Mapping
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

if TYPE_CHECKING:
    from .state import State

Floats = npt.NDArray[np.float64]

#: States that are kept, the latest; and of these the nearest that one start is made of.
_KEPT, _USED = 16, 4
#: Largest share of a difference between two states that a start is carried on by.
_FARTHEST = 2.0


def numbers(entry: Any) -> Floats | None:
    """The parameters of an entry as one row, None where they are no numbers."""
    values = [entry[n] for n in sorted(entry)] if isinstance(entry, Mapping) else [entry]
    try:
        return np.concatenate([np.asarray(v, dtype=float).ravel() for v in values])
    except (TypeError, ValueError):
        return None


class Nearby:
    """The latest states and their parameters."""

    def __init__(self) -> None:
        self._states: deque[tuple[Floats | None, State]] = deque(maxlen=_KEPT)

    def keep(self, x: Floats | None, state: State) -> None:
        """One more state to start from."""
        self._states.append((x, state))

    def start(self, x: Floats | None) -> State | None:
        """A state near the one of parameters ``x``, or None.

        It is affine in the nearest states, with the weights by which their parameters come closest
        to x: the secant where one parameter changes. Parameters count relative to x.
        """
        if not self._states:
            return None
        if x is None:
            return self._states[-1][1]
        alike = [(y, s) for y, s in self._states if y is not None and y.shape == x.shape]
        if not alike:
            return self._states[-1][1]
        unit = np.where(x == 0, 1.0, np.abs(x))
        away = np.array([(y - x) / unit for y, _ in alike])
        near = np.argsort(np.linalg.norm(away, axis=1), kind="stable")[:_USED]
        first = alike[near[0]][1]
        weights = _weights(away[near])
        u = first.u.copy()
        for weight, k in zip(weights, near[1:], strict=True):
            u += weight * (alike[k][1].u - first.u)
        carried: State = replace(first, u=u)
        return carried


def _weights(away: Floats) -> Floats:
    """c (k - 1,) such that away[0] + Σ c_j (away[j] - away[0]) is smallest, or 0 if far-fetched."""
    steps = away[1:] - away[0]
    c: Floats = np.linalg.lstsq(steps.T, -away[0], rcond=1e-3)[0]
    return c if np.abs(c).max(initial=0.0) <= _FARTHEST else np.zeros_like(c)
