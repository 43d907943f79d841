"""`supple study`: cases with a known answer, as a table and a figure."""

from __future__ import annotations

import inspect
from collections.abc import Callable
from pathlib import Path
from typing import Any

import click

from ._run import Run, command
from ._study_block import sagging_block
from ._study_methods import rest_methods
from ._study_pdms import pdms_beam
from ._study_shear import inverse_shear
from ._study_tetrahedron import single_tetrahedron
from ._study_torso import torso


def _hanging_dome(run: Run) -> None:
    from ..studies import hanging_dome

    outcomes = []
    for number, case in enumerate(hanging_dome.CASES):
        run.progress("hanging-dome", number / len(hanging_dome.CASES))
        outcomes.append(hanging_dome.run(case))
    written = hanging_dome.write(outcomes, run.path("hanging_dome.csv").parent)
    run.result["files"] = [path.name for path in written]
    run.say(run.path("hanging_dome.csv").read_text(encoding="utf-8").strip())


def _manufactured(run: Run) -> None:
    from ..studies import manufactured, manufactured_figure

    todo, found = manufactured.plan(), []
    for number, (case, element) in enumerate(todo):
        run.progress(f"{case.name} {element}", number / len(todo))
        found.append(manufactured.run(case, element))
    for suffix in ("svg", "png"):
        manufactured_figure.draw(found, run.path(f"manufactured.{suffix}"))
    run.result["bar"] = manufactured.BAR
    run.result["series"] = [manufactured.row(series) for series in found]
    for series in found:
        run.say(manufactured.line(series))
        if series.miss > manufactured.BAR:
            run.doubt(f"a rate is {series.miss:.2f} off its theory: {manufactured.line(series)}")


_STUDIES: dict[str, Callable[..., None]] = {
    "hanging-dome": _hanging_dome,
    "inverse-shear": inverse_shear,
    "manufactured": _manufactured,
    "pdms-beam": pdms_beam,
    "rest-methods": rest_methods,
    "sagging-block": sagging_block,
    "single-tetrahedron": single_tetrahedron,
    "torso": torso,
}


@command
@click.argument("name", type=click.Choice(list(_STUDIES)))
@click.option("--samples", type=int, help="How many (sagging-block: 2000, torso: 3).")
@click.option("--seed", type=int, help="Of what is drawn at random (default 1).")
@click.option("--jobs", type=int, help="Processes; 0 (default): one a processor.")
@click.option("--resume", is_flag=True, help="Go on with the samples that --out holds.")
@click.option("--data", type=click.Path(path_type=Path, file_okay=False, exists=True),
              help="Folder of beam_pdms, liver_sofa, template_makehuman.")  # fmt: skip
@click.option("--convergence", is_flag=True, help="Finer and finer meshes in place of samples.")
def study(run: Run, name: str, **options: Any) -> None:
    r"""Run a study; writes its table and figure to --out (default: out/ and its name).

    \b
    hanging-dome  rest and supine depth of a prone dome under gravity, beside DOLFINx'
    inverse-shear simple and generalised shear undone for three laws and four elements: exact
                  where the field is in the space, else rates; exits with 3 beyond 1e-12
    manufactured  a chosen field given back under its exact loads: rates of convergence of
                  displacement and strain for three laws and four elements; exits with 3 if
                  one is more than 0.1 off its theory
    pdms-beam     a silicone beam hanging to |u| = 129 mm at its tip, beside the elastica, and
                  straight again, with --data also on the thesis' own mesh; explains the
                  published 127.68 to 134.8 mm; exits with 3 if a bar is missed
    rest-methods  the largest gravity that the inverse solve and the fixed points of forward
                  solves take off a block and a beam, with --data also off the PDMS beam's
                  mesh and a liver, and their times; exits with 3 if inverse is not ahead
    sagging-block a cube under its weight and back, for materials drawn at random: a line of
                  the table each, in parallel; stopped, it goes on with --resume; exits with 3
                  if a rest shape misses the cube by more than 1e-9 m (--samples, --seed,
                  --jobs, --resume; --convergence)
    single-tetrahedron
                  153 loaded tetrahedra taken back by one inverse solve and by Sellier's
                  method; exits with 3 if the inverse fails or misses by 1e-12 m (--seed)
    torso         errors of a torso registered to synthetic scans, over the number of landmarks
                  given and of blendshapes, and over each weight of the energy (--samples: bodies
                  a pose, 3; --data: template_makehuman, to register across templates)
    """
    given = {
        key: value for key, value in options.items() if value is not None and value is not False
    }
    takes = inspect.signature(_STUDIES[name]).parameters
    if unknown := sorted(set(given) - set(takes)):
        raise click.UsageError(f"{name} takes no --{unknown[0]}; leave it out.")
    run.out_or(Path("out") / name)
    _STUDIES[name](run, **given)
