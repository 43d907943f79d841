"""`supple predict`: where a tumour of a prone image lies when the patient is supine."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from ..errors import InputError
from ._run import Run, command

if TYPE_CHECKING:
    from ..breast.breast_case import Case
    from ..breast.result import Result

_FILE = click.Path(path_type=Path)


@command
@click.argument("source", metavar="CASE.toml|IMAGE", type=_FILE)
@click.option("--tumour", metavar="X,Y,Z", help="Centre in the image, LPS mm.")
@click.option("--tumour-diameter", type=float, metavar="MM", help="Diameter of the tumour.")
@click.option("--labels", type=_FILE, help="Label image; the default segments the image.")
@click.option("--scan", type=_FILE, help="Supine surface scan: PLY, STL, OBJ or OFF.")
@click.option("--scan-unit", type=click.Choice(("mm", "cm", "m")), help="Of the scan; mm.")
@click.option("--still", type=_FILE, metavar="FILE",
              help="Skin in the image that does not move, to align the scan by: painted PLY, or "
                   "CSV of x,y,z,radius in mm; automatic by default.")  # fmt: skip
@click.option("--seeds", multiple=True, metavar="TISSUE:X,Y,Z",
              help="A point known to be air, fat, gland or chest; may be repeated.")  # fmt: skip
@click.option("--nipple", metavar="X,Y,Z", help="Prone nipple on the tumour's side, LPS mm.")
@click.option("--allow-energy-files", is_flag=True, help="Compile energy files that CASE names.")
def predict(
    run: Run,
    source: Path,
    tumour: str | None,
    tumour_diameter: float | None,
    labels: Path | None,
    scan: Path | None,
    scan_unit: str | None,
    still: Path | None,
    seeds: tuple[str, ...],
    nipple: str | None,
    allow_energy_files: bool,
) -> None:
    """Predict where a tumour seen in a prone image lies when the patient is supine.

    CASE.toml says everything; an IMAGE (NIfTI, MHA, MHD, NRRD, a DICOM folder or archive) needs
    --tumour. Options go before what the case says. Writes result.json, report.html, prone.vtu,
    rest.vtu, supine.vtu, supine_skin.ply and labels.mha to --out (default: out/ and the name of the
    input). Research use only.
    """
    from ..breast.breast_case import parse_point, parse_seeds, with_options
    from ..breast.predict import predict as work

    run.out_or(Path("out") / source.name.split(".")[0])
    run.progress("reading")
    case = with_options(
        _case(source, tumour, allow_energy_files),
        tumour_mm=None if tumour is None else parse_point(tumour, "--tumour"),
        tumour_diameter_mm=tumour_diameter,
        labels=labels,
        scan=scan,
        scan_unit=scan_unit,
        still=still,
        seeds=parse_seeds(seeds) or None,
        nipple_mm=None if nipple is None else parse_point(nipple, "--nipple"),
    )
    tell(run, work(case, run.path, run.progress))


def _case(source: Path, tumour: str | None, allow_energy_files: bool) -> Case:
    from ..breast.breast_case import Case, parse_point, read_breast_case

    if source.suffix == ".toml":
        return read_breast_case(source, allow_energy_files=allow_energy_files)
    if tumour is None:
        raise InputError(f"--tumour X,Y,Z is needed with the image {source}: give its centre.")
    return Case(source, parse_point(tumour, "--tumour"))


def tell(run: Run, result: Result) -> None:
    """The result as the command's answer; a failed check makes it doubtful."""
    from ..breast.result import NIPPLE_ESTIMATED

    run.result |= result.to_dict()
    t = result.tumour
    x, y, z = t.supine_mm
    nipple = "the estimated nipple" if NIPPLE_ESTIMATED in result.warnings else "the nipple"
    run.say(
        f"supine tumour: {t.depth_mm:.0f} mm deep, {t.clock} of the {t.breast} breast, "
        f"{t.nipple_distance_mm:.0f} mm from {nipple}; LPS mm ({x:.1f}, {y:.1f}, {z:.1f})"
    )
    if result.skin_mae_mm is not None:
        run.say(f"skin: {result.skin_mae_mm:.2f} mm from the scan on average")
    for warning in result.warnings:
        run.say(f"note: {warning}")
    run.say(f"{result.seconds['total']:.0f} s; open report.html in a browser")
    for name, check in result.checks.items():
        if not check.passed:
            run.doubt(f"{name.replace('_', ' ')}: {check.figure}")
