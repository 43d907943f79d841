"""Point values → node values: the least-squares fit by the element's continuous functions."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from . import terms
from .core import core
from .errors import SuppleError
from .mesh_jacobian import jacobians

if TYPE_CHECKING:
    from .mesh import Mesh

Floats = npt.NDArray[np.float64]

#: Of the right-hand side: far below what a projection of point values can mean.
_TOLERANCE = 1e-13


def to_nodes(mesh: Mesh, rest: Floats, places: Floats, values: Floats) -> Floats:
    """∫ N (Σ N f - value) dV = 0 for every shape function N; NaN where a node has no cell.

    Between its points a cell's value is their polynomial fit, since too few points integrate N.

    Args:
        mesh: cells and element.
        rest: (n, 3) m, its nodes at rest.
        places: (q, 3) points in the reference cell.
        values: (c, q, …) there.

    Returns:
        (n, …) the node values f.

    Raises:
        SuppleError: the mass matrix could not be solved with: the rest shape is inverted.
    """
    system = core().System(np.ascontiguousarray(rest).ravel(), [])
    term = terms.mass_term(system, mesh)
    rhs, used = _loads(mesh, rest, term, places, values), np.unique(mesh.cells)
    nodes = np.full_like(rhs, np.nan)
    nodes[used] = _solved(_mass(mesh, rest, term)[used][:, used], rhs[used])
    return nodes.reshape(len(rest), *values.shape[2:])


def _loads(mesh: Mesh, rest: Floats, term: Any, places: Floats, values: Floats) -> Floats:
    """∫ N value dV (n, k) by the rule of the mass matrix."""
    at = term.quadrature
    dets = [np.linalg.det(jacobians(rest, mesh.cells, mesh.table, x)) for x in at]
    carried = mesh.table.carried(places, at)
    flat = np.einsum("rq,cqk->crk", carried, values.reshape(*values.shape[:2], -1))
    volume = np.abs(np.stack(dets, axis=1)) * term.weights
    load = np.einsum("cr,ra,crk->cak", volume, mesh.table.values(at), flat)
    rhs = np.zeros((len(rest), flat.shape[2]))
    np.add.at(rhs, mesh.cells, load)
    return rhs


def _mass(mesh: Mesh, rest: Floats, term: Any) -> Any:
    from scipy.sparse import coo_array

    m, n = mesh.cells.shape[1], len(rest)
    blocks = term.tabulate("mass", np.zeros(3 * n)).reshape(-1, m, m)
    cells = np.asarray(term.cells)
    rows, columns = np.broadcast_arrays(cells[:, :, None], cells[:, None, :])
    return coo_array((blocks.ravel(), (rows.ravel(), columns.ravel())), shape=(n, n)).tocsr()


def _solved(mass: Any, rhs: Floats) -> Floats:
    """Conjugate gradients with the diagonal: a mass matrix's condition has no mesh size in it."""
    from scipy.sparse import diags_array
    from scipy.sparse.linalg import cg

    diagonal = diags_array(1 / mass.diagonal())
    columns = []
    for b in rhs.T:
        x, failed = cg(mass, b, rtol=_TOLERANCE, M=diagonal)
        if failed:
            raise SuppleError("values cannot be projected onto the nodes: inverted cells at rest.")
        columns.append(x)
    return np.stack(columns, axis=1)
