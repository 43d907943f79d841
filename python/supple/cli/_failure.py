"""What a command leaves where there is no rest shape: where the search ended, to look at.

failure.json  the cause, the load factor reached, the worst cells, the history of iterations
failure.vtu   the last shape in equilibrium, each cell with J against the given shape and its rank
              among the worst (1 the worst, 0 none)
failure.png   the same as a picture
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from .. import __version__
from ..errors import ConvergenceError
from ._json import dumps

if TYPE_CHECKING:
    from ..mesh import Mesh
    from ._run import Run

#: What a good run leaves instead.
RESULTS = ("result.json", "rest.vtu", "loaded.vtu")
FILES = ("failure.json", "failure.png", "failure.vtu")


def leave(run: Run, error: ConvergenceError, mesh: Mesh) -> None:
    """Publish the files above, and nothing else that the run has written; ``mesh`` was given."""
    reached = mesh if error.points is None else mesh.placed(error.points)
    run.drop()
    run.replaces(RESULTS)
    run.path("failure.json").write_text(dumps(_described(error, mesh)) + "\n", encoding="utf-8")
    rank = np.zeros(len(mesh.cells))
    rank[error.cells] = 1.0 + np.arange(len(error.cells))
    ratio = _volume_ratio(mesh, reached)
    reached.write(run.path("failure.vtu"), {"displacement [m]": reached.points - mesh.points},
                  {"rank among the worst cells [1]": rank, "J [1]": ratio})  # fmt: skip
    _draw(run, error, mesh, reached)
    run.keep()


def _described(error: ConvergenceError, mesh: Mesh) -> dict[str, object]:
    return {
        "message": str(error),
        "cause": error.cause,
        "load_factor": error.load_factor,
        "cells": error.cells,
        "shape": "given" if error.points is None else "last equilibrium",
        "mesh": {"nodes": len(mesh.points), "cells": len(mesh.cells), "element": mesh.element},
        "history": error.history,
        "versions": {"supple": __version__},
    }


def _volume_ratio(loaded: Mesh, reached: Mesh) -> npt.NDArray[np.float64]:
    """Volume of each cell under load over that which it has in the shape reached, (c,)."""
    from ..mesh_jacobian import volumes

    before = volumes(reached.points, reached.cells, reached.table)
    after = volumes(loaded.points, loaded.cells, loaded.table)
    ratio = np.full(len(before), np.nan)
    np.divide(after, before, out=ratio, where=before > 0)
    return ratio


def _draw(run: Run, error: ConvergenceError, mesh: Mesh, reached: Mesh) -> None:
    from ..picture import Panel, draw

    share = f"{100 * error.load_factor:.3g} % of the load taken off"
    title = "as given" if error.points is None else f"last equilibrium, {share}"
    panels = [Panel(reached, f"{title};\nworst cells marked", marked=error.cells, ghost=mesh)]
    if error.points is not None:
        panels.insert(0, Panel(mesh, "as given,\nthe loaded shape"))
    draw(run.path("failure.png"), panels, title=f"no rest shape: {error.cause}")
