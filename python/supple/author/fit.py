"""A law's parameters from tests, by least squares within their bounds.

    data ─► starts ─► least squares from each ─► the best ─► intervals, correlations, warnings
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from .. import parameters
from ..errors import ConvergenceError, InputError
from ..laws import read_law
from . import data as measurements
from . import fit_result
from .data import Data, Series
from .ellipticity import least_wave_stiffness
from .fit_model import Model
from .fit_result import Fit, Fitted
from .points import PointLaw

if TYPE_CHECKING:
    from ..kernels.law import Law, Parameter

Floats = npt.NDArray[np.float64]

WEIGHTS = ("absolute", "relative")
_SMALLEST = 0.01  # of a series' largest stress: what a relative residual is divided by at least
_SAME = 1e-4  # costs this close count as one optimum


def fit(
    material: str | Path,
    data: Data | Sequence[Series],
    fixed: Mapping[str, Any] | None = None,
    start: Mapping[str, float] | None = None,
    weights: str = "absolute",
    starts: int = 5,
    seed: int = 0,
) -> Fit:
    """Fit a law to tests.

    Args:
        material: name of a shipped energy, or path of an energy file.
        data: a CSV file; or test → CSV file, or → (values (n,), nominal stress (n,) Pa). The
            fibres of an anisotropic law are in the test's frame: x along the load.
        fixed: parameters that keep a value; directions always do.
        start: where the search begins; else at the law's defaults, with moduli scaled to the data.
        weights: of residuals: "absolute", in Pa, or "relative", over the stress or a hundredth of
            its series' largest.
        starts: searches, the first from ``start``, the others from random places.
        seed: of those.

    Raises:
        MaterialError: unknown law or parameter, value out of bounds.
        InputError: data that cannot be read or is too little, unknown weights.
        ConvergenceError: no optimum, or the data does not determine the parameters.

    Source: Branch, Coleman and Li (1999), SIAM J. Sci. Comput. 21: SciPy's "trf".
    """
    if weights not in WEIGHTS:
        raise InputError(f"weights must be one of {WEIGHTS}, got {weights!r}.")
    if starts < 1:
        raise InputError(f"starts must be at least 1, got {starts}.")
    law, series = read_law(material), measurements.read(data)
    problem = _problem(law, series, dict(fixed or {}), dict(start or {}), weights)
    found = _search(problem, starts, np.random.default_rng(seed))
    return _described(problem, found, str(material), weights)


@dataclass
class _Problem:
    """Residuals of the free parameters; ``weight`` (n,) multiplies stresses."""

    law: PointLaw
    free: list[Parameter]
    series: list[Series]
    start: Floats
    weight: Floats

    def __post_init__(self) -> None:
        self.names = [p.name for p in self.free]
        self.stress = np.concatenate([s.stress for s in self.series])
        self.size = np.where(self.start != 0, np.abs(self.start), 1.0)
        ends = [_ends(p, s) for p, s in zip(self.free, self.size, strict=True)]
        self.low, self.high = np.array(ends).T

    def model(self) -> Model:
        return Model(self.law, self.series, self.names)

    def room(self, theta: Floats) -> Floats:
        """Distance of each parameter to the nearest end of its admissible range."""
        low = np.array([p.kind.minimum for p in self.free])
        high = np.array([p.kind.maximum for p in self.free])
        away = np.minimum(theta - low, high - theta)
        closed = np.array([not p.kind.open for p in self.free])
        return np.where(closed, np.inf, away)


@dataclass
class _Optimum:
    theta: Floats
    residual: Floats
    jacobian: Floats
    at_bound: npt.NDArray[np.bool_]
    agreeing: tuple[int, int]
    predicted: Floats
    states: list[Floats]  # F of each series


def _problem(
    law: Law, series: list[Series], fixed: dict[str, Any], start: dict[str, Any], weights: str
) -> _Problem:
    both = [name for name in start if name in fixed]
    if both:
        raise InputError(f"{both[0]} is both fixed and given a start; give one of them.")
    free = [p for p in law.parameters if p.kind.size == 1 and p.name not in fixed]
    point = PointLaw(law, **fixed)
    parameters.given(law, start, 1)
    count = sum(np.count_nonzero(s.weight) for s in series)
    if not free:
        raise InputError("every parameter is fixed; leave one free.")
    if count <= len(free):
        raise InputError(
            f"{len(free)} free parameters ({', '.join(p.name for p in free)}) need more than "
            f"{len(free)} measurements, got {count}; fix some, or add data."
        )
    values = np.array([float(start.get(p.name, p.default)) for p in free])
    problem = _Problem(point, free, series, values, _weights(series, weights))
    if not start:
        problem = _Problem(point, free, series, _scaled(problem, values), problem.weight)
    return problem


def _weights(series: list[Series], weights: str) -> Floats:
    parts = []
    for s in series:
        size = np.abs(s.stress)
        least = _SMALLEST * size.max() or 1.0
        parts.append(s.weight / np.maximum(size, least) if weights == "relative" else s.weight)
    return np.concatenate(parts)


def _scaled(problem: _Problem, values: Floats) -> Floats:
    """Moduli times the factor that brings the stress nearest to the data: ψ is linear in them."""
    predicted = problem.weight * problem.model().predict(values)
    wanted = problem.weight * problem.stress
    if not np.isfinite(predicted).all():
        return values
    factor = predicted @ wanted / max(predicted @ predicted, np.finfo(float).tiny)
    modulus = np.array([p.unit == "Pa" for p in problem.free])
    if not 1e-12 < factor < 1e12 or not modulus.any():
        return values
    return np.clip(np.where(modulus, factor * values, values), problem.low, problem.high)


def _ends(p: Parameter, size: float) -> tuple[float, float]:
    """Ends of the search, a little inside of open bounds."""
    low, high = p.kind.minimum, p.kind.maximum
    span = high - low if np.isfinite(high - low) else size
    inside = 1e-9 * span if p.kind.open else 0.0
    return low + inside, high - inside


def _search(problem: _Problem, starts: int, rng: np.random.Generator) -> _Optimum:
    """The best of several searches.

    Raises:
        InputError: the law has no state at the data with any start.
        ConvergenceError: no search ended.
    """
    places = [problem.start] + [_elsewhere(problem, rng) for _ in range(starts - 1)]
    tried = [r for place in places if (r := _descend(problem, place)) is not None]
    if not tried:
        raise InputError(
            f"{problem.law.law.name} has no state at all the data's deformations with these "
            "parameters; give others to begin with (--start NAME=VALUE), or leave data out."
        )
    best = min(tried, key=lambda r: r.cost)
    if best.status <= 0:
        raise ConvergenceError(
            f"the least squares did not end within {best.nfev} evaluations; "
            "begin nearer (--start NAME=VALUE), or fix a parameter.",
            cause="too many evaluations",
        )
    same = sum(r.cost <= best.cost * (1 + _SAME) + 1e-30 for r in tried)
    theta = best.x * problem.size
    model = problem.model()
    jacobian = problem.weight[:, None] * model.jacobian(theta, problem.room(theta))
    predicted = model.predict(theta)
    residual = problem.weight * (predicted - problem.stress)
    states = [F for F in model.states if F is not None]
    bound = np.array(best.active_mask) != 0
    bound |= (theta - problem.low < 1e-6 * problem.size) | (
        problem.high - theta < 1e-6 * problem.size
    )
    agreeing = (len(places), int(same))
    return _Optimum(theta, residual, jacobian, bound, agreeing, predicted, states)


def _descend(problem: _Problem, place: Floats) -> Any:
    """SciPy's result in units of ``problem.size``; None where the law has no state to begin at."""
    from scipy.optimize import least_squares

    model, size = problem.model(), problem.size
    if not np.isfinite(model.predict(place)).all():
        return None

    def residual(z: Floats) -> Floats:
        return problem.weight * (model.predict(z * size) - problem.stress)

    def jacobian(z: Floats) -> Floats:
        theta = z * size
        found = model.jacobian(theta, problem.room(theta))
        return problem.weight[:, None] * found * size

    ends = (problem.low / size, problem.high / size)
    inside = np.clip(place / size, *ends)
    return least_squares(
        residual, inside, jacobian, bounds=ends, x_scale="jac",
        ftol=1e-12, xtol=1e-12, gtol=1e-14, max_nfev=300,
    )  # fmt: skip


def _elsewhere(problem: _Problem, rng: np.random.Generator) -> Floats:
    """A random place: moduli within a decade, other numbers around their start."""
    place = []
    for p, value, size in zip(problem.free, problem.start, problem.size, strict=True):
        if p.unit == "Pa":
            place.append(value * 10 ** rng.uniform(-1, 1))
        elif np.isfinite(p.kind.maximum - p.kind.minimum):
            place.append(rng.uniform(max(p.kind.minimum, 0.0), p.kind.maximum))
        else:
            place.append(value + 0.5 * size * rng.standard_normal())
    return np.clip(place, problem.low, problem.high)


def _described(problem: _Problem, found: _Optimum, material: str, weights: str) -> Fit:
    inner = ~found.at_bound
    names = [n for n, i in zip(problem.names, inner, strict=True) if i]
    size = np.where(found.theta != 0, np.abs(found.theta), problem.size)[inner]
    counted = problem.weight > 0
    jacobian, residual = found.jacobian[counted][:, inner], found.residual[counted]
    cov = fit_result.covariance(jacobian, residual, names, size)
    fitted = _fitted(problem, found, np.sqrt(np.diag(cov)), len(residual) - len(names))
    free = [p for p in fitted if p.state == "free"]
    matrix = fit_result.correlation(cov)
    ends = np.cumsum([len(s.values) for s in problem.series])[:-1]
    predicted = np.split(found.predicted, ends)
    overall, each = fit_result.r_squared(problem.series, predicted)
    said = [f"{p.name} ended at its bound, {p.value:.6g}{_unit(p)}." for p in fitted
            if p.state == "at bound"]  # fmt: skip
    said += fit_result.doubts(free, matrix) + _unstable(problem, found)
    error = float(np.sqrt(residual @ residual / (len(residual) - len(names))))
    return Fit(material, fitted, problem.series, predicted, overall, each, error, matrix, names,
               weights, found.agreeing, said)  # fmt: skip


def _fitted(problem: _Problem, found: _Optimum, sd: Floats, freedom: int) -> list[Fitted]:
    from scipy.stats import t

    reach = float(t.ppf(0.975, freedom))
    values = dict(zip(problem.names, found.theta.tolist(), strict=True))
    bound = {n for n, b in zip(problem.names, found.at_bound, strict=True) if b}
    errors = iter(sd.tolist())
    fitted = []
    for p in problem.law.law.parameters:
        if p.name not in values or p.name in bound:
            value = values.get(p.name, problem.law.values[p.name])
            state = "at bound" if p.name in bound else "fixed"
            fitted.append(Fitted(p.name, p.unit, value, None, None, state))
        else:
            value, error = values[p.name], next(errors)
            interval = (value - reach * error, value + reach * error)
            fitted.append(Fitted(p.name, p.unit, value, error, interval, "free"))
    return fitted


def _unstable(problem: _Problem, found: _Optimum) -> list[str]:
    """A warning for each test whose deformations the fitted law is not elliptic at, or rest."""
    said = []
    for series, F in zip(problem.series, found.states, strict=True):
        A = problem.law.tangent(np.concatenate([np.eye(3)[None], F]))
        least = least_wave_stiffness(A)
        if (least <= 1e-9 * np.abs(A[0]).max()).any():
            said.append(f"the fitted law is not elliptic within the {series.mode.title} data: "
                        "a body of it may buckle without cause.")  # fmt: skip
    return said


def _unit(p: Fitted) -> str:
    return "" if p.unit == "1" else f" {p.unit}"
