"""`supple demo`: the whole pipeline on a synthetic patient whose truth is known."""

from __future__ import annotations

from pathlib import Path

import click

from ._run import Run, command


@command
@click.option("--seed", type=click.IntRange(min=0), default=1, show_default=True,
              help="Decides the patient: size, shape, stiffness, tumour, noise.")  # fmt: skip
def demo(run: Run, seed: int) -> None:
    """Make a synthetic patient, predict her tumour's supine place, compare with the truth.

    Needs no data. The prediction sees only the patient's files, which are kept in patient/. Writes
    what `supple predict` writes to --out (default: out/demo).
    """
    from ..breast.demo import demo as work
    from ..breast.demo import shortfalls
    from .predict import tell

    run.out_or(Path("out") / "demo")
    result = work(seed, run.path, run.progress)
    tell(run, result)
    assert result.truth is not None
    run.say(
        f"truth: the tumour is {result.truth.tumour_error_mm:.1f} mm off, after rigid alignment "
        f"alone it would be {result.truth.rigid_error_mm:.1f} mm off"
    )
    for reason in shortfalls(result):
        run.doubt(reason)
