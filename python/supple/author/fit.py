"""A law's parameters from tests, by least squares within their bounds.

    data ─► starts ─► least squares from each ─► the best ─► intervals, correlations, warnings

Source: Seber and Wild (1989), Nonlinear Regression, ch. 2 and 14.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from ..errors import InputError
from ..laws import read_law
from . import data as measurements
from . import fit_result, fit_search
from .data import Data, Series
from .ellipticity import least_wave_stiffness
from .fit_result import Fit, Fitted
from .fit_search import WEIGHTS, Optimum, Problem

Floats = npt.NDArray[np.float64]


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
    problem = fit_search.problem(law, series, dict(fixed or {}), dict(start or {}), weights)
    found = fit_search.search(problem, starts, np.random.default_rng(seed))
    return _described(problem, found, str(material), weights)


def _described(problem: Problem, found: Optimum, material: str, weights: str) -> Fit:
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


def _fitted(problem: Problem, found: Optimum, sd: Floats, freedom: int) -> list[Fitted]:
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


def _unstable(problem: Problem, found: Optimum) -> list[str]:
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
