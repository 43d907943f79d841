"""The single tetrahedron as a study."""

from __future__ import annotations

from typing import Any

from ..errors import InputError
from ._run import Run


def single_tetrahedron(run: Run, *, seed: int = 1) -> None:
    """The study of that name."""
    from ..studies import single_tetrahedron as single
    from ..studies import single_tetrahedron_figure as figure
    from ..studies import single_tetrahedron_run as methods
    from ..studies.output import table

    if seed < 0:
        raise InputError(f"--seed must be at least 0, got {seed}.")
    run.progress("single-tetrahedron, drawing")
    samples = single.draw(seed)
    results = list(methods.run(samples, lambda share: run.progress("single-tetrahedron", share)))
    rows = methods.summary(results)
    lines = table([methods.line(result) for result in results])
    run.path("single_tetrahedron.csv").write_text(lines, encoding="utf-8")
    run.path("single_tetrahedron_methods.csv").write_text(table(rows), encoding="utf-8")
    for suffix in ("svg", "png"):
        figure.draw(results, run.path(f"single_tetrahedron.{suffix}"))
    run.result |= {"seed": seed, "tests": len(results), "methods": rows, "bar_m": methods.BAR}
    run.result |= {"thesis_sellier_failures": methods.THESIS_FAILURES}
    run.say(table(rows).strip())
    _judge(run, rows[0], methods.BAR)


def _judge(run: Run, inverse: dict[str, Any], bar: float) -> None:
    if inverse["failed"]:
        run.doubt(f"{inverse['failed']} tests have no inverse solution")
    if inverse["solved"] and not inverse["mean_error_m"] <= bar:
        run.doubt(f"the inverse's mean error is {inverse['mean_error_m']:.1e} m, above {bar:g} m")
