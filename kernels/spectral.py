"""Sums over the principal stretches, Σ φ(λi²), with derivatives exact where stretches coincide.

C is looked at from its own eigenframe at the point of evaluation: eigenvalues x and eigenvectors q
are computed there and frozen. With M = qᵀ C q,

    Σ φ ≈ Σ_i φ(x_i) + φ'(x_i) (M_ii - x_i) + φ''(x_i)/2 (M_ii - x_i)²  +  Σ_{i<j} θ_ij M_ij²

and θ_ij = (φ'(x_i) - φ'(x_j))/(x_i - x_j). This is a quadratic polynomial in C with the value and
the first two derivatives of Σ φ at that point (Daleckii–Krein; Ogden 1984, §6.1.4): all that
residual, tangent and sensitivities take. θ is written so that equal eigenvalues cancel nothing.
"""

from __future__ import annotations

from functools import cached_property
from typing import Any

import ufl
from ufl.constantvalue import Zero

from .functions import freeze

_PAIRS = ((0, 1), (0, 2), (1, 2))
#: Sweeps of three rotations; off-diagonals fall quadratically, and what is left acts at order 3.
_SWEEPS = 4
#: Least eigenvalue that a power is taken of, where F is singular and the law infinite anyhow.
_LEAST = 1e-150


class Spectrum:
    """C (3, 3) in its frozen eigenframe: eigenvalues ``x`` (3) and entries M."""

    def __init__(self, C: Any) -> None:
        self.C = C
        values, self._q = _jacobi([[freeze(C[i, j]) for j in range(3)] for i in range(3)])
        self.x = [ufl.max_value(freeze(v), _LEAST) for v in values]

    @cached_property
    def M(self) -> list[list[Any]]:
        """qᵀ C q (3, 3)."""
        columns = [[freeze(self._q[a][i]) for a in range(3)] for i in range(3)]
        images = [[sum(self.C[a, b] * q[b] for b in range(3)) for a in range(3)] for q in columns]
        return [[sum(p[a] * v[a] for a in range(3)) for v in images] for p in columns]

    def half_log_ratio(self, i: int, j: int) -> Any:
        """δ = ln(x_i/x_j)/2, kept from zero: what it enters is even in δ and smooth."""
        return ufl.sqrt((0.5 * ufl.ln(self.x[i] / self.x[j])) ** 2 + 1e-20)

    def powers(self, alpha: Any) -> Any:
        """Σ λ^α, α any real number."""
        s = 0.5 * alpha
        p = [x**s for x in self.x]

        def chord(i: int, j: int) -> Any:
            delta = self.half_log_ratio(i, j)
            mean = ufl.sqrt(p[i] * p[j]) / (self.x[i] * self.x[j])
            return s * mean * ufl.sinh((s - 1) * delta) / ufl.sinh(delta)

        slopes = [s * p[i] / x for i, x in enumerate(self.x)]
        curvatures = [s * (s - 1) * p[i] / x**2 for i, x in enumerate(self.x)]
        return self._sum(p, slopes, curvatures, chord)

    def squared_logarithms(self) -> Any:
        """Σ ln²λ."""
        logs = [ufl.ln(x) for x in self.x]

        def chord(i: int, j: int) -> Any:
            delta = self.half_log_ratio(i, j)
            rest = delta * ufl.cosh(delta) / ufl.sinh(delta) - 0.5 * (logs[i] + logs[j])
            return rest / (2 * self.x[i] * self.x[j])

        slopes = [0.5 * v / x for v, x in zip(logs, self.x, strict=True)]
        curvatures = [0.5 * (1 - v) / x**2 for v, x in zip(logs, self.x, strict=True)]
        return self._sum([0.25 * v**2 for v in logs], slopes, curvatures, chord)

    def _sum(self, values: Any, slopes: Any, curvatures: Any, chord: Any) -> Any:
        off = [self.M[i][i] - self.x[i] for i in range(3)]
        along = sum(values[i] + slopes[i] * off[i] + 0.5 * curvatures[i] * off[i] ** 2
                    for i in range(3))  # fmt: skip
        return along + sum(chord(i, j) * self.M[i][j] ** 2 for i, j in _PAIRS)


def _jacobi(a: list[list[Any]]) -> tuple[list[Any], list[list[Any]]]:
    """Eigenvalues (3) and eigenvectors, columns of (3, 3), of a symmetric matrix of scalars.

    Source: Golub and Van Loan (2013), Matrix Computations, §8.5, cyclic Jacobi by rows, unrolled.
    """
    one, nought = ufl.as_ufl(1.0), Zero()
    q: list[list[Any]] = [[one if i == j else nought for j in range(3)] for i in range(3)]
    for _ in range(_SWEEPS):
        for m, n in _PAIRS:
            if isinstance(a[m][n], Zero):
                continue
            t = _tangent_of_rotation(a[m][m], a[n][n], a[m][n])
            c = 1 / ufl.sqrt(1 + t**2)
            s, shift, r = t * c, t * a[m][n], 3 - m - n
            a[m][m], a[n][n] = a[m][m] - shift, a[n][n] + shift
            a[m][n] = a[n][m] = nought
            rm, rn = a[r][m], a[r][n]
            a[r][m] = a[m][r] = c * rm - s * rn
            a[r][n] = a[n][r] = s * rm + c * rn
            for row in q:
                row[m], row[n] = c * row[m] - s * row[n], s * row[m] + c * row[n]
    return [a[i][i] for i in range(3)], q


def _tangent_of_rotation(first: Any, second: Any, between: Any) -> Any:
    """The smaller root t of t² + 2 t (second - first)/(2 between) = 1; 0 where ``between`` is."""
    d, o = second - first, 2 * between
    signed = ufl.conditional(ufl.ge(d, 0.0), o, -o)
    return signed / (abs(d) + ufl.sqrt(d**2 + o**2) + 1e-300)
