"""What an energy sees of the deformation, `k`: tensors and invariants of F, lazily.

The same class serves UFL expressions (kernels) and numbers (checks); see `tensors`.
"""

from __future__ import annotations

from functools import cached_property
from typing import Any

import numpy as np

from . import tensors as e

_IN_PLANE = "k.{} is of a membrane's plane; use it in psi_surface, and k.I1 or k.J in a solid."


class Unavailable(Exception):
    """A word that this kinematics does not have: half a sentence with the remedy."""


class Kinematics:
    """Tensors and invariants of one deformation gradient.

    Args:
        F: deformation gradient (3, 3).
        edges: covariant base vectors of the cell at rest, dX/dxi (3, 3), columns; on P1 these are
            the edges from the first vertex. Only the QR strain looks at them.
        C: right Cauchy–Green tensor, where it is known without F (membranes).
        J: its volume ratio, where it is known.
    """

    def __init__(self, F: Any = None, edges: Any = None, *, C: Any = None, J: Any = None) -> None:
        self._F, self._edges, self._C, self._J = F, edges, C, J

    @cached_property
    def F(self) -> Any:
        """Deformation gradient (3, 3); of a membrane its stretch tensor."""
        return self.U if self._F is None else self._F

    @cached_property
    def C(self) -> Any:
        """FᵀF."""
        return self._F.T * self._F if self._C is None else self._C

    @cached_property
    def B(self) -> Any:
        """F Fᵀ."""
        return self.F * self.F.T

    @cached_property
    def E(self) -> Any:
        """(C - I)/2, Green–Lagrange."""
        return 0.5 * (self.C - _identity_like(self.C))

    @cached_property
    def E_bar(self) -> Any:
        """(J^(-2/3) C - I)/2, the strain without its change of volume."""
        return 0.5 * (self.J ** (-2.0 / 3.0) * self.C - _identity_like(self.C))

    @cached_property
    def small_strain(self) -> Any:
        """sym(F) - I, not objective."""
        return e.sym(self.F) - _identity_like(self.C)

    @cached_property
    def J(self) -> Any:
        """det F."""
        return e.det(self._F) if self._J is None else self._J

    @cached_property
    def I1(self) -> Any:
        """tr C."""
        return e.tr(self.C)

    @cached_property
    def I2(self) -> Any:
        """(I1² - tr C²)/2."""
        return 0.5 * (self.I1**2 - e.inner(self.C, self.C))

    @cached_property
    def I3(self) -> Any:
        """det C = J²."""
        return self.J**2

    @cached_property
    def I1_bar(self) -> Any:
        """J^(-2/3) I1."""
        return self.J ** (-2.0 / 3.0) * self.I1

    @cached_property
    def I2_bar(self) -> Any:
        """J^(-4/3) I2."""
        return self.J ** (-4.0 / 3.0) * self.I2

    def I4(self, f: Any) -> Any:
        """f·C f, the squared stretch of the fibre direction ``f`` (3,)."""
        return e.dot(f, self.C * f)

    def I4_bar(self, f: Any) -> Any:
        """J^(-2/3) I4."""
        return self.J ** (-2.0 / 3.0) * self.I4(f)

    def I5(self, f: Any) -> Any:
        """f·C² f."""
        return e.inner(self.C * f, self.C * f)

    def I8(self, f: Any, s: Any) -> Any:
        """f·C s."""
        return e.dot(f, self.C * s)

    @property
    def I1_s(self) -> Any:
        """tr C of a membrane, in its plane."""
        raise Unavailable(_IN_PLANE.format("I1_s"))

    @property
    def J_s(self) -> Any:
        """Area ratio of a membrane."""
        raise Unavailable(_IN_PLANE.format("J_s"))

    def stretch_sum(self, alpha: Any) -> Any:
        """λ1^α + λ2^α + λ3^α, any real α, with exact derivatives where stretches coincide."""
        if self._spectrum is None:
            return (_squared_stretches(self.C) ** (0.5 * alpha)).sum()
        return self._spectrum.powers(alpha)

    @cached_property
    def log_stretch_squares(self) -> Any:
        """ln²λ1 + ln²λ2 + ln²λ3, with exact derivatives where stretches coincide."""
        if self._spectrum is None:
            return (0.25 * np.log(_squared_stretches(self.C)) ** 2).sum()
        return self._spectrum.squared_logarithms()

    @cached_property
    def _spectrum(self) -> Any:
        if not e.is_symbolic(self.C):
            return None
        from .spectral import Spectrum

        return Spectrum(self.C)

    @cached_property
    def trace_U(self) -> Any:
        """tr U, the sum of the principal stretches, with exact derivatives where they coincide.

        It is the largest root y of y⁴ - 2 I1 y² - 8 J y + I1² - 4 I2 = 0, a simple root as long as
        no two stretches sum to zero, hence a smooth function of I1, I2, J. A closed form gives
        the value; two Newton steps on the quartic from that value, held constant, give the value
        to rounding and the first and second derivatives (each step doubles the order).
        """
        if not e.is_symbolic(self.C):
            return _trace_of_stretch(np.asarray(self.C), float(self.J))
        from .stretch import trace_seed

        y = trace_seed(self.I1, self.I2, self.J)
        for _ in range(2):
            y = y - _quartic(y, self) / (4 * y**3 - 4 * self.I1 * y - 8 * self.J)
        return y

    @cached_property
    def U(self) -> Any:
        """Right stretch tensor (3, 3); Hoger and Carlson (1984), Q. Appl. Math. 42, eq. 3.7."""
        i1, i3 = self.trace_U, self.J
        i2 = 0.5 * (i1**2 - self.I1)
        rational = i1 * i3 * _identity_like(self.C) + (i1**2 - i2) * self.C - self.C * self.C
        return 1.0 / (i1 * i2 - i3) * rational

    @cached_property
    def qr_strain(self) -> Any:
        """sym(R R0⁻¹) - I (3, 3), R and R0 the triangular QR factors of the edges now and at rest.

        The edges are the covariant base vectors: on P1 the vertex edges of Mazier 2022, eq. 75.
        R comes from the Cholesky factor of the edges' metric, so no rotation is ever formed.
        """
        edges = self._edges
        upper_now = _cholesky_upper(edges.T * self.C * edges)
        upper_rest = _cholesky_upper(edges.T * edges)
        ratio = upper_now * _inverse_upper(upper_rest)
        return e.sym(ratio) - _identity_like(self.C)


#: What an energy file may ask of k.
ATTRIBUTES = sorted(name for name in vars(Kinematics) if not name.startswith("_"))


def _quartic(y: Any, k: Kinematics) -> Any:
    return (y**2 - k.I1) ** 2 - 8 * k.J * y - 4 * k.I2


def _identity_like(a: Any) -> Any:
    if e.is_symbolic(a):
        import ufl

        return ufl.Identity(a.ufl_shape[0])
    return e.identity()


def _squared_stretches(C: np.ndarray) -> np.ndarray:
    return np.maximum(np.linalg.eigvalsh(np.asarray(C)), 0.0)


def _trace_of_stretch(C: np.ndarray, J: float) -> np.float64:
    stretches = np.sqrt(_squared_stretches(C))
    stretches[0] *= np.sign(J) if J < 0 else 1.0
    return np.float64(stretches.sum())


def matrix(rows: list[list[Any]], like: Any) -> Any:
    """(n, n) of scalars: UFL if ``like`` is, otherwise numbers."""
    if e.is_symbolic(like):
        import ufl

        return ufl.as_matrix(rows)
    return np.array(rows, dtype=float).view(e.Tensor)


def _cholesky_upper(a: Any) -> Any:
    """R upper triangular with positive diagonal and RᵀR = a (3, 3)."""
    r00 = e.sqrt(a[0, 0])
    r01, r02 = a[0, 1] / r00, a[0, 2] / r00
    r11 = e.sqrt(a[1, 1] - r01**2)
    r12 = (a[1, 2] - r01 * r02) / r11
    r22 = e.sqrt(a[2, 2] - r02**2 - r12**2)
    return matrix([[r00, r01, r02], [0, r11, r12], [0, 0, r22]], a)


def _inverse_upper(r: Any) -> Any:
    i0, i1, i2 = 1 / r[0, 0], 1 / r[1, 1], 1 / r[2, 2]
    i01 = -r[0, 1] * i0 * i1
    i12 = -r[1, 2] * i1 * i2
    i02 = (r[0, 1] * r[1, 2] * i1 - r[0, 2]) * i0 * i2
    return matrix([[i0, i01, i02], [0, i1, i12], [0, 0, i2]], r)
