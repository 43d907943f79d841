"""Operations that an energy may use, on UFL expressions (kernels) and on numbers (checks) alike.

Numbers are NumPy's: past their range they become infinite, where Python's own would raise.
"""

from __future__ import annotations

from typing import Any

import numpy as np


class Tensor(np.ndarray):
    """A numeric 3 x 3 tensor whose ``*`` multiplies as UFL's does."""

    def __mul__(self, other: Any) -> Any:
        if isinstance(other, np.ndarray) and other.ndim >= 1 and self.ndim == 2:
            return np.matmul(self, other)
        return np.ndarray.__mul__(self, other)

    @property
    def T(self) -> Tensor:
        return self.transpose().view(Tensor)


def is_symbolic(x: Any) -> bool:
    """True for a UFL expression, without importing UFL for numbers."""
    return hasattr(x, "_ufl_is_terminal_")


def _unary(name: str, number: Any) -> Any:
    def function(x: Any) -> Any:
        if is_symbolic(x):
            import ufl

            return getattr(ufl, name)(x)
        return number(x)

    function.__name__ = name
    function.__doc__ = f"{name} of a scalar."
    return function


ln = _unary("ln", np.log)
exp = _unary("exp", np.exp)
sqrt = _unary("sqrt", np.sqrt)
sin = _unary("sin", np.sin)
cos = _unary("cos", np.cos)
tanh = _unary("tanh", np.tanh)


def tr(a: Any) -> Any:
    """Trace."""
    if is_symbolic(a):
        import ufl

        return ufl.tr(a)
    return np.float64(np.trace(a))


def det(a: Any) -> Any:
    """Determinant."""
    if is_symbolic(a):
        import ufl

        return ufl.det(a)
    return np.float64(np.linalg.det(a))


def inner(a: Any, b: Any) -> Any:
    """Double contraction a:b of tensors, dot product of vectors."""
    if is_symbolic(a) or is_symbolic(b):
        import ufl

        return ufl.inner(a, b)
    return np.float64(np.sum(np.asarray(a) * np.asarray(b)))


def dot(a: Any, b: Any) -> Any:
    """Contraction over one index."""
    if is_symbolic(a) or is_symbolic(b):
        import ufl

        return ufl.dot(a, b)
    return np.dot(a, b)


def transpose(a: Any) -> Any:
    """Transpose."""
    return a.T


def sym(a: Any) -> Any:
    """Symmetric part."""
    return 0.5 * (a + a.T)


def positive(x: Any) -> Any:
    """max(x, 0): the part of a fibre's strain that is tension."""
    if is_symbolic(x):
        import ufl

        return ufl.conditional(ufl.gt(x, 0.0), x, 0.0)
    return max(float(x), 0.0)


def choose(test: Any, a: Any, b: Any) -> Any:
    """``a`` where ``test`` > 0, otherwise ``b``."""
    if is_symbolic(test):
        import ufl

        return ufl.conditional(ufl.gt(test, 0.0), a, b)
    return a if test > 0 else b


def Ei(x: Any) -> Any:
    """Exponential integral of x > 0."""
    if is_symbolic(x):
        from .functions import ExponentialIntegral

        return ExponentialIntegral(x)
    return _exponential_integral(float(x))


def _exponential_integral(x: float) -> np.float64:
    """As `functions.IN_C` computes it, where the method is told; NaN below zero."""
    if x > 40.0:
        terms = np.cumprod(np.append(1.0, np.arange(1, 41) / x))
        return np.float64(np.exp(x) / x * terms.sum())
    root, tail = 0.3725074107813666, 1.3140183414386028e-17
    d = (x - root) - tail
    near = abs(d) < 0.5 * root
    total = np.log1p(d / root) if near else np.log(np.float64(x) / root)
    power, difference, factorial = 1.0, d, 1.0
    for n in range(1, 151):
        factorial *= n
        total += difference / (n * factorial)
        power *= root
        difference = x * difference + power * d
    return np.float64(total)


def cross(a: Any, b: Any) -> Any:
    """Vector product."""
    if is_symbolic(a) or is_symbolic(b):
        import ufl

        return ufl.cross(a, b)
    return np.cross(a, b).view(Tensor)


def axes(f: Any, s: Any) -> tuple[Any, Any, Any]:
    """Orthonormal axes (f, s', f × s'): s' is the part of ``s`` across the unit vector ``f``."""
    across = s - dot(f, s) * f
    across = across / sqrt(dot(across, across))
    return f, across, cross(f, across)


def identity() -> Any:
    """The unit tensor (3, 3)."""
    return np.eye(3).view(Tensor)
