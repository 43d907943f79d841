"""`supple study`: cases with a known answer, as a table and a figure."""

from __future__ import annotations

from pathlib import Path

import click

from ._run import Run, command

STUDIES = ("hanging-dome",)


@command
@click.argument("name", type=click.Choice(STUDIES))
def study(run: Run, name: str) -> None:
    """Run a study; writes its table (CSV) and figure (SVG) to --out (default: out/ and its name).

    hanging-dome: rest and supine depth of a prone dome under gravity, beside DOLFINx'. Figures need
    matplotlib: pip install supple[figures].
    """
    from ..studies import hanging_dome

    run.out_or(Path("out") / name)
    outcomes = []
    for number, case in enumerate(hanging_dome.CASES):
        run.progress(name, number / len(hanging_dome.CASES))
        outcomes.append(hanging_dome.run(case))
    written = hanging_dome.write(outcomes, run.path("hanging_dome.csv").parent)
    run.result["files"] = [path.name for path in written]
    run.say(run.path("hanging_dome.csv").read_text(encoding="utf-8").strip())
