"""What the study of rest-shape methods says: its table, and where the inverse is not ahead."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from . import output
from .rest_methods import RACERS, Outcome, Racer


def beaten(outcome: Outcome) -> list[str]:
    """Sentences for each way in which the inverse is not ahead; none if it is."""
    inverse, doubts = outcome.limit("inverse"), []
    for found in outcome.limits:
        if found.method != "inverse" and found.good >= inverse:
            doubts.append(f"{outcome.case}: {found.method} takes {found.good:.3g} g off, "
                          f"inverse {inverse:.3g} g")  # fmt: skip
    for load in outcome.reversed_gravity:
        for name in RACERS:
            if outcome.ratio(name, load) < 1:
                doubts.append(f"{outcome.case}, {load} load: {name} is quicker than inverse")
    return doubts


def table(outcomes: Sequence[Outcome]) -> str:
    """A line a method on a body at a load; lengths are shares of the size, loads times gravity."""
    return output.table([row(o, racer) for o in outcomes for racer in o.racers])


def row(outcome: Outcome, racer: Racer) -> dict[str, Any]:
    """One method on one body at one load."""
    end = next((found for found in outcome.limits if found.method == racer.method), None)
    return {
        "body": outcome.case,
        "method": racer.method,
        "gravity_limit": "" if end is None else _short(end.good),
        "fails_at": "" if end is None else _short(end.bad),
        "why": "" if end is None else end.why,
        "load": racer.load,
        "gravity": _short(racer.factor),
        "forward_solves": racer.solves,
        "newton_iterations": racer.iterations,
        "seconds": _short(racer.seconds),
        "over_inverse": _short(outcome.ratio(racer.method, racer.load)),
        "miss": _short(racer.miss),
        "reversed_gravity_error": _short(outcome.reversed_gravity[racer.load]),
    }


def _short(value: float) -> str:
    return "" if np.isnan(value) else f"{value:.3g}"


def lines(outcome: Outcome) -> list[str]:
    """An outcome for people: limits, then times over the inverse's."""
    limits = ", ".join(f"{found.method} {found.good:.3g} g" for found in outcome.limits)
    told = [f"{outcome.case}: {limits}"]
    for load, shortcut in outcome.reversed_gravity.items():
        racers = [r for r in outcome.racers if r.load == load]
        ratios = [f"{r.method} {_short(outcome.ratio(r.method, load)) or '–'}" for r in racers[1:]]
        told.append(
            f"  {racers[0].factor:.3g} g in {1e3 * racers[0].seconds:.0f} ms; times over that: "
            f"{', '.join(ratios)}; reversed gravity is off by {shortcut:.2g} of the size"
        )
    return told
