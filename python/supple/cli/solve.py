"""`supple solve`: the equilibrium of a body under the loads of a case."""

from __future__ import annotations

from pathlib import Path

import click

from ..choices import SYMMETRIC_SOLVERS
from ._run import Run, command


@command
@click.argument("case", type=click.Path(path_type=Path))
@click.option(
    "--solver",
    type=click.Choice(SYMMETRIC_SOLVERS),
    default="auto",
    show_default=True,
    help="Of the linear equations; result.json says which auto took and why.",
)
@click.option("--allow-energy-files", is_flag=True, help="Compile energy files that CASE names.")
def solve(run: Run, case: Path, solver: str, allow_energy_files: bool) -> None:
    r"""Solve for the deformed shape of the body in CASE, a TOML file.

    Writes deformed.vtu and result.json to --out (default: out/ and the name of CASE). Tables of a
    case, lengths in m, all else in SI:

    \b
      [mesh]       file = "beam.msh", unit = "mm"
      [mesh.box]   cells = [8, 2, 2], size = [0.08, 0.02, 0.02], element = "Q1"
      [material]   law = "neo_hookean", density = 1000.0, young = 3e3, poisson = 0.3
                   formulation = "mixed" or "mean-dilatation", quadrature = 4 (degree)
      [[region]]   where, law and its parameters: another law on some cells
      [skin]       where, law, thickness = 2e-3 and the law's parameters
      [[fix]]      where = { x = "min" }
      [[prescribe]] where, metre = [0.0, 0.0, 1e-3]
      [[force]]    where, newton = [0.0, 0.0, -1.0]      on each node
      [[traction]] where, pascal = [0.0, 0.0, -10.0]
      [[pressure]] where, pascal = 10.0
      [gravity]    acceleration = [0.0, 0.0, -9.81]
      [solve]      load_steps, rtol, max_iterations

    \b
    where = "base"                       a tag of the mesh
          = [0, 4, 17]                   ids
          = { z = "max", x = [0, 0.1] }  a place: an end, a coordinate, an interval
    """
    from ..case import read_case
    from . import _report
    from ._body_case import read_body

    run.out_or(Path("out") / case.stem)
    run.progress("reading")
    body, settings = read_body(read_case(case), allow_energy_files=allow_energy_files)
    run.progress("compiling")
    progress = _report.progress(run, "solving")
    state = body.solve(solver=solver, progress=progress, **settings)
    _report.equilibrium(run, state, body.mesh, "deformed.vtu")
