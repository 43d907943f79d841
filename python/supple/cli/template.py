"""`supple template`: torsos that `supple register` fits to scans."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from ..errors import InputError
from ._run import Run, command

if TYPE_CHECKING:
    from ..registration.template import Template

_FILE = click.Path(path_type=Path)


@click.group(invoke_without_command=True)
@click.option("--out", type=click.Path(path_type=Path), help="Folder for the results.")
@click.option("--json", "as_json", is_flag=True, help="Print one JSON object.")
@click.pass_context
def template(ctx: click.Context, out: Path | None, as_json: bool) -> int:
    """Describe the torso template that ships; make one from MakeHuman's data, or look at one."""
    if ctx.invoked_subcommand is not None:
        if out is not None or as_json:
            raise click.UsageError(f"--out and --json go after {ctx.invoked_subcommand}.", ctx)
        return 0
    from .register import chosen

    with Run(out, as_json=as_json) as run:
        _describe(run, chosen(None))
    return run.exit_code


@command
@click.argument("folder", type=_FILE)
@click.option("--mpfb", type=_FILE, metavar="FOLDER", help="MPFB 2's data, for its mirror table.")
@click.option("--name", default="torso.glb", show_default=True, help="Of the file.")
def make(run: Run, folder: Path, mpfb: Path | None, name: str) -> None:
    """Make a template from FOLDER, MakeHuman's data, and write torso.glb to --out (out/template).

    FOLDER holds 3dobjs/base.obj, targets/ and rigs/ (CC0). The file opens in Blender: skin, bones,
    blendshapes; landmarks and the drawing are in its extras.
    """
    from ..registration.makehuman import torso
    from ..registration.template_file import write_template

    if Path(name).name != name or Path(name).suffix not in (".glb", ".gltf"):
        raise InputError(f"--name must be a file name in .glb or .gltf, got {name!r}.")
    run.out_or(Path("out") / "template")
    run.progress("making")
    made = torso(folder, mpfb)
    run.progress("writing")
    write_template(made, run.path(name))
    _describe(run, made)


@command
@click.argument("file", type=_FILE, required=False)
def show(run: Run, file: Path | None) -> None:
    """Draw the template FILE, or the one that ships: front, bones and the shapes it can take."""
    from ..registration.template_picture import draw_template
    from .register import chosen

    run.out_or(Path("out") / "template")
    run.progress("reading")
    shown = chosen(file)
    run.progress("drawing")
    draw_template(run.path("template.png"), shown)
    _describe(run, shown)


def _describe(run: Run, shown: Template) -> None:
    run.result |= {
        "template": shown.name,
        "source": shown.source,
        "vertices": len(shown.points),
        "triangles": len(shown.triangles),
        "bones": [bone.name for bone in shown.bones],
        "blendshapes": list(shown.blendshape_names),
        "landmarks": list(shown.landmarks),
        "curves": list(shown.curves),
        "unit": "m",
        "frame": "LPS",
    }
    run.say(f"{shown.name}: {len(shown.points)} vertices, {len(shown.bones)} bones, "
            f"{len(shown.blendshape_names)} blendshapes, {len(shown.landmarks)} landmarks, "
            f"{len(shown.curves)} curves")  # fmt: skip
    if shown.source:
        run.say(f"source: {shown.source}")


template.add_command(make)
template.add_command(show)
