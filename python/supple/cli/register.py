"""`supple register`: a torso template onto a surface scan, and the surgeon's drawing with it."""

from __future__ import annotations

import time
from pathlib import Path
from typing import TYPE_CHECKING

import click

from ..errors import InputError
from ..files import METRES
from ._run import Run, command

if TYPE_CHECKING:
    from ..registration.output import Outcome
    from ..registration.template import Template

_FILE = click.Path(path_type=Path)


@command
@click.argument("scan", type=_FILE, required=False)
@click.option("--template", type=_FILE, metavar="FILE.glb",
              help="Template; the default is the one that ships.")  # fmt: skip
@click.option("--landmarks", type=_FILE, metavar="FILE",
              help="On the scan: .fcsv, .mrk.json, .json, .pp, or .csv of name,x,y,z.")  # fmt: skip
@click.option("--unit", type=click.Choice(list(METRES)), help="Of the scan; found from its size.")
@click.option("--start", type=_FILE, metavar="parameters.json",
              help="Of the frame before: the fit starts from there.")  # fmt: skip
@click.option("--study", is_flag=True, help="In place of a SCAN: redo the thesis' studies.")
@click.option("--samples", type=click.IntRange(min=1), metavar="N",
              help="Of --study: bodies a pose (default 3).")  # fmt: skip
@click.option("--data", type=click.Path(path_type=Path, file_okay=False, exists=True),
              help="Of --study: folder of template_makehuman.")  # fmt: skip
def register(
    run: Run,
    scan: Path | None,
    template: Path | None,
    landmarks: Path | None,
    unit: str | None,
    start: Path | None,
    study: bool,
    samples: int | None,
    data: Path | None,
) -> None:
    """Fit a torso to SCAN, in any pose, and carry the surgeon's drawing onto it.

    SCAN is PLY, OBJ, STL, OFF, glTF, VTK or VTP, in any unit, of the front at least, from neck to
    waist. No landmarks are needed; those of a file are used, and compared with. Writes
    registered.ply, drawing.ply, .obj and .glb, landmarks.mrk.json and .fcsv, parameters.json,
    table.csv, picture.png, report.html and result.json to --out (default: out/ and the name of the
    scan).
    Exits with 3 where the fit is not to be trusted. Research use only.

    --study draws the errors against landmarks given, blendshapes kept and each weight of the
    energy (thesis, figures 9 to 13), on synthetic scans, to --out (default: out/register-study).
    """
    if study:
        _only("--study takes no SCAN, --template, --landmarks, --unit or --start",
              scan, template, landmarks, unit, start)  # fmt: skip
        _study(run, samples or 3, data)
        return
    _only("--samples and --data are of --study", samples, data)
    if scan is None:
        raise InputError("SCAN is missing; give the file of a surface scan, or --study.")
    from ..registration.output import write

    begun = time.perf_counter()
    run.out_or(Path("out") / scan.name.split(".")[0])
    outcome = fitted(run, scan, template, landmarks, unit, start)
    run.progress("measuring")
    run.result |= {"scan": scan.name, **outcome.summary()}
    run.progress("writing")
    write(outcome, run.path)
    tell(run, outcome, time.perf_counter() - begun)


def _only(rule: str, *given: object) -> None:
    if any(value is not None for value in given):
        raise InputError(f"{rule}; leave them out.")


def _study(run: Run, samples: int, data: Path | None) -> None:
    from ..studies import torso

    run.out_or(Path("out") / "register-study")
    written = torso.run(run.path("torso.csv").parent, samples, data, run.progress)
    run.result["files"] = [path.name for path in written]
    run.say(f"bodies a pose: {samples}; figures and tables of {', '.join(torso.SWEEPS)}")


def fitted(
    run: Run, scan: Path, template: Path | None, landmarks: Path | None, unit: str | None,
    start: Path | None,
) -> Outcome:  # fmt: skip
    """Read, check, fit; whatever is wrong with a file is said before the fit.

    Raises:
        InputError: a file that cannot be used.
    """
    from dataclasses import asdict

    from ..registration.landmark_check import check_on_scan
    from ..registration.landmark_files import read_landmarks
    from ..registration.output import Outcome, judged, read_posture
    from ..registration.register import RegisterSettings
    from ..registration.register import register as work
    from ..registration.scan_file import read_scan

    run.progress("reading")
    torso = chosen(template)
    posture = None if start is None else read_posture(start, torso)
    marks = None if landmarks is None else read_landmarks(landmarks)
    found = read_scan(scan, unit)
    said, given = list(found.said), {}
    if marks is not None:
        checked = check_on_scan(marks, found.surface, torso)
        said, given = [*said, *checked.said], dict(checked.points)
    settings = RegisterSettings()
    fit = work(found.surface, torso, given or None, settings, posture, run.progress)
    weights = asdict(settings.weights)
    return judged(Outcome(fit, found.surface, given, scan.name, said, weights, found.unit))


def chosen(file: Path | None) -> Template:
    """The template of a file, or the one that ships."""
    if file is None:
        from ..registration.procedural import torso

        return torso()
    from ..registration.template_file import read_template

    return read_template(file)


def tell(run: Run, outcome: Outcome, seconds: float) -> None:
    """The result as the command's answer; a fit that is not trustworthy makes it doubtful.

    Args:
        seconds: that the command took, to the last file written.
    """
    from ..registration.body_size import body_size

    fit, m, of = outcome.registration, outcome.metrics, outcome.measures.of
    for sentence in outcome.said:
        run.say(f"note: {sentence}")
    unit = f"; the scan was read in {outcome.unit}" if outcome.unit else ""
    run.say(f"body: {body_size(fit)}{unit}")
    line = f"skin: {m.surface_mae_mm:.2f} mm on average from {100 * m.used_share:.0f} % of the scan"
    if m.landmark_mae_mm is not None:
        line += f"; landmarks: {m.landmark_mae_mm:.1f} mm"
    run.say(line)
    volumes = (of("volume", side) for side in ("right", "left"))
    run.say("breasts: " + ", ".join(
        f"{v.side} {v.value:.0f} ml" + ("" if v.sd is None else f" ± {v.sd:.0f}") for v in volumes
    ))  # fmt: skip
    on = sum(c.on_scan.sum() for c in outcome.curves.values())
    every = sum(len(c.points) for c in outcome.curves.values())
    held = "" if len(outcome.scan.triangles) else "; the scan is points alone, no surface"
    run.say(f"drawing: {100 * on / every:.0f} % on the scan, the rest on the registered skin{held}")
    run.say(f"fitted in {m.seconds:.2f} s, {seconds:.1f} s with reading, measuring and writing; "
            "open report.html in a browser")  # fmt: skip
    if fit.trustworthy:
        for warning in fit.warnings:
            run.say(f"warning: {warning}")
        return
    for reason in fit.warnings or ["the fit does not pass its own checks"]:
        run.doubt(reason)
