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


def _rest_methods(run: Run) -> None:
    from ..studies import rest_methods, rest_methods_figure

    data = Path("..") / "shared" / "data"
    todo, found = rest_methods.cases(data if data.is_dir() else None), []
    for case in todo:
        found.append(rest_methods.run(case, run.progress))
    rest_methods.write(found, run.path("rest_methods.csv"))
    for suffix in ("svg", "png"):
        rest_methods_figure.draw(found, run.path(f"rest_methods.{suffix}"))
    run.result["rows"] = [rest_methods.row(o, racer) for o in found for racer in o.racers]
    for outcome in found:
        for line in rest_methods.lines(outcome):
            run.say(line)
        for reason in rest_methods.beaten(outcome):
            run.doubt(reason)


_STUDIES = {
    "hanging-dome": _hanging_dome,
    "manufactured": _manufactured,
    "rest-methods": _rest_methods,
}


@command
@click.argument("name", type=click.Choice(list(_STUDIES)))
def study(run: Run, name: str) -> None:
    r"""Run a study; writes its table and figure to --out (default: out/ and its name).

    \b
    hanging-dome  rest and supine depth of a prone dome under gravity, beside DOLFINx'
    manufactured  a chosen field given back under its exact loads: rates of convergence of
                  displacement and strain for three laws and four elements; exits with 3 if
                  one is more than 0.1 off its theory
    rest-methods  the largest gravity that the inverse solve and each fixed point of forward
                  solves take off a block and a beam, and their times; with ../shared/data also
                  the PDMS beam's mesh and a liver; exits with 3 if inverse is not ahead
    """
    run.out_or(Path("out") / name)
    _STUDIES[name](run)
