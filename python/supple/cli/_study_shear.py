"""Inverse shear as a study."""

from __future__ import annotations

from math import isnan

from ._run import Run


def inverse_shear(run: Run) -> None:
    """The study of that name."""
    from ..studies import inverse_shear as shear
    from ..studies import inverse_shear_figure as figure
    from ..studies import inverse_shear_table as table

    cases, outcomes = table.plan(), list[shear.Outcome]()
    for number, case in enumerate(cases):
        run.progress(f"{case.law} {case.element}", number / len(cases))
        outcomes.append(shear.run(case))
    run.path("inverse_shear.csv").write_text(table.csv(outcomes), encoding="utf-8")
    for suffix in ("svg", "png"):
        figure.draw(outcomes, run.path(f"inverse_shear.{suffix}"))
    exact = [o for o in outcomes if o.case.is_in_space]
    run.result |= {
        "cases": len(outcomes),
        "field_in_space": len(exact),
        "largest_place_error": max(o.place for o in exact),
        "largest_stress_error": max(o.stress for o in exact),
        "bar": table.BAR,
        "rate_bar": table.RATE_BAR,
    }
    run.say(
        f"{len(exact)} cases whose field is in the space: the cube comes back to "
        f"{run.result['largest_place_error']:.1e}, σ to {run.result['largest_stress_error']:.1e}"
    )
    for own in table.series(outcomes):
        place, stress = table.rates(own)
        shown = "exact" if isnan(place) else f"{place:.2f}"
        run.say(f"{table.name(own[-1].case)}: rates of place {shown}, of σ {stress:.2f}")
    for words in table.misses(outcomes):
        run.doubt(words)
