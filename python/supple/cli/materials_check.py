"""`supple materials check`: what an energy must be, as a table and a picture."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from ._run import Run, command
from ._values import values

if TYPE_CHECKING:
    from ..author.inspect_law import Inspection
    from ..author.properties import Property

_MARKS = {True: "yes", False: "NO", None: "–"}


@command
@click.argument("law", metavar="FILE|NAME")
@click.option("--set", "given", multiple=True, metavar="NAME=VALUE", help="Parameter of the law.")
@click.option("--stretch", nargs=2, type=float, default=(0.4, 2.0), show_default=True,
              help="Least and largest stretch.")  # fmt: skip
@click.option("--shear", type=float, default=1.0, show_default=True, help="Largest shear.")
@click.option("--volume", nargs=2, type=float, default=(0.5, 1.5), show_default=True,
              help="Least and largest volume ratio.")  # fmt: skip
@click.option("--seed", type=int, default=0, show_default=True, help="Of random deformations.")
@click.option("--format", "suffix", type=click.Choice(["png", "svg"]), default="png",
              show_default=True, help="Of the picture.")  # fmt: skip
def check(
    run: Run, law: str, given: tuple[str, ...], stretch: tuple[float, float], shear: float,
    volume: tuple[float, float], seed: int, suffix: str,
) -> None:  # fmt: skip
    """Check an energy: rest, objectivity, isotropy, derivatives, ellipticity, ψ ≥ 0.

    Prints a table and draws five tests to curves.png in --out (default: out/ and the law's name,
    -check). What it computes with are the law's own compiled kernels. Exit code 3: a property
    fails that the file does not declare as an exception. Where the law loses ellipticity, and where
    it has no state, is information, unless that is at rest.
    """
    from ..author.figures import draw_inspection
    from ..author.inspect_law import inspect_law
    from ..author.samples import Range

    run.progress("checking")
    span = Range(stretch, shear, volume, seed=seed)
    found = inspect_law(law, span, **values("--set", given))
    run.out_or(Path("out") / f"{found.law.name}-check")
    run.result |= _as_object(found)
    if found.compiled:
        draw_inspection(found, run.path(f"curves.{suffix}"))
    for line in _table(found.properties):
        run.say(line)
    run.say(f"figures are relative to the largest stiffness at rest, {found.stiffness:.4g} Pa")
    for failed in found.failed:
        run.doubt(f"{failed.name}: {_reason(failed)}")


def _reason(failed: Property) -> str:
    if failed.declared:
        return failed.note
    limit = "" if failed.limit is None else f", not at most {failed.limit:.2g}"
    return f"{_figure(failed)}{limit}{'; ' + failed.note if failed.note else ''}"


def _table(tried: list[Property]) -> list[str]:
    rows = [("property", "holds", "figure", "limit", "")]
    rows += [(p.name, _mark(p), _figure(p), _limit(p), p.note) for p in tried]
    widths = [max(len(row[column]) for row in rows) for column in range(4)]
    return [
        "  ".join([*(text.ljust(w) for text, w in zip(row, widths, strict=False)), row[4]]).rstrip()
        for row in rows
    ]


def _mark(p: Property) -> str:
    return "declared" if p.declared and p.passed else _MARKS[p.passed]


def _figure(p: Property) -> str:
    return p.figure if isinstance(p.figure, str) else f"{p.figure:.2g}"


def _limit(p: Property) -> str:
    return "" if p.limit is None else f"{p.limit:.2g}"


def _as_object(found: Inspection) -> dict[str, Any]:
    return {
        "material": found.law.name,
        "path": found.law.path,
        "parameters": found.values,
        "stiffness_pa": found.stiffness,
        "compiled": found.compiled,
        "properties": [
            {"name": p.name, "passed": p.passed, "figure": p.figure, "limit": p.limit,
             "note": p.note, "declared": p.declared}
            for p in found.properties
        ],
        "loses_ellipticity": [
            {"mode": x.curve.mode.name, "control": x.curve.mode.control, "side": x.side,
             "value": x.value, "axes": x.curve.axes}
            for x in found.losses
        ],
    }  # fmt: skip
