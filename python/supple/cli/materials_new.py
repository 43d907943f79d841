"""`supple materials new`: a first energy file."""

from __future__ import annotations

from pathlib import Path

import click

from ._run import Run, command


@command
@click.argument("file", type=click.Path(path_type=Path))
def new(run: Run, file: Path) -> None:
    """Write FILE, an energy that works as it is, to be changed. An existing file stays."""
    from ..author import template

    written = template.write(file)
    run.result["file"] = written
    run.say(f"wrote {written}; try it with: supple materials check {written}")
