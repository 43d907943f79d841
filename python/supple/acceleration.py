"""Ways to speed up a fixed point x = g(x), each told x and its residual r = g(x) - x in turn."""

from __future__ import annotations

from typing import Protocol

import numpy as np
import numpy.typing as npt

Floats = npt.NDArray[np.float64]

#: Columns of Anderson's least squares go, oldest first, until its R has no larger condition.
LARGEST_CONDITION = 1e8


class Acceleration(Protocol):
    """Makes the next iterate; keeps what it wants of those that it was told before."""

    def step(self, x: Floats, r: Floats) -> Floats:
        """The next iterate (n,) from ``x`` (n,) and its residual ``r`` = g(x) - x (n,)."""
        ...


class Relaxation:
    """x + ω r with a constant ω; 1 is the plain fixed point."""

    def __init__(self, relaxation: float = 1.0) -> None:
        self._relaxation = relaxation

    def step(self, x: Floats, r: Floats) -> Floats:
        return np.asarray(x + self._relaxation * r)


class Aitken:
    """x + ω r with ω from the last two residuals: Aitken's Δ² for vectors.

    Source: Irons and Tuck (1969), IJNME 1; Küttler and Wall (2008), Computational Mechanics 43,
    eq. 44.
    """

    def __init__(self, relaxation: float = 1.0) -> None:
        self._relaxation = relaxation
        self._last: Floats | None = None

    def step(self, x: Floats, r: Floats) -> Floats:
        if self._last is not None:
            change = r - self._last
            square = float(change @ change)
            if square > 0:
                self._relaxation *= -float(self._last @ change) / square
        self._last = r
        return np.asarray(x + self._relaxation * r)


class Anderson:
    """The mix of the last ``depth`` + 1 iterates whose linearised residual is the smallest.

    Source: Walker and Ni (2011), SIAM J. Numer. Anal. 49, unconstrained form and §4 on dropping
    the oldest columns where the least squares get ill-conditioned.
    """

    def __init__(self, depth: int = 8, relaxation: float = 1.0) -> None:
        self._depth, self._relaxation = depth, relaxation
        self._x: list[Floats] = []
        self._r: list[Floats] = []

    def step(self, x: Floats, r: Floats) -> Floats:
        self._x = [*self._x[-self._depth :], x]
        self._r = [*self._r[-self._depth :], r]
        plain = x + self._relaxation * r
        if len(self._x) == 1:
            return np.asarray(plain)
        moves, changes = np.diff(self._x, axis=0).T, np.diff(self._r, axis=0).T
        size = np.linalg.norm(changes, axis=0)
        size[size == 0] = 1.0
        share = _least_squares(changes / size, r) / size
        return np.asarray(plain - (moves + self._relaxation * changes) @ share)


def _least_squares(columns: Floats, r: Floats) -> Floats:
    """The shares (k,) of ``columns`` (n, k), of unit length, in ``r``; 0 for those left out."""
    share = np.zeros(columns.shape[1])
    for first in range(len(share)):
        Q, R = np.linalg.qr(columns[:, first:])
        if np.linalg.cond(R) <= LARGEST_CONDITION:
            share[first:] = np.linalg.solve(R, Q.T @ r)
            break
    return share
