"""Many samples of the sagging block: in parallel, one line of a table each, resumable.

draw → those not in the table yet → workers → table → what they say together
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from ..errors import InputError
from ..workers import Workers
from .journal import Journal
from .sagging_block import BAR, NO_FORWARD, SOLVED, Block, Outcome, draw

COLUMNS = (
    "number", "seed", "mu_pa", "lambda_pa", "outcome", "mae_m", "largest_m",
    "reversed_gravity_mae_m", "sag_m", "smallest_j", "iterations_forward", "iterations_inverse",
    "reason",
)  # fmt: skip
TABLE = "sagging_block.csv"


def run(
    path: Path,
    samples: int,
    seed: int,
    jobs: int,
    resume: bool = False,
    progress: Callable[[float], None] | None = None,
) -> tuple[Journal, list[float]]:
    """Fill the table at ``path``; stopped at any moment, it can be resumed to the same table.

    Returns:
        the table, and the processor seconds of each sample of this run.

    Raises:
        InputError: a table that is there and not to be resumed, or of another seed.
    """
    drawn = draw(samples, seed).tolist()
    journal = Journal(path, COLUMNS, resume=resume)
    _require_same(journal, drawn, seed)
    todo = [(n, *drawn[n]) for n in range(samples) if n not in journal.rows]
    seconds = []
    with Workers(jobs, _sampler) as pool:
        for task, outcome in pool.answers([at for _, *at in todo]):
            number, mu, lmbda = todo[task]
            journal.append(_row(number, seed, mu, lmbda, outcome))
            seconds.append(outcome.cpu_seconds)
            if progress:
                progress(len(journal.rows) / samples)
    return journal, seconds


def _require_same(journal: Journal, drawn: list[list[float]], seed: int) -> None:
    for number, row in journal.rows.items():
        known = number < len(drawn)
        if not known or row[1:4] != [str(seed), *map(repr, drawn[number])]:
            raise InputError(
                f"{journal.path} must hold samples 0 to {len(drawn) - 1} of seed {seed}, got "
                f"number {number} of seed {row[1]}; give its --seed and no fewer --samples, "
                "or choose another --out."
            )


def _sampler() -> Callable[[list[float]], Outcome]:
    block = Block()
    return lambda at: block.run(*at)


def _row(number: int, seed: int, mu: float, lmbda: float, o: Outcome) -> list[object]:
    errors = (o.mae, o.largest, o.reversed_gravity)
    figures = [*(_number(e, ".3e") for e in errors), _number(o.sag, ".6g")]
    head = [number, seed, repr(mu), repr(lmbda), o.outcome]
    return [*head, *figures, _number(o.smallest_j, ".4f"), *o.iterations, o.reason]


def _number(value: float, form: str) -> str:
    return "" if math.isnan(value) else format(value, form)


def column(journal: Journal, name: str) -> np.ndarray[Any, np.dtype[np.float64]]:
    """A column of numbers in the order of `table`, NaN where a cell is empty."""
    place = COLUMNS.index(name)
    return np.array([float(journal.rows[n][place] or "nan") for n in sorted(journal.rows)])


def outcomes(journal: Journal) -> list[str]:
    """The column of outcomes in the order of `table`."""
    return [journal.rows[n][COLUMNS.index("outcome")] for n in sorted(journal.rows)]


def summary(journal: Journal) -> dict[str, Any]:
    """Counts, largest and mean errors, m; reasons where there is no stable forward solution."""
    count, mae = Counter(outcomes(journal)), column(journal, "mae_m")
    solved = ~np.isnan(mae)
    shortcut = column(journal, "reversed_gravity_mae_m")
    shortcut_found = shortcut[~np.isnan(shortcut)]
    apart = [row for row in journal.rows.values() if row[4] == NO_FORWARD]
    return {
        "samples": len(journal.rows),
        "solved": count[SOLVED],
        "without_stable_forward_solution": count[NO_FORWARD],
        "reasons": dict(Counter(row[-1] for row in apart)),
        "failed": len(journal.rows) - count[SOLVED] - count[NO_FORWARD],
        "largest_mae_m": float(np.max(mae[solved], initial=0.0)),
        "mean_mae_m": float(np.mean(mae[solved])) if solved.any() else None,
        "above_bar": int((mae[solved] > BAR).sum()),
        "bar_m": BAR,
        "reversed_gravity": {
            "failed": int(np.isnan(shortcut[solved]).sum()),
            "mean_mae_m": float(shortcut_found.mean()) if shortcut_found.size else None,
            "largest_mae_m": float(shortcut_found.max(initial=0.0)),
        },
    }
