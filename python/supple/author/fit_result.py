"""A fit and how far it can be trusted: intervals, correlations, warnings.

Source: Seber and Wild (1989), Nonlinear Regression, §2.1–2.2: linearised at the optimum.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from ..errors import ConvergenceError
from .data import Series

Floats = npt.NDArray[np.float64]

_NO_EFFECT = 1e-8  # of a parameter's whole size on the stress, over the stress
_DEPENDENT = 1e-6  # least over largest singular value of the Jacobian with unit columns
_CORRELATED = 0.99


@dataclass(frozen=True)
class Fitted:
    """One parameter.

    Attributes:
        name, unit, value: in SI.
        sd: standard error; None where it was fixed or lies at a bound.
        interval: of 95 % by Student's t; None with ``sd``.
        state: "free", "fixed" or "at bound".
    """

    name: str
    unit: str
    value: Any
    sd: float | None
    interval: tuple[float, float] | None
    state: str


@dataclass(frozen=True, eq=False)
class Fit:
    """Parameters fitted to tests.

    Attributes:
        material: the energy as it was named.
        parameters: all of the law's, in its order.
        series: the measurements.
        predicted: the fitted law's stress at each of them, Pa.
        r_squared: over all series, each about its own mean, unweighted.
        r_squared_of: the same of each series.
        standard_error: √(Σr²/(n − p)) of the residuals minimised: Pa, or 1 where ``weights`` is
            "relative".
        correlation: (p, p) of the free parameters that are not at a bound.
        free: their names.
        weights: "absolute" or "relative".
        starts: how many starts were tried, and how many ended at this optimum.
        warnings: one sentence each.
    """

    material: str
    parameters: list[Fitted]
    series: list[Series]
    predicted: list[Floats]
    r_squared: float
    r_squared_of: list[float]
    standard_error: float
    correlation: Floats
    free: list[str]
    weights: str
    starts: tuple[int, int]
    warnings: list[str]

    @property
    def values(self) -> dict[str, Any]:
        """Name → value, ready for `supple.Body`."""
        return {p.name: p.value for p in self.parameters}

    @property
    def line(self) -> str:
        """The Python line that makes a body of it."""
        given = ", ".join(f"{name}={_literal(v)}" for name, v in self.values.items())
        return f"body = supple.Body(mesh, {self.material!r}, {given})"


def _literal(value: Any) -> str:
    return f"{value:.6g}" if np.ndim(value) == 0 else repr(tuple(float(v) for v in value))


def covariance(jacobian: Floats, residual: Floats, names: list[str], size: Floats) -> Floats:
    """Covariance (p, p) of the parameters at the optimum.

    Args:
        jacobian: (n, p) of the weighted residuals.
        residual: (n,) weighted.
        names: of the parameters.
        size: (p,) their typical magnitudes.

    Raises:
        ConvergenceError: the data cannot tell the parameters apart, with their names.
    """
    scaled = jacobian * size
    length = np.linalg.norm(scaled, axis=0)
    for name, effect in zip(names, length, strict=True):
        if effect <= _NO_EFFECT * length.max(initial=np.finfo(float).tiny):
            raise _unidentified(f"{name} has no effect in these tests", name)
    unit = scaled / length
    singular, right = np.linalg.svd(unit, full_matrices=False)[1:]
    if singular[-1] <= _DEPENDENT * singular[0]:
        mixed = [n for n, v in zip(names, right[-1], strict=True) if abs(v) > 0.05]
        words = " and ".join(mixed)
        raise _unidentified(f"{words} cannot be told apart by these tests", mixed[-1])
    inverse = (right.T / singular**2) @ right
    spread = size / length
    variance = residual @ residual / (len(residual) - len(names))
    found: Floats = variance * inverse * np.outer(spread, spread)
    return found


def _unidentified(what: str, name: str) -> ConvergenceError:
    return ConvergenceError(
        f"the parameters are not determined: {what}; fix one (--fix {name}=VALUE), "
        "or add data of another test.",
        cause="not identifiable",
    )


def correlation(cov: Floats) -> Floats:
    """Correlations (p, p) of a covariance."""
    sd = np.sqrt(np.diag(cov))
    safe = np.where(sd > 0, sd, 1.0)  # a perfect fit has none
    found: Floats = cov / np.outer(safe, safe)
    return found


def doubts(free: list[Fitted], matrix: Floats) -> list[str]:
    """Sentences on parameters that the data hardly determines."""
    said = []
    for i, j in zip(*np.triu_indices(len(free), 1), strict=True):
        if abs(matrix[i, j]) > _CORRELATED:
            said.append(
                f"{free[i].name} and {free[j].name} have a correlation of {matrix[i, j]:.4f}: "
                "the data determines one combination of them much better than each."
            )
    for p in free:
        assert p.interval is not None
        if p.interval[0] <= 0.0 <= p.interval[1] and p.value != 0.0:
            said.append(
                f"the 95 % interval of {p.name} holds 0: the data hardly determines it; "
                f"fix it (--fix {p.name}=VALUE), or add data of another test."
            )
    return said


def r_squared(series: list[Series], predicted: list[Floats]) -> tuple[float, list[float]]:
    """Of all series together, each about its own mean, and of each alone."""
    missed = [float(((s.stress - p) ** 2).sum()) for s, p in zip(series, predicted, strict=True)]
    spread = [float(((s.stress - s.stress.mean()) ** 2).sum()) for s in series]
    each = [_ratio(m, t) for m, t in zip(missed, spread, strict=True)]
    return _ratio(sum(missed), sum(spread)), each


def _ratio(missed: float, spread: float) -> float:
    return 1.0 - missed / spread if spread > 0 else float("nan")
