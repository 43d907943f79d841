"""Why a solve stopped without a result, in words: cause, how far it came, what could change it."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from .errors import ConvergenceError, MeshError
from .mesh_checks import some
from .mesh_jacobian import smallest_jacobian
from .newton import as_dict

if TYPE_CHECKING:
    from .mesh import Mesh
    from .state import Rest
    from .terms import Built, Description

_CAUSES = {
    "unstable": "unstable equilibrium: a small push leaves it (buckling)",
    "inverted": "collapsed cell: the load presses it flat before the whole load is on",
    "singular": "singular stiffness: a part is not held or has no stiffness",
    "limit_point": "limit point: the path of equilibria turns back before the whole load is on",
    "stalled": "the path of equilibria is lost before the whole load is on",
}
_CAUSES_INVERSE = {
    "unstable": "unstable: a push moves the given shape away from its place (too soft)",
    "inverted": "a cell collapses before the whole load is off (too soft)",
    "limit_point": "limit point: the path turns back before the whole load is off (too soft)",
    "stalled": "the path is lost before the whole load is off",
}
#: What there is not, by the method that was to find it.
_WHAT = {
    "": "no equilibrium",
    "inverse": "no rest shape",
    "reversed-gravity": "no equilibrium under reversed loads, which tells nothing of rest shapes",
}


def require_converged(
    result: Any, built: Built, description: Description, method: str = ""
) -> None:
    """Raise for a result that is no stable equilibrium under the whole load.

    Args:
        method: that was to find a rest shape, "inverse" or "reversed-gravity"; else nothing.

    Raises:
        ConvergenceError: cause, load factor, worst cells, history, points.
    """
    name = result.outcome.name
    if name == "converged":
        return
    inverse = method == "inverse"
    cause = (_CAUSES_INVERSE if inverse else {}).get(name, _CAUSES[name])
    u = result.u[: description.mesh.points.size].reshape(-1, 3)
    points = description.mesh.points + u
    pressed = inverse and name == "inverted"
    cells = pressed_cells(description.mesh, points) if pressed else None
    cells = cells or worst_cells(result, built, description)
    raise ConvergenceError(
        f"{_WHAT[method]}: {cause}; "
        f"{100 * result.load_factor:.4g} % of the load was reached, "
        f"worst cells {cells[:3]}; {advice(name, result.load_factor)}.",
        history=[as_dict(i) for i in result.history],
        cells=cells,
        load_factor=result.load_factor,
        cause=cause,
        points=points,
    )


def advice(outcome: str, reached: float) -> str:
    """What could change a failure; forces over moduli are all that counts where both scale."""
    if outcome == "singular":
        return "hold every part, or give it stiffness"
    if not 0 < reached < 1:
        return "try a smaller load, a stiffer material or a finer mesh"
    mesh = " or a finer mesh" if outcome in ("inverted", "stalled") else ""
    return (
        f"try moduli about {1.05 / reached:.3g} times as large, {100 * reached:.3g} % of the load, "
        f"a stiffer skin{mesh}"
    )


def require_usable(rest: Rest) -> None:
    """Refuse a rest shape with cells that are inside out between the quadrature points.

    Raises:
        ConvergenceError: the cells.
    """
    try:
        _ = rest.mesh
    except MeshError:
        causes = _CAUSES if rest.method == "reversed-gravity" else _CAUSES_INVERSE
        cause, cells = causes["inverted"], inverted(rest)
        what = _WHAT.get(rest.method, _WHAT["inverse"])
        raise ConvergenceError(
            f"{what}: {cause}; in the shape found cells {some(cells)} are inside out at "
            "their corners; try a smaller load, a stiffer material, a skin or a finer mesh.",
            history=rest.history,
            cells=cells,
            load_factor=1.0,
            cause=cause,
            points=rest.points,
        ) from None


def inverted(rest: Rest) -> list[int]:
    """Cells of the rest shape that are inside out or flat at a corner, worst first."""
    mesh = rest.loaded
    smallest = smallest_jacobian(rest.points, mesh.cells, mesh.table)
    worst = np.argsort(smallest, kind="stable")
    return [int(c) for c in worst if smallest[c] <= 0]


def pressed_cells(mesh: Mesh, points: npt.NDArray[np.float64], count: int = 5) -> list[int]:
    """Cells whose smallest Jacobian fell most on the way to ``points``, the worst first."""
    before = smallest_jacobian(mesh.points, mesh.cells, mesh.table)
    after = smallest_jacobian(points, mesh.cells, mesh.table)
    return [int(c) for c in np.argsort(after / before, kind="stable")[:count]]


def worst_cells(result: Any, built: Built, description: Description, count: int = 5) -> list[int]:
    """Cells of the mesh: the most compressed one, then those around the largest residual."""
    cells: list[int] = []
    if result.worst.value <= 0:
        terms = [
            r for r, t in zip(description.regions, built.regions, strict=True) if t is not None
        ]
        cells.append(int(terms[result.worst.term].ids[result.worst.cell]))
    if len(result.last_residual):
        n = description.mesh.points.size
        size: npt.NDArray[np.float64] = np.linalg.norm(
            result.last_residual[:n].reshape(-1, 3), axis=1
        )
        around = np.nan_to_num(size, nan=np.inf)[description.mesh.cells].max(axis=1)
        cells += [int(c) for c in np.argsort(-around, kind="stable")[:count] if c not in cells]
    return cells[:count]
