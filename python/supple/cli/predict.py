"""`supple predict`: a prone image in, the supine place of the tumour out."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from ..errors import InputError
from ._run import Run, command

if TYPE_CHECKING:
    from ..breast.breast_case import Case
    from ..breast.result import Result


@command
@click.argument("source", metavar="CASE.toml|IMAGE", type=click.Path(path_type=Path))
@click.option("--tumour", metavar="X,Y,Z", help="Centre in the prone image, LPS mm; with IMAGE.")
@click.option("--tumour-diameter", type=float, metavar="MM", help="Of the tumour.")
@click.option("--labels", type=click.Path(path_type=Path),
              help="Tissue labels (0 air, 1 fat, 2 gland, 3 chest, 4 tumour); else segmented.")  # fmt: skip
@click.option(
    "--scan", type=click.Path(path_type=Path), help="Supine surface scan (PLY, STL, OBJ)."
)
@click.option("--scan-unit", type=click.Choice(("mm", "cm", "m")), help="Of the scan; mm.")
@click.option("--nipple", metavar="X,Y,Z", help="Of that breast, prone, LPS mm; else estimated.")
@click.option("--seeds", multiple=True, metavar="TISSUE:X,Y,Z",
              help="A point known to be air, fat, gland or chest; again for more.")  # fmt: skip
@click.option("--allow-energy-files", is_flag=True, help="Compile energy files that CASE names.")
def predict(
    run: Run, source: Path, tumour: str | None, allow_energy_files: bool, **options: Any
) -> None:
    """Predict where a tumour imaged prone lies when the patient is supine.

    CASE.toml names image, tumour and all else; or give an IMAGE (NIfTI, MHA/MHD, NRRD, a DICOM
    folder or archive) with --tumour. With a scan, the moduli of breast and skin are identified.
    Writes report.html, result.json, prone.vtu, rest.vtu, supine.vtu, supine_skin.ply and
    labels.mha to --out (default: out/ and the name of the input). Research use only.
    """
    from ..breast.predict import predict as run_prediction

    case = _case(source, tumour, allow_energy_files, options)
    run.out_or(Path("out") / source.name.split(".")[0])
    result = run_prediction(case, run.path, run.progress)
    publish(run, result)


def publish(run: Run, result: Result) -> None:
    """The result in the run, in words, and in the exit code."""
    run.result |= result.to_dict()
    t = result.tumour
    place = ", ".join(f"{v:.1f}" for v in t.supine_mm)
    run.say(f"tumour, supine: {place} mm (LPS), {t.depth_mm:.0f} mm under the skin")
    run.say(
        f"{t.breast} breast, {t.clock} o'clock, {t.nipple_distance_mm:.0f} mm from the nipple"
        if t.clock != "central"
        else f"{t.breast} breast, behind the nipple"
    )
    for warning in result.warnings:
        run.say(f"note: {warning}")
    for name, check in result.checks.items():
        if not check.passed:
            run.doubt(f"{name.replace('_', ' ')}: {check.figure}")


def _case(source: Path, tumour: str | None, allow: bool, options: dict[str, Any]) -> Case:
    from ..breast import breast_case

    point = None if tumour is None else breast_case.parse_point("--tumour", tumour)
    nipple, seeds = options.pop("nipple"), options.pop("seeds")
    given = {
        "diameter_mm": options["tumour_diameter"],
        "labels": options["labels"],
        "scan": options["scan"],
        "scan_unit": options["scan_unit"],
        "nipple_mm": None if nipple is None else breast_case.parse_point("--nipple", nipple),
        "seeds": breast_case.parse_seeds(seeds) or None,
        "tumour_mm": point,
    }
    if given["diameter_mm"] is not None and not given["diameter_mm"] > 0:
        raise InputError(f"--tumour-diameter must be above 0 mm, got {given['diameter_mm']}.")
    if source.suffix == ".toml":
        return breast_case.with_options(breast_case.read_breast_case(source, allow), **given)
    if point is None:
        raise InputError("--tumour X,Y,Z is missing: give the tumour's centre in LPS mm.")
    return breast_case.with_options(breast_case.Case(image=source, tumour_mm=point), **given)
