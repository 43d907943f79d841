"""What a solved body amounts to: in numbers for result.json, in one line for people."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np

from .. import __version__
from ..errors import ConvergenceError, MeshError
from ..mesh_checks import some
from ._run import Run

if TYPE_CHECKING:
    from ..mesh import Mesh
    from ..state import Equilibrium


def progress(run: Run, stage: str) -> Callable[[dict[str, float]], None]:
    """A hook for `Body.solve` that shows how much of the load is on."""
    return lambda iteration: run.progress(stage, iteration["load_factor"])


def equilibrium(run: Run, found: Equilibrium, mesh: Mesh, file: str) -> None:
    """Write the shape to `file` and fill the result of a run; an inverted cell makes it doubtful.

    Raises:
        ConvergenceError: the shape is so distorted that it is no mesh any more.
    """
    run.progress("writing")
    try:
        found.write(run.path(file))
    except MeshError as error:
        cause = "inverted cell"
        raise ConvergenceError(
            f"the shape found is not to be used: {error}", cause=cause
        ) from error
    ratio, stress = found.volume_ratio(), found.von_mises()
    distance, warnings = np.linalg.norm(found.u, axis=1), [*found.warnings, *_doubtful_cells(mesh)]
    run.result |= {
        "unit": "m",
        "frame": "LPS",
        "mesh": {"nodes": len(mesh.points), "cells": len(mesh.cells), "element": mesh.element},
        "max_displacement_m": distance.max(),
        "min_volume_ratio": ratio.min(),
        "max_von_mises_pa": stress.max(),
        "reaction_n": found.reactions.sum(axis=0),
        "energy_j": found.energy,
        "iterations": found.iterations,
        "seconds": {name: t for name, t in found.timings.items() if name != "solver"},
        "solver": found.timings["solver"],
        "warnings": warnings,
        "versions": {"supple": __version__},
    }
    for warning in warnings:
        run.say(f"warning: {warning}")
    run.say(
        f"largest displacement {1e3 * distance.max():.4g} mm, smallest volume ratio "
        f"{ratio.min():.3g}, largest von Mises stress {stress.max():.4g} Pa, "
        f"{found.iterations} iterations in {found.timings['total']:.2g} s"
    )
    if ratio.min() <= 0:
        cell = int(ratio.argmin())
        run.doubt(f"cell {cell} is turned inside out (volume ratio {ratio.min():.3g})")


def _doubtful_cells(mesh: Mesh) -> list[str]:
    """A warning if cells of the given mesh lie in each other."""
    from ..overlap import turned_over

    cells = turned_over(mesh)
    if not len(cells):
        return []
    return [
        f"cells {some(cells)} lie on the same side of a facet as their neighbours, so the mesh "
        "overlaps itself there; mesh again."
    ]
