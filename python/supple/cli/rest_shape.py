"""`supple rest-shape`: the shape that a body has without its loads."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from ..errors import InputError
from ._run import Run, command

METHODS = ("inverse", "reversed-gravity")


@command
@click.argument("loaded", metavar="CASE|MESH", type=click.Path(path_type=Path))
@click.option("--method", type=click.Choice(METHODS), default="inverse", show_default=True,
              help="reversed-gravity is approximate, to compare with.")  # fmt: skip
@click.option("--allow-energy-files", is_flag=True, help="Compile energy files that CASE names.")
@click.option("--unit", help="Of the coordinates in MESH: m, mm, cm, ….")
@click.option("--law", help="Name of an energy or path of an energy file; default neo_hookean.")
@click.option("--set", "values", multiple=True, metavar="NAME=VALUE", help="Parameter of the law.")
@click.option("--density", type=float, help="kg/m³; default 1000.")
@click.option("--gravity", nargs=3, type=float, help="x y z in m/s²; default 0 0 -9.81.")
@click.option("--fix", "fixed", multiple=True, metavar="WHERE",
              help="What is held: a tag, or a place such as z=max or z=0.1.")  # fmt: skip
def rest_shape(
    run: Run, loaded: Path, method: str, allow_energy_files: bool, **mesh_options: Any
) -> None:
    """Find the shape without loads of a body that is given as loaded.

    CASE is a TOML file as for `supple solve`, its mesh the loaded shape. For a MESH under gravity
    alone, the options below --allow-energy-files say the rest. Writes rest.vtu and result.json to
    --out (default: out/ and the name of the input).
    """
    from ..case import Table, read_case
    from . import _report
    from ._body_case import read_body

    run.out_or(Path("out") / loaded.stem)
    run.progress("reading")
    if loaded.suffix == ".toml":
        _refuse_options(mesh_options)
        case = read_case(loaded)
    else:
        case, allow_energy_files = Table(_case_of_mesh(loaded, **mesh_options), loaded), True
    body, settings = read_body(case, allow_energy_files=allow_energy_files)
    run.progress("compiling")
    watch = _report.progress(run, "rest shape")
    rest = body.rest_shape(method=method, progress=watch, **settings)
    run.result |= {"method": method, "approximate": method != "inverse"}
    _report.equilibrium(run, rest, body.mesh, "rest.vtu")


def _refuse_options(given: dict[str, Any]) -> None:
    names = {"values": "set", "fixed": "fix"}
    for name, value in given.items():
        if value not in (None, ()):
            raise InputError(f"--{names.get(name, name)} goes with a MESH; a CASE says it itself.")


def _case_of_mesh(
    mesh: Path,
    unit: str | None,
    law: str | None,
    values: tuple[str, ...],
    density: float | None,
    gravity: tuple[float, ...] | None,
    fixed: tuple[str, ...],
) -> dict[str, Any]:
    """The case that the options describe, as its TOML would be read."""
    source = {"file": mesh.name} if unit is None else {"file": mesh.name, "unit": unit}
    name = law or "neo_hookean"
    law_path = str(Path(name).absolute()) if name.endswith(".py") else name
    material = {"law": law_path, "density": 1000.0 if density is None else density}
    return {
        "mesh": source,
        "material": material | dict(_parameter(text) for text in values),
        "fix": [{"where": _place(text)} for text in fixed],
        "gravity": {"acceleration": list(gravity or (0.0, 0.0, -9.81))},
    }


def _parameter(text: str) -> tuple[str, float]:
    name, _, value = text.partition("=")
    number = _number(value)
    if not name or not isinstance(number, float):
        raise InputError(f"--set must be NAME=VALUE, such as young=3e3, got {text!r}.")
    return name, number


def _place(text: str) -> Any:
    """A tag, or {axis: "min", "max" or coordinate} of "axis=..."."""
    axis, equals, value = text.partition("=")
    return {axis: _number(value)} if equals else text


def _number(text: str) -> float | str:
    try:
        return float(text)
    except ValueError:
        return text
