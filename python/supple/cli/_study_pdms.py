"""`supple study pdms-beam`."""

from __future__ import annotations

from pathlib import Path

from ._run import Run


def pdms_beam(run: Run, data: Path | None = None) -> None:
    """The study of that name; with ``data`` also on the published mesh."""
    from ..studies import pdms_beam as study
    from ..studies import pdms_beam_figure, pdms_beam_report, published_meshes

    given = None if data is None else published_meshes.beam2k(data)
    outcome = study.run(given, progress=run.progress)
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
