"""Strong ellipticity: whether a small plane wave of any direction finds a stiffness above zero.

Source: Ogden (1984), Non-linear Elastic Deformations, §6.2.7: (a⊗n):A:(a⊗n) > 0 for all a, n ≠ 0.
"""

from __future__ import annotations

from functools import cache

import numpy as np
import numpy.typing as npt

Floats = npt.NDArray[np.float64]

_DIRECTIONS, _REFINEMENTS = 400, 12


def least_wave_stiffness(A: Floats) -> Floats:
    """min over unit a, n of (a⊗n):A:(a⊗n) (m,), Pa, of tangents A (m, 3, 3, 3, 3); NaN of NaN.

    The smallest eigenvalue of the acoustic tensors of directions all over the half sphere; from
    the least of them a and n are improved in turn, which never raises it.
    """
    least = np.full(len(A), np.nan)
    good = np.isfinite(A).all(axis=(1, 2, 3, 4))
    if good.any():
        least[good] = _least(A[good])
    return least


def _least(A: Floats) -> Floats:
    directions = _half_sphere(_DIRECTIONS)
    dyads = np.einsum("dj,dl->djl", directions, directions).reshape(-1, 9)
    pairs = A.transpose(0, 1, 3, 2, 4).reshape(len(A), 9, 9)
    acoustic = np.swapaxes(pairs @ dyads.T, 1, 2).reshape(len(A), -1, 3, 3)
    worst = np.linalg.eigvalsh(_symmetric(acoustic))[:, :, 0].argmin(axis=1)
    n = directions[worst]
    for _ in range(_REFINEMENTS):
        value, a = _smallest(np.einsum("mijkl,mj,ml->mik", A, n, n))
        value, n = _smallest(np.einsum("mijkl,mi,mk->mjl", A, a, a))
    return value


def _smallest(matrix: Floats) -> tuple[Floats, Floats]:
    """Smallest eigenvalue (m,) and its vector (m, 3)."""
    values, vectors = np.linalg.eigh(_symmetric(matrix))
    return values[:, 0], vectors[:, :, 0]


def _symmetric(matrix: Floats) -> Floats:
    half: Floats = 0.5 * (matrix + np.swapaxes(matrix, -1, -2))
    return half


@cache
def _half_sphere(count: int) -> Floats:
    """Unit vectors (count, 3), evenly spread: a Fibonacci spiral on the upper half."""
    i = np.arange(count) + 0.5
    height, angle = i / count, np.pi * (1 + np.sqrt(5)) * i
    radius = np.sqrt(1 - height**2)
    return np.column_stack([radius * np.cos(angle), radius * np.sin(angle), height])
