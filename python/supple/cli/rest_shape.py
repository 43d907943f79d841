"""`supple rest-shape`: the shape that a body has without its loads.

CASE or MESH ─► body ─► rest shape ─► rest.vtu, loaded.vtu ─► loaded again ─► result.json
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import click

from ..choices import METHODS, SOLVERS, STATES
from ..errors import ConvergenceError, InputError
from ..profile import phase
from . import _profile
from ._run import Run, command

if TYPE_CHECKING:
    from ..body import Body
    from ..state import Rest

Work = TypeVar("Work", bound=Callable[..., Any])

#: What may lie behind a rest shape that does not come back.
_WHY = {
    "another equilibrium": "it has several stable shapes under this load, and this is another one",
    "unstable": "the given shape is an equilibrium that a push would leave",
    "no equilibrium": "the given shape is no equilibrium of it",
}
_NAMES = {"values": "set", "fixed": "fix"}  # of options that are called otherwise here


def _choice(name: str, choices: tuple[str, ...], meaning: str) -> Callable[[Work], Work]:
    """An option that is the first of ``choices`` unless given."""
    return click.option(
        name, type=click.Choice(choices), default=choices[0], show_default=True, help=meaning
    )


@command
@click.argument("loaded", metavar="CASE|MESH", type=click.Path(path_type=Path))
@_choice("--method", METHODS, "reversed-gravity is approximate, to compare with: its check fails.")
@_choice("--density-of", STATES, "The state that the density counts in.")
@_choice("--directions-of", STATES, "The state in which the law's fibres lie as given.")
@_choice("--solver", SOLVERS, "Of the unsymmetric tangents: gmres, or direct (LU); auto chooses.")
@click.option(
    "--check/--no-check",
    default=True,
    show_default=True,
    help="Load the rest shape again and compare with what was given.",
)
@click.option("--check-overlap", is_flag=True, help="Refuse a rest shape that lies in itself.")
@click.option("--allow-energy-files", is_flag=True, help="Compile energy files that CASE names.")
@_profile.option
@click.option("--unit", help="Of the coordinates in MESH: m, mm, cm, ….")
@click.option("--element", help="Cells to keep of a MESH with several kinds: P1, Q1, ….")
@click.option("--law", help="Name of an energy or path of an energy file; default neo_hookean.")
@click.option(
    "--set",
    "values",
    multiple=True,
    metavar="NAME=VALUE",
    help="Parameter of the law: young=3e3 or fibre=1,0,0.",
)
@click.option("--density", type=float, help="kg/m³; default 1000.")
@click.option("--formulation", help="displacement (default), mixed or mean-dilatation.")
@click.option("--quadrature", type=int, help="Degree of the stiffness' rule.")
@click.option("--gravity", nargs=3, type=float, help="x y z in m/s²; default 0 0 -9.81.")
@click.option(
    "--fix",
    "fixed",
    multiple=True,
    metavar="WHERE",
    help="What is held: a tag, or a place in m: z=max, z=0.1, x=0:0.1,y=min.",
)
@click.option("--load-steps", type=int, help="Equal load steps; adaptive unless given.")
@click.option("--rtol", type=float, help="Residual over load; default 1e-10.")
@click.option("--max-iterations", type=int, help="Of each load step; default 25.")
def rest_shape(
    run: Run,
    loaded: Path,
    method: str,
    density_of: str,
    directions_of: str,
    solver: str,
    check: bool,
    check_overlap: bool,
    allow_energy_files: bool,
    profiled: bool,
    **mesh_options: Any,
) -> None:
    r"""Find the shape without loads of a body that is given as loaded.

    CASE is a TOML file as for `supple solve`, its mesh the loaded shape. For a MESH under gravity
    alone, the options below --allow-energy-files say the rest. Writes to --out (default: out/ and
    the name of the input)

    \b
      rest.vtu     the rest shape with its tags
      loaded.vtu   the given shape and what it carries, where a later simulation starts: per cell
                   F, J and the Cauchy stress, per node the displacement to the rest shape
      result.json  numbers, with the check: loaded again, the rest shape must be the given one to
                   a millionth of its size (else exit 3)

    Where there is no rest shape it exits with 3 and writes failure.json, failure.vtu and
    failure.png instead: the last equilibrium on the way, with the worst cells marked.
    """  # fmt: skip
    run.out_or(Path("out") / loaded.stem)
    run.progress("reading")
    asked: dict[str, Any] = {
        "method": method,
        "density_of": density_of,
        "directions_of": directions_of,
        "solver": solver,
        "check_overlap": check_overlap,
    }
    with _profile.collecting(profiled) as profile:
        with phase("imports"):
            from . import _report
            from ._body_case import read_body
        with phase("reading"):
            case, allowed = _case(loaded, mesh_options, allow_energy_files)
            body, settings = read_body(case, allow_energy_files=allowed)
        rest = _found(run, body, asked, settings)
        with phase("writing"):
            _report.equilibrium(run, rest, body.mesh, "rest.vtu")
            rest.write_loaded(run.path("loaded.vtu"))
        if check:
            _check(run, rest, settings)
    _profile.report(run, profile, rest)


def _found(run: Run, body: Body, asked: dict[str, Any], settings: dict[str, Any]) -> Rest:
    """The rest shape; where there is none, what is left of the search is written."""
    from . import _failure, _report

    run.progress("compiling")
    watch = _report.progress(run, "rest shape")
    try:
        rest = body.rest_shape(progress=watch, **asked, **settings)
    except ConvergenceError as error:
        _failure.leave(run, error, body.mesh)
        raise
    run.replaces(_failure.FILES)
    run.result |= asked | {
        "approximate": asked["method"] == "reversed-gravity",
        "size_m": body.mesh.size,
    }
    return rest


def _case(loaded: Path, mesh_options: dict[str, Any], allow_energy_files: bool) -> tuple[Any, bool]:
    """The case of a TOML file, or of a mesh file and the options, and whether it may name files."""
    from ..case import read_case
    from ._options_case import case_of

    if loaded.suffix != ".toml":
        return case_of(loaded, mesh_options), True
    for name, value in mesh_options.items():
        if value not in (None, ()):
            option = _NAMES.get(name, name).replace("_", "-")
            raise InputError(f"--{option} goes with a MESH; a CASE says it itself.")
    return read_case(loaded), allow_energy_files


def _check(run: Run, rest: Rest, settings: dict[str, Any]) -> None:
    """Load the rest shape again; what is farther off than `CLOSES` makes the result doubtful."""
    from ..rest_check import round_trip
    from . import _report

    watch = _report.progress(run, "loading again")
    try:
        found = round_trip(rest, progress=watch, **settings)
    except ConvergenceError as error:
        run.result["check"] = {"passed": False, "cause": error.cause}
        run.doubt(f"loaded again, the rest shape does not come back: {error}")
        return
    run.result["check"] = {
        "passed": found.given == "reached",
        "given_shape": found.given,
        "largest_distance_m": found.distance,
        "relative_distance": found.relative,
        "iterations": found.state.iterations,
        "seconds": found.seconds,
    }
    misses = f"{1e3 * found.distance:.3g} mm, {found.relative:.2g} of its size"
    run.say(f"loaded again it misses the given shape by {misses} ({found.seconds:.2g} s)")
    if found.given != "reached":
        run.doubt(
            f"loaded again, the rest shape misses the given one by {misses}: {_WHY[found.given]}"
        )
