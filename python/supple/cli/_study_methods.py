"""`supple study rest-methods`."""

from __future__ import annotations

from pathlib import Path

from ._run import Run


def rest_methods(run: Run, data: Path | None = None) -> None:
    """Limits and races of every way to a rest shape."""
    from ..studies import rest_methods as study
    from ..studies import rest_methods_figure, rest_methods_report

    found = [study.run(case, run.progress) for case in study.cases(data)]
    run.path("rest_methods.csv").write_text(rest_methods_report.table(found), encoding="utf-8")
    for suffix in ("svg", "png"):
        rest_methods_figure.draw(found, run.path(f"rest_methods.{suffix}"))
    run.result["rows"] = [rest_methods_report.row(o, racer) for o in found for racer in o.racers]
    for outcome in found:
        for line in rest_methods_report.lines(outcome):
            run.say(line)
        for reason in rest_methods_report.beaten(outcome):
            run.doubt(reason)
