"""`supple study`: cases with a known answer, as a table and a figure."""

from __future__ import annotations

from pathlib import Path

import click

from ._run import Run, command


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


def _pdms_beam(run: Run, mesh: Path | None) -> None:
    from ..mesh import Mesh
    from ..studies import pdms_beam, pdms_beam_figure, pdms_beam_report

    given = None if mesh is None else Mesh.read(mesh, unit="m")
    outcome = pdms_beam.run(given, progress=run.progress)
    run.path("pdms_beam.csv").write_text(pdms_beam_report.table(outcome), encoding="utf-8")
    for suffix in ("svg", "png"):
        pdms_beam_figure.draw(outcome, run.path(f"pdms_beam.{suffix}"))
    run.result |= pdms_beam_report.result(outcome)
    for line in pdms_beam_report.lines(outcome):
        run.say(line)
    for check in pdms_beam_report.checks(outcome):
        run.say(f"{check.name}: {check.value:.2e} m, bar {check.bar:g} m")
        if not check.passed:
            run.doubt(f"{check.name} is {check.value:.2e} m, bar {check.bar:g} m")


_STUDIES = {"hanging-dome": _hanging_dome, "manufactured": _manufactured}
_WITH_MESH = {"pdms-beam": _pdms_beam}


@command
@click.argument("name", type=click.Choice([*_STUDIES, *_WITH_MESH]))
@click.option("--mesh", type=click.Path(path_type=Path), help="pdms-beam: the thesis' Beam2k.msh.")
def study(run: Run, name: str, mesh: Path | None) -> None:
    r"""Run a study; writes its table and figure to --out (default: out/ and its name).

    \b
    hanging-dome  rest and supine depth of a prone dome under gravity, beside DOLFINx'
    manufactured  a chosen field given back under its exact loads: rates of convergence of
                  displacement and strain for three laws and four elements; exits with 3 if
                  one is more than 0.1 off its theory
    pdms-beam     a silicone beam hanging to |u| = 129 mm at its tip, beside the elastica, and
                  straight again; explains the published 127.68 to 134.8 mm; exits with 3 if a
                  bar is missed
    """
    if mesh is not None and name not in _WITH_MESH:
        raise click.UsageError(f"--mesh is an option of {', '.join(_WITH_MESH)}, not of {name}.")
    run.out_or(Path("out") / name)
    if name in _WITH_MESH:
        _WITH_MESH[name](run, mesh)
    else:
        _STUDIES[name](run)
