"""Least squares from several starts, within the parameters' bounds."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from .. import parameters
from ..errors import ConvergenceError, InputError
from .data import Series
from .fit_model import Model
from .points import PointLaw

if TYPE_CHECKING:
    from ..kernels.law import Law, Parameter

Floats = npt.NDArray[np.float64]

WEIGHTS = ("absolute", "relative")
_SMALLEST = 0.01  # of a series' largest stress: what a relative residual is divided by at least
_SAME = 1e-4  # costs this close count as one optimum


@dataclass
class Problem:
    """Residuals of the free parameters; ``weight`` (n,) multiplies stresses in Pa."""

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
class Optimum:
    """Where the best search ended; ``residual`` and ``jacobian`` are weighted."""

    theta: Floats
    residual: Floats
    jacobian: Floats
    at_bound: npt.NDArray[np.bool_]
    agreeing: tuple[int, int]
    predicted: Floats
    states: list[Floats]  # F of each series


def problem(
    law: Law, series: list[Series], fixed: dict[str, Any], start: dict[str, Any], weights: str
) -> Problem:
    """The problem posed: what is free, where the search begins, how residuals count.

    Raises:
        MaterialError: unknown parameter, value out of bounds.
        InputError: nothing free, or too little data for what is free.
    """
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
    posed = Problem(point, free, series, values, _weights(series, weights))
    if not start:
        posed = Problem(point, free, series, _scaled(posed, values), posed.weight)
    return posed


def _weights(series: list[Series], weights: str) -> Floats:
    parts = []
    for s in series:
        size = np.abs(s.stress)
        least = _SMALLEST * size.max() or 1.0
        parts.append(s.weight / np.maximum(size, least) if weights == "relative" else s.weight)
    return np.concatenate(parts)


def _scaled(problem: Problem, values: Floats) -> Floats:
    """Moduli times the factor that brings the stress nearest to the data: ψ is linear in them."""
    predicted = problem.weight * problem.model().predict(values)
    wanted = problem.weight * problem.stress
    if not np.isfinite(predicted).all():
        return values
    factor = predicted @ wanted / max(predicted @ predicted, np.finfo(float).tiny)
    modulus = np.array([p.unit == "Pa" for p in problem.free])
    if not 1e-12 < factor < 1e12 or not modulus.any():
        return values
    scaled: Floats = np.where(modulus, factor * values, values)
    return scaled.clip(problem.low, problem.high)


def _ends(p: Parameter, size: float) -> tuple[float, float]:
    """Ends of the search, a little inside of open bounds."""
    low, high = p.kind.minimum, p.kind.maximum
    span = high - low if np.isfinite(high - low) else size
    inside = 1e-9 * span if p.kind.open else 0.0
    return low + inside, high - inside


def search(problem: Problem, starts: int, rng: np.random.Generator) -> Optimum:
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
    return Optimum(theta, residual, jacobian, bound, agreeing, predicted, states)


def _descend(problem: Problem, place: Floats) -> Any:
    """SciPy's result in units of ``problem.size``; None where the law has no state to begin at."""
    from scipy.optimize import least_squares

    model, size = problem.model(), problem.size
    if not np.isfinite(model.predict(place)).all():
        return None

    def residual(z: Floats) -> Floats:
        left: Floats = problem.weight * (model.predict(z * size) - problem.stress)
        return left

    def jacobian(z: Floats) -> Floats:
        theta = z * size
        found = model.jacobian(theta, problem.room(theta))
        slopes: Floats = problem.weight[:, None] * found * size
        return slopes

    ends = (problem.low / size, problem.high / size)
    inside = np.clip(place / size, *ends)
    return least_squares(
        residual, inside, jacobian, bounds=ends, x_scale="jac",
        ftol=1e-12, xtol=1e-12, gtol=1e-14, max_nfev=300,
    )  # fmt: skip


def _elsewhere(problem: Problem, rng: np.random.Generator) -> Floats:
    """A random place: moduli within a decade, other numbers around their start."""
    place = []
    for p, value, size in zip(problem.free, problem.start, problem.size, strict=True):
        if p.unit == "Pa":
            place.append(value * 10 ** rng.uniform(-1, 1))
        elif np.isfinite(p.kind.maximum - p.kind.minimum):
            place.append(rng.uniform(max(p.kind.minimum, 0.0), p.kind.maximum))
        else:
            place.append(value + 0.5 * size * rng.standard_normal())
    return np.array(place, dtype=float).clip(problem.low, problem.high)
