"""`supple materials fit`: a law's parameters from tests of a material."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from ..errors import InputError
from ._run import Run, command
from ._values import values

if TYPE_CHECKING:
    from ..author.data import Series
    from ..author.fit_result import Fit, Fitted

_FILE = click.Path(path_type=Path)


@command
@click.argument("law", metavar="FILE|NAME")
@click.option("--data", multiple=True, type=_FILE, help="CSV with a column 'mode'; repeatable.")
@click.option("--uniaxial", type=_FILE, help="CSV of a uniaxial test.")
@click.option("--equibiaxial", type=_FILE, help="CSV of an equibiaxial test.")
@click.option("--planar", type=_FILE, help="CSV of a planar (pure shear) test.")
@click.option("--simple-shear", type=_FILE, help="CSV of a simple shear test.")
@click.option("--volumetric", type=_FILE, help="CSV of a volumetric test.")
@click.option("--fix", "fixed", multiple=True, metavar="NAME=VALUE", help="Keeps a parameter.")
@click.option("--start", "begin", multiple=True, metavar="NAME=VALUE", help="Where to begin.")
@click.option("--weights", type=click.Choice(["absolute", "relative"]), default="absolute",
              show_default=True, help="Of residuals: in Pa, or over the stress.")  # fmt: skip
@click.option("--starts", type=int, default=5, show_default=True, help="Searches.")
@click.option("--seed", type=int, default=0, show_default=True, help="Of the other starts.")
@click.option("--format", "suffix", type=click.Choice(["png", "svg"]), default="png",
              show_default=True, help="Of the picture.")  # fmt: skip
def fit(
    run: Run, law: str, fixed: tuple[str, ...], begin: tuple[str, ...], weights: str, starts: int,
    seed: int, suffix: str, **files: Any,
) -> None:  # fmt: skip
    r"""Fit an energy's parameters to test data by least squares within their bounds.

    Writes result.json and fit.png to --out (default: out/ and the law's name, -fit), and prints the
    line that makes a body of the fit. Columns of a CSV, in any order:

    \b
      mode      uniaxial, equibiaxial, planar, simple_shear or volumetric (of the row)
      stretch   or strain, strain_percent, true_strain; shear; volume_ratio
      nominal_stress_kPa   or cauchy_stress_…, pressure_…; in Pa, kPa, MPa or GPa
      weight    optional factor on the row's residual

    Faces that a test does not grip carry no stress. Exit code 3: the data does not determine the
    parameters, or no optimum was found.
    """
    from ..author.figures_fit import draw_fit
    from ..author.fit import fit as fitted

    run.progress("fitting")
    series = _series(files)
    settings = {"fixed": values("--fix", fixed), "start": values("--start", begin)}
    found = fitted(law, series, weights=weights, starts=starts, seed=seed, **settings)
    run.out_or(Path("out") / f"{Path(law).stem}-fit")
    run.result |= _as_object(found)
    draw_fit(found, run.path(f"fit.{suffix}"))
    _tell(run, found)


def _series(files: dict[str, Any]) -> list[Series]:
    from ..author import data
    from ..author.modes import mode_of

    series = [s for file in files.pop("data") for s in data.read_csv(file)]
    for name, file in files.items():
        if file is not None:
            series += data.read_csv(file, mode_of(name))
    if not series:
        raise InputError("there is no data to fit; give --data FILE, or --uniaxial FILE and so on.")
    return series


def _tell(run: Run, found: Fit) -> None:
    for p in found.parameters:
        run.say(_line(p))
    unit = "" if found.weights == "relative" else " Pa"
    each = ", ".join(
        f"{r:.5f} {s.mode.title}" for s, r in zip(found.series, found.r_squared_of, strict=True)
    )
    run.say(f"R² = {found.r_squared:.5f} ({each}); standard error {found.standard_error:.4g}{unit}")
    tried, same = found.starts
    run.say(f"{same} of {tried} starts ended here")
    for warning in found.warnings:
        run.say(f"warning: {warning}")
    run.say(found.line)


def _line(p: Fitted) -> str:
    unit = "" if p.unit == "1" else f" {p.unit}"
    if p.interval is None:
        value = f"{p.value:.6g}" if isinstance(p.value, int | float) else str(p.value)
        return f"{p.name} = {value}{unit} ({p.state})"
    low, high = p.interval
    return f"{p.name} = {p.value:.6g}{unit} (95 %: {low:.6g} to {high:.6g})"


def _as_object(found: Fit) -> dict[str, Any]:
    return {
        "material": found.material,
        "parameters": {
            p.name: {"value": p.value, "unit": p.unit, "sd": p.sd, "interval95": p.interval,
                     "state": p.state}
            for p in found.parameters
        },
        "r_squared": found.r_squared,
        "standard_error": {
            "value": found.standard_error, "unit": "1" if found.weights == "relative" else "Pa"
        },
        "weights": found.weights,
        "correlation": {"parameters": found.free, "matrix": found.correlation},
        "starts": {"tried": found.starts[0], "ended_here": found.starts[1]},
        "series": [
            {"mode": s.mode.name, "control": s.mode.control, "kind": s.kind, "r_squared": r,
             "values": s.values, "measured_pa": s.stress, "fitted_pa": p}
            for s, p, r in zip(found.series, found.predicted, found.r_squared_of, strict=True)
        ],
        "warnings": found.warnings,
        "line": found.line,
    }  # fmt: skip
