"""The sagging block as a study: samples or mesh convergence, tables, figures, what to doubt."""

from __future__ import annotations

import time
from pathlib import Path

import click

from ..errors import InputError
from ._run import Run


def sagging_block(
    run: Run,
    *,
    samples: int = 2000,
    seed: int = 1,
    jobs: int = 0,
    resume: bool = False,
    convergence: bool = False,
) -> None:
    """The study of that name."""
    from ..studies.sagging_block_samples import TABLE

    if convergence:
        _convergence(run)
        return
    table = run.target / TABLE
    try:
        _samples(run, table, samples, seed, jobs, resume)
    except KeyboardInterrupt:
        if not table.exists():
            raise
        raise click.Abort(f"interrupted; {table} keeps its samples, --resume goes on") from None


def _samples(run: Run, table: Path, samples: int, seed: int, jobs: int, resume: bool) -> None:
    from ..studies import sagging_block as block
    from ..studies import sagging_block_figure as figure
    from ..studies import sagging_block_samples as many
    from ..threads import available

    if samples < 1 or jobs < 0 or seed < 0:
        raise InputError(
            "--samples must be at least 1, --seed and --jobs at least 0 (0 jobs: one a processor), "
            f"got {samples}, {seed} and {jobs}."
        )
    begin, jobs = time.monotonic(), jobs or available()
    reference = block.Block()  # compiles, where that is still to be done, before the workers ask
    journal, seconds = many.run(
        table, samples, seed, jobs, resume, lambda share: run.progress("sagging-block", share)
    )
    printed = {at: reference.run(*at).mae for at in block.PRINTED}
    run.path(many.TABLE).write_text(journal.table(), encoding="utf-8")
    for suffix in ("svg", "png"):
        figure.draw(journal, printed, run.path(f"sagging_block.{suffix}"))
    found = many.summary(journal)
    run.result |= found | {
        "seed": seed,
        "jobs": jobs,
        "seconds": time.monotonic() - begin,
        "cpu_seconds_per_sample": sum(seconds) / len(seconds) if seconds else None,
        "thesis": [
            {"mu_pa": mu, "lambda_pa": la, "thesis_mae_m": theirs, "mae_m": printed[mu, la]}
            for (mu, la), theirs in block.PRINTED.items()
        ],
    }
    _say(run)


def _say(run: Run) -> None:
    r = run.result
    run.say(
        f"{r['solved']} of {r['samples']} samples solved, MAE at most {r['largest_mae_m']:.1e} m; "
        f"{r['without_stable_forward_solution']} have no stable shape under their weight"
    )
    for reason, count in r["reasons"].items():
        run.say(f"  {count}: {reason}")
    for point in r["thesis"]:
        run.say(
            f"μ = {point['mu_pa']:g} Pa, λ = {point['lambda_pa']:g} Pa: "
            f"MAE {point['mae_m']:.1e} m, thesis {point['thesis_mae_m']:.2e} m"
        )
    run.say(
        f"reversed gravity: MAE at most {r['reversed_gravity']['largest_mae_m']:.1e} m, "
        f"{r['reversed_gravity']['failed']} failed"
    )
    if r["failed"]:
        run.doubt(f"{r['failed']} samples with a stable loaded shape have no rest shape")
    if r["above_bar"]:
        run.doubt(f"{r['above_bar']} samples miss the cube by more than {r['bar_m']:g} m")


def _convergence(run: Run) -> None:
    from ..studies import sagging_block as block
    from ..studies import sagging_block_convergence as convergence
    from ..studies import sagging_block_figure as figure

    rows = convergence.run(progress=run.progress)
    name = "sagging_block_convergence"
    text = convergence.csv(rows)
    run.path(f"{name}.csv").write_text(text, encoding="utf-8")
    for suffix in ("svg", "png"):
        figure.draw_convergence(rows, run.path(f"{name}.{suffix}"))
    run.result["bar_m"] = block.BAR
    run.result["largest_mae_m"] = max(row.found.mae for row in rows)
    run.say(text.strip())
    for row in rows:
        if not row.found.mae <= block.BAR:
            run.doubt(
                f"{row.name} on {row.cubes} cubes: {row.found.outcome}, {row.found.mae:.1e} m"
            )
