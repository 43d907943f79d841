"""How far each way to a rest shape goes, and what it costs: inverse solve against fixed points.

    bodies → largest gravity that each method can take off → race at loads that all take → table

The mesh is the loaded shape; gravity grows until a method fails, and bisection finds where. It
succeeds if a forward solve from its rest shape has a stable equilibrium at the loaded shape, every
node within 1e-9 of the size. A method may spend 300 Newton iterations; the inverse solve takes
about ten. Races are cold, in turn, best of three, to 1e-11 of the size.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from ..body import Body
from ..errors import ConvergenceError
from ..mesh import Mesh
from ..rest_check import reversed_gravity_error, round_trip
from ..state import Rest
from . import published_meshes

#: Newton iterations after which a method has failed.
BUDGET = 300
#: Factor between loads on the way up, and bisections after it: limits are within 4.3 %.
GROWTH, BISECTIONS = 1.4, 3
#: Loads of the race as shares of a limit: the least of all methods, and the least of Anderson's.
EASY, HARD = 0.8, 0.95
#: Multiple of gravity at which the way up ends.
LARGEST = 100.0
RACE_TOLERANCE, RACE_RTOL, ACCEPTED, REPEATS = 1e-11, 1e-12, 1e-9, 3

#: What `Body.rest_shape` is given, by name.
METHODS: dict[str, dict[str, Any]] = {
    "inverse": {},
    "sellier": {"method": "sellier"},
    "aitken": {"method": "sellier-aitken"},
    "anderson": {"method": "sellier-anderson"},
    "anderson, half steps": {"method": "sellier-anderson", "relaxation": 0.5, "depth": 20},
}
#: Of the race: forward solves exact, and each from zero as in Sellier's own algorithm.
RACERS = METHODS | {
    "anderson, exact solves": {"method": "sellier-anderson", "exact": True},
    "anderson, exact from zero": {"method": "sellier-anderson", "exact": True, "warm": False},
}


@dataclass(frozen=True)
class Case:
    """A body under a multiple of gravity, as loaded; ``start`` is a multiple that all can take."""

    name: str
    make: Callable[[float], Body]
    start: float = 0.2


@dataclass(frozen=True)
class Attempt:
    """One rest shape, or why there is none."""

    seconds: float
    rest: Rest | None
    why: str = ""


@dataclass(frozen=True)
class Limit:
    """Largest multiple of gravity that succeeded, the least above it that failed, and why."""

    method: str
    good: float
    bad: float
    why: str


@dataclass(frozen=True)
class Racer:
    """A method at a common load; ``seconds`` the best of all repeats, NaN where it failed."""

    method: str
    load: str
    factor: float
    seconds: float
    solves: int
    iterations: int
    miss: float


@dataclass
class Outcome:
    """All about one body."""

    case: str
    limits: list[Limit]
    racers: list[Racer]
    reversed_gravity: dict[str, float] = field(default_factory=dict)  # by load

    def limit(self, method: str) -> float:
        return next(found.good for found in self.limits if found.method == method)

    def ratio(self, method: str, load: str) -> float:
        """Seconds over those of the inverse; NaN where one has failed."""
        seconds = {r.method: r.seconds for r in self.racers if r.load == load}
        return seconds.get(method, np.nan) / seconds.get("inverse", np.nan)


def block(factor: float) -> Body:
    """The unit cube of Mazier 2022, 3.3.2, mixed P2–P1, but held at its side, so that it sags.

    On its base, as there, it buckles at 2.5 g before a method fails, and all limits are the same.
    """
    mesh = Mesh.box((3, 3, 3), (1.0, 1.0, 1.0), "P2")
    body = Body(mesh, "neo_hookean_isochoric", "mixed", density=1e3, mu=2e4, bulk=8e5)
    return body.fix(lambda x: x[:, 0] < 1e-9).gravity((0.0, -9.81 * factor, 0.0))


def beam(factor: float) -> Body:
    """The PDMS beam of Mazier 2022, 3.5, with a square section: mixed P2–P1, 12 blocks."""
    mesh = Mesh.box((12, 1, 1), (0.182, 0.0085, 0.0085), "P2")
    body = Body(
        mesh, "mooney_rivlin", "mixed", density=965.0, c1=101709.668, c2=151065.46, bulk=1.593e9
    )
    return body.fix(lambda x: x[:, 0] < 1e-9).gravity((0.0, -9.81 * factor, 0.0))


def round_beam(mesh: Mesh, factor: float) -> Body:
    """Beam2k.msh itself with linear tetrahedra, which are too stiff in bending; E = 6 (c1 + c2)."""
    body = Body(mesh, "neo_hookean", density=965.0, young=1.517e6, poisson=0.3)
    return body.fix(lambda x: x[:, 0] < 1e-9).gravity((0.0, -9.81 * factor, 0.0))


def liver(mesh: Mesh, factor: float) -> Body:
    """SOFA's liver, 19 cm wide, hanging on its uppermost 15 mm."""
    body = Body(mesh, "neo_hookean", density=1e3, young=5e3, poisson=0.45)
    top = mesh.points[:, 1].max() - 0.015
    return body.fix(lambda x: x[:, 1] > top).gravity((0.0, -9.81 * factor, 0.0))


def cases(data: Path | None) -> list[Case]:
    """Block and beam; with a folder of `published_meshes` also the round beam and the liver."""
    found = [Case("block", block), Case("beam", beam)]
    if data is None:
        return found
    pdms, organ = published_meshes.beam2k(data), published_meshes.liver(data)
    return [
        *found,
        Case("Beam2k.msh", lambda factor: round_beam(pdms, factor)),
        Case("liver", lambda factor: liver(organ, factor)),
    ]


class _Spent(Exception):
    """The budget of Newton iterations is used up."""


def attempt(body: Body, **how: Any) -> Attempt:
    """One rest shape within the budget."""
    spent = 0

    def count(row: dict[str, float]) -> None:
        nonlocal spent
        spent += row["iteration"] > 0
        if spent > BUDGET:
            raise _Spent

    if "method" in how:
        how = {"max_solves": BUDGET, **how}
    begin = time.perf_counter()
    try:
        rest = body.rest_shape(progress=count, **how)
    except _Spent:
        return Attempt(time.perf_counter() - begin, None, f"{BUDGET} Newton iterations are spent")
    except ConvergenceError as failure:
        return Attempt(time.perf_counter() - begin, None, failure.cause)
    return Attempt(time.perf_counter() - begin, rest)


def judged(tried: Attempt) -> Attempt:
    """The same, but no rest shape if the loaded shape is no stable equilibrium of it."""
    if tried.rest is None:
        return tried
    try:
        miss = round_trip(tried.rest, near=True).relative
    except ConvergenceError as failure:
        return Attempt(tried.seconds, None, f"found, but loaded again: {failure.cause}")
    why = f"found, but loaded again it misses by {miss:.1e}"
    return tried if miss <= ACCEPTED else Attempt(tried.seconds, None, why)


def limit(case: Case, method: str, progress: Callable[[str], None]) -> Limit:
    """Up in steps until the method fails, then bisection between the last two loads."""

    def reaches(factor: float) -> str | None:
        progress(f"{case.name}: {method} at {factor:.3g} g")
        found = judged(attempt(case.make(factor), **METHODS[method]))
        return None if found.rest is not None else found.why

    good, bad = 0.0, case.start
    while (why := reaches(bad)) is None:
        good, bad = bad, GROWTH * bad
        if bad > LARGEST:
            return Limit(method, good, np.inf, "none up to there")
    for _ in range(BISECTIONS):
        middle = float(np.sqrt(good * bad)) if good else 0.5 * bad
        found = reaches(middle)
        if found is None:
            good = middle
        else:
            bad, why = middle, found
    return Limit(method, good, bad, why)


def race(case: Case, load: str, factor: float, progress: Callable[[str], None]) -> list[Racer]:
    """All racers in turn, several times, each on a fresh body."""
    tries: dict[str, list[Attempt]] = {name: [] for name in RACERS}
    for _ in range(REPEATS):
        for name, how in RACERS.items():
            progress(f"{case.name}: race of {name} at {factor:.3g} g")
            finer = {"tolerance": RACE_TOLERANCE} if how else {}
            if not tries[name] or tries[name][-1].rest is not None:
                tries[name].append(attempt(case.make(factor), rtol=RACE_RTOL, **how, **finer))
    return [_racer(name, load, factor, tried) for name, tried in tries.items()]


def _racer(name: str, load: str, factor: float, tried: list[Attempt]) -> Racer:
    rest = tried[0].rest
    if rest is None:
        return Racer(name, load, factor, float("nan"), 0, 0, float("nan"))
    seconds = min(one.seconds for one in tried)
    miss = round_trip(rest, near=True, rtol=RACE_RTOL).relative
    return Racer(name, load, factor, seconds, rest.solves, rest.iterations, miss)


def run(case: Case, progress: Callable[[str], None] = lambda _: None) -> Outcome:
    """Limits, then races at a load that every method takes and at one near Anderson's limit."""
    outcome = Outcome(case.name, [limit(case, name, progress) for name in METHODS], [])
    plain = min(found.good for found in outcome.limits)
    hard = HARD * min(outcome.limit(name) for name in METHODS if name.startswith("anderson"))
    for load, factor in (("easy", EASY * plain), ("hard", hard)):
        outcome.racers += race(case, load, factor, progress)
        outcome.reversed_gravity[load] = reversed_gravity_error(case.make(factor).rest_shape())
    return outcome
