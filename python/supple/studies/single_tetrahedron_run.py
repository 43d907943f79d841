"""The single tetrahedra's rest shapes: one inverse solve each, and Sellier's fixed point beside it.

    loaded shape → rest shape by each method → distance to the drawn shape → tables

Sellier's method runs as in the thesis: each forward solve from zero and to the end.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from ..body import Body
from ..errors import ConvergenceError
from ..state import Rest
from .single_tetrahedron import DENSITY, GRAVITY, RTOL, Sample, loaded_shape

Floats = npt.NDArray[np.float64]

#: Methods by name: that of `Body.rest_shape`, and the largest miss of a node by the size.
METHODS: dict[str, tuple[str, float]] = {
    "inverse": ("inverse", 0.0),
    "sellier_1e-6": ("sellier", 1e-6),
    "sellier_same_accuracy": ("sellier", 1e-12),
    "anderson_same_accuracy": ("sellier-anderson", 1e-12),
}
#: Mean error, m, forward solves and time by the inverse's, of the thesis' Table 3.
THESIS = {
    "inverse": (4.49e-12, 1.0, 1.0),
    "sellier_1e-6": (2.12e-6, 4.7, 4.75),
    "sellier_same_accuracy": (2.28e-12, 11.2, 11.35),
}
#: Failures among its 153 in `MAX_SOLVES` iterations.
THESIS_FAILURES, MAX_SOLVES = 7, 50
#: The average error that the inverse solve may have, m.
BAR = 1e-12


@dataclass(frozen=True)
class Found:
    """What a method gave: mean distance of the nodes, m (NaN: failed), solves, cost."""

    error: float
    solves: int
    iterations: int
    cpu_seconds: float
    reason: str = ""


@dataclass(frozen=True)
class Result:
    """A sample, its loaded shape's largest stretch and J, the apex's way by h, each method."""

    sample: Sample
    stretch: float
    volume_ratio: float
    moved: float
    found: dict[str, Found]


def run(
    samples: Sequence[Sample], progress: Callable[[float], None] | None = None
) -> Iterator[Result]:
    """Each sample by each method, one after the other."""
    for number, sample in enumerate(samples):
        if progress:
            progress(number / len(samples))
        yield _one(sample)


def _one(sample: Sample) -> Result:
    body = sample.body()
    state = loaded_shape(body)
    given = body.on(body.mesh.moved(state.points))
    found = {name: _timed(name, given, body.mesh.points) for name in METHODS}
    F = state.deformation_gradient()[0]
    stretch = float(np.linalg.svd(F, compute_uv=False).max())
    moved = float(np.linalg.norm(state.u[3])) / sample.tetrahedron.height
    return Result(sample, stretch, float(np.linalg.det(F)), moved, found)


def _timed(name: str, given: Body, points: Floats) -> Found:
    method, tolerance = METHODS[name]
    options: dict[str, Any] = {"method": method, "rtol": RTOL}
    if method != "inverse":
        options |= {"tolerance": tolerance, "max_solves": MAX_SOLVES, "warm": False, "exact": True}
    fresh = given.on(given.mesh)
    begin = time.process_time()
    try:
        rest = fresh.rest_shape(**options)
    except ConvergenceError as failure:
        spent, iterations = time.process_time() - begin, len(failure.history)
        return Found(np.nan, MAX_SOLVES, iterations, spent, failure.cause)
    return _found(rest, points, time.process_time() - begin)


def _found(rest: Rest, points: Floats, seconds: float) -> Found:
    error = float(np.linalg.norm(rest.points - points, axis=1).mean())
    return Found(error, max(rest.solves, 1), rest.iterations, seconds)


def summary(results: Sequence[Result]) -> list[dict[str, Any]]:
    """A row a method, over the samples that it solved, with the thesis' beside."""
    rows = []
    for name in METHODS:
        found = [r.found[name] for r in results]
        good = [f for f in found if not np.isnan(f.error)]
        once = [r.found["inverse"] for r in results if not np.isnan(r.found[name].error)]
        row: dict[str, Any] = {
            "method": name,
            "solved": len(good),
            "failed": len(found) - len(good),
        }
        if good:
            error = [f.error for f in good]
            row |= {"mean_error_m": float(np.mean(error)), "largest_error_m": max(error)}
            row |= {
                "forward_solves": 0.0 if name == "inverse" else _mean(good, "solves"),
                "newton_iterations": _mean(good, "iterations"),
                "iterations_by_inverse": _mean(good, "iterations") / _mean(once, "iterations"),
                "time_by_inverse": _mean(good, "cpu_seconds") / _mean(once, "cpu_seconds"),
            }
        if name in THESIS:
            keys = ("thesis_mean_error_m", "thesis_solves", "thesis_time_by_inverse")
            row |= dict(zip(keys, THESIS[name], strict=True))
        rows.append(row)
    return rows


def _mean(found: Sequence[Found], name: str) -> float:
    return float(np.mean([getattr(f, name) for f in found]))


def line(result: Result) -> dict[str, Any]:
    """A sample with all that makes it, and what each method gave."""
    s, t = result.sample, result.sample.tetrahedron
    row: dict[str, Any] = {"number": s.number, "law": s.law, "load": s.load}
    row |= {"young_pa": repr(s.young), "poisson": repr(t.poisson), "density_kg_m3": DENSITY}
    gravity = (GRAVITY * t.direction).tolist()
    row |= {f"g{axis}_m_s2": repr(g) for axis, g in zip("xyz", gravity, strict=True)}
    for node, point in enumerate(t.points.tolist()):
        row |= {f"{axis}{node}_m": repr(x) for axis, x in zip("xyz", point, strict=True)}
    row |= {"largest_stretch": result.stretch, "J": result.volume_ratio, "apex_by_h": result.moved}
    for name, f in result.found.items():
        row |= {f"{name}_error_m": "" if np.isnan(f.error) else f.error}
        row |= {f"{name}_solves": f.solves} if name != "inverse" else {}
        row |= {f"{name}_iterations": f.iterations, f"{name}_reason": f.reason}
    return row
