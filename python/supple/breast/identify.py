"""Stiffness of breast and skin from a supine scan: CMA-ES on the skin's mean absolute error.

    parameters ─► rest shape ─► supine shape ─► distance scan → skin ─► next parameters

The search runs on the parameters' logarithms, scaled by their start values. Where a rest shape does
not exist the cost is a barrier. Mazier 2022, §5.4; Hansen (2016), arXiv:1604.00772.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from supple.breast.model import Materials, build_body, set_materials
from supple.breast.poses import IMPATIENCE, Poses, solve_poses
from supple.breast.skin_misfit import SkinMisfit, mean_absolute
from supple.errors import ConvergenceError, InputError
from supple.threads import available
from supple.workers import Workers

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from supple.breast.tetra import BreastMesh

    Floats = NDArray[np.float64]
    Evaluate = Callable[[list[Floats]], list["Trial"]]

METHODS = ("cma-es",)
#: Cost of parameters without a rest shape, m, and more the less of gravity was reached.
BARRIER = 0.1
#: Errors of the model are alike over this length of skin, m: it counts as one observation.
CORRELATION = 30e-3


@dataclass(frozen=True)
class IdentifySettings:
    """How parameters are searched.

    Attributes:
        parameters: full names, such as "breast.young".
        seed: of the search; the same seed gives the same answer.
        evaluations: at most so many pairs of rest and supine shapes.
        population: evaluations between two updates.
        spread: first standard deviation of the logarithms.
        bounds: of each parameter relative to its start value.
        resolution: costs nearer than this end the search, m.
        rtol: of the shapes while searching.
        workers: processes.
    """

    parameters: tuple[str, ...] = ("breast.young", "skin.young")
    method: str = "cma-es"
    seed: int = 1
    evaluations: int = 30
    population: int = 6
    spread: float = 0.3
    bounds: tuple[float, float] = (0.2, 10.0)
    resolution: float = 1e-5
    rtol: float = 1e-5
    workers: int = 2


@dataclass(frozen=True)
class Trial:
    """What one set of parameters gives: its cost in m, and the scan's signed distances if any."""

    x: Floats  #: (p,) logarithms relative to the start
    cost: float
    signed: Floats | None


@dataclass(frozen=True)
class Identified:
    """Parameters found, and how well they are known.

    Attributes:
        materials: with the best parameters.
        values: by full name, SI.
        sd: by full name, SI; None where the scan does not tell.
        sd_reason: how the sd were found, or why there are none.
        mae_mm: skin's mean absolute error there.
        trials: all evaluations, in order.
    """

    materials: Materials
    values: dict[str, float]
    sd: dict[str, float | None]
    sd_reason: str
    mae_mm: float
    trials: list[Trial]

    @property
    def failed(self) -> int:
        """How many trials had no rest or no supine shape."""
        return sum(trial.signed is None for trial in self.trials)


class Search:
    """The breast of one patient, ready to be given parameters again and again."""

    def __init__(
        self,
        mesh: BreastMesh,
        materials: Materials,
        support: str,
        misfit: SkinMisfit,
        settings: IdentifySettings,
    ) -> None:
        self._mesh, self._start, self._misfit = mesh, materials, misfit
        self._settings = settings
        self._body = build_body(mesh, materials, support)
        self._last: Poses | None = None

    def __call__(self, x: Floats) -> Trial:
        """Solve with the start's parameters times exp(x)."""
        materials = moved(self._start, self._settings.parameters, x)
        set_materials(self._body, materials, self._mesh.tissue)
        try:
            poses = solve_poses(
                self._body, self._last, rtol=self._settings.rtol, patience=IMPATIENCE
            )
        except ConvergenceError as error:
            return Trial(x, BARRIER * (2.0 - error.load_factor), None)
        self._last = poses
        signed = self._misfit.signed(poses.points["supine"])
        return Trial(x, mean_absolute(signed), signed)


def moved(start: Materials, names: tuple[str, ...], x: Floats) -> Materials:
    """The start's materials with the named parameters times exp(x)."""
    factors = np.exp(x)
    return start.given({n: start.of(n) * float(f) for n, f in zip(names, factors, strict=True)})


def identify(
    mesh: BreastMesh,
    materials: Materials,
    support: str,
    misfit: SkinMisfit,
    settings: IdentifySettings | None = None,
    watch: Callable[[float], None] | None = None,
) -> Identified:
    """Find the parameters with which the supine skin fits the scan best.

    Args:
        mesh: prone breasts.
        materials: where the search starts.
        support: as in `build_body`.
        misfit: the aligned scan on the model's skin.
        settings: names, seed, budget.
        watch: told the share of the budget that is used.

    Raises:
        InputError: unknown method or parameter.
        ConvergenceError: no trial had a rest and a supine shape.
    """
    s = settings or IdentifySettings()
    if s.method not in METHODS:
        raise InputError(f"method must be one of {', '.join(METHODS)}, got {s.method!r}.")
    for name in s.parameters:
        materials.of(name)
    with Workers(min(s.workers, available()), Search, mesh, materials, support, misfit, s) as pool:
        trials = _search(lambda xs: _evaluated(pool, xs), s, watch)
    return _conclude(trials, materials, s, _skin_area(mesh))


def _evaluated(pool: Workers, xs: list[Floats]) -> list[Trial]:
    trials = dict(pool.answers(xs))
    return [trials[number] for number in range(len(xs))]


def _search(
    evaluate: Evaluate, s: IdentifySettings, watch: Callable[[float], None] | None
) -> list[Trial]:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # cma tells that it cannot plot
        import cma

    low, high = np.log(s.bounds)
    options = {
        "bounds": [low, high], "seed": s.seed, "popsize": s.population, "verbose": -9,
        "maxfevals": s.evaluations, "tolfun": s.resolution, "tolx": 0.01,
    }  # fmt: skip
    count = len(s.parameters)
    search = cma.CMAEvolutionStrategy(np.zeros(count), s.spread, options)
    trials = evaluate([np.zeros(count)])
    while len(trials) + s.population <= s.evaluations + 1 and not search.stop():
        asked = search.ask()
        new = evaluate([np.asarray(x) for x in asked])
        search.tell(asked, [trial.cost for trial in new])
        trials += new
        if watch is not None:
            watch(min(1.0, len(trials) / s.evaluations))
    return trials


def _conclude(
    trials: list[Trial], materials: Materials, s: IdentifySettings, area: float
) -> Identified:
    best = min(trials, key=lambda trial: trial.cost)
    if best.signed is None:
        raise ConvergenceError(
            f"none of {len(trials)} sets of parameters has a rest and a supine shape; "
            "start from a stiffer breast.",
            cause="no rest shape in the whole search",
        )
    found = moved(materials, s.parameters, best.x)
    values = {name: found.of(name) for name in s.parameters}
    spread, reason = _spread(trials, best, area)
    sd = {n: None if np.isnan(d) else float(d * values[n])
          for n, d in zip(s.parameters, spread, strict=True)}  # fmt: skip
    return Identified(found, values, sd, reason, 1e3 * best.cost, trials)


def _spread(trials: list[Trial], best: Trial, area: float) -> tuple[Floats, str]:
    """Sd (p,) of the logarithms: each scan point's distance is fitted linearly over the trials.

    Covariance s² (JᵀJ)⁻¹, with as many independent observations as patches of skin of
    `CORRELATION` squared: the model's errors are far from independent point by point.
    """
    near = [t for t in trials if t.signed is not None and np.abs(t.x - best.x).max() < 0.7]
    count = len(best.x)
    unknown = np.full(count, np.nan)
    if len(near) < 2 * count + 3:
        return unknown, f"only {len(near)} trials near the best: too few for a spread"
    offsets = np.array([t.x - best.x for t in near])
    design = np.column_stack([np.ones(len(near)), offsets])
    fit = np.linalg.lstsq(design, np.array([t.signed for t in near]), rcond=None)[0]
    independent = area / CORRELATION**2
    slopes, misfit = fit[1:].T, fit[0]
    normal = slopes.T @ slopes / len(misfit)
    if independent <= count + 1 or np.linalg.cond(normal) > 1e6:
        return unknown, "the scan does not tell the parameters apart"
    covariance = np.mean(misfit**2) * np.linalg.inv(normal) / (independent - count)
    reason = f"local linear fit over {len(near)} trials, one observation a {1e3 * CORRELATION:.0f}"
    return np.sqrt(np.diag(covariance)), f"{reason} mm patch of skin"


def _skin_area(mesh: BreastMesh) -> float:
    """Area of the model's prone skin, m²."""
    a, b, c = (mesh.points[mesh.skin[:, i]] for i in range(3))
    return float(np.linalg.norm(np.cross(b - a, c - a), axis=1).sum() / 2)
