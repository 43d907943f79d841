"""Derivatives of a body's residual by everything that it depends on besides its unknowns.

    ∂R/∂(a parameter of its laws or skins) · ∂R/∂X · ∂R/∂(a load)

With K du = -∂R/∂a they give how an equilibrium moves when a changes; see `Body` for R.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from . import terms
from .assembly import unknowns
from .errors import InputError, MaterialError
from .state import Equilibrium, Rest

if TYPE_CHECKING:
    from collections.abc import Iterable

    from scipy.sparse import csr_array

    from .body import Body

Floats = npt.NDArray[np.float64]
Ints = npt.NDArray[np.int64]
#: A term's cells with ∂R/∂… of each (k, rows, cols) and the columns (k, cols) where they belong.
Piece = tuple[Any, Floats, Ints]

_LOADS = ("gravity", "density", "traction", "pressure")


def sensitivity(
    body: Body,
    at: Equilibrium | npt.ArrayLike,
    by: str,
    skin: int | None = None,
    density_of: str = "rest",
) -> csr_array:
    """∂R/∂``by`` at fixed unknowns; R is internal minus external force, N.

    Args:
        at: a `State`, a `Rest` (then R is that of the inverse problem), or u (n, 3) m.
        by: a parameter of the laws (a column a cell, three a cell for a direction); with ``skin``,
            its number, a parameter of that skin or "thickness" (a column a facet); "points" (3n
            columns, the coordinates of the mesh's nodes); "gravity" (3 columns); "density" (a
            column a cell); "traction" (3 columns each) or "pressure" (one each) in the order in
            which they were added.
        skin: number of a skin, None for the body's own laws.
        density_of: as in `Body.rest_shape`.

    Returns:
        csr (dofs, columns), N per unit of ``by``; rows are node-major, those of the pressures of a
        mixed formulation last (m³ per unit).

    Raises:
        MaterialError: no law has that parameter.
        InputError: ``u`` has another shape; "points" of a body on sliding supports; "gravity" or
            "density" of a body whose nodes have masses instead (`Rest.body`).
    """
    from .kernels.unit import SENSITIVITY

    d, inverse = body._description, isinstance(at, Rest)
    flat = unknowns(body, *((at.u, at.pressure) if isinstance(at, Equilibrium) else (at,)))
    built = terms.build(d, inverse, density_of, SENSITIVITY)
    terms.refresh(built, d)
    for term in built.regions:
        if term is not None:
            term.set_scalar_unit(1.0)
    if by == "points":
        pieces, columns = _by_points(built, d, flat), d.mesh.points.size
    elif by in _LOADS and skin is None:
        pieces, columns = _by_load(built, d, flat, by)
    else:
        pieces, columns = _by_parameter(built, d, flat, by, skin)
    return _assembled(pieces, d, flat.size, columns)


def _by_parameter(
    built: terms.Built, d: terms.Description, flat: Floats, by: str, skin: int | None
) -> tuple[list[Piece], int]:
    if skin is None:
        made = [(r, t, r.ids) for r, t in zip(d.regions, built.regions, strict=True) if len(r.ids)]
        count = len(d.mesh.cells)
    else:
        if not 0 <= skin < len(d.skins):
            raise InputError(f"skin must name one of {len(d.skins)} skins, got {skin}.")
        made = [(d.skins[skin], part.term, part.rows) for part in built.skins[skin]]
        count = len(d.skins[skin].ids)
    pieces, size = [], 1
    for owner, term, ids in made:
        if by in owner.values:
            size = owner.values[by].shape[1]
            pieces.append((term, _table(term, f"d_{by}", flat, size), _columns(ids, size)))
    if not pieces:
        from .kernels.reader import nearest

        known = {name for owner, _, _ in made for name in owner.values} | {"points", *_LOADS}
        raise MaterialError(f"by: no law here has a parameter {by}; {nearest(by, known)}")
    return pieces, count * size


def _by_points(built: terms.Built, d: terms.Description, flat: Floats) -> list[Piece]:
    if d.slides:
        raise InputError('by "points" is not offered on a body with sliding supports; remove them.')
    pieces = []
    for term in _kernel_terms(built):
        nodes = term.cells[:, : term.nodes]
        columns = _columns(nodes.astype(np.int64), 3).reshape(len(nodes), -1)
        pieces.append((term, _table(term, "d_points", flat, columns.shape[1]), columns))
    return pieces


def _by_load(
    built: terms.Built, d: terms.Description, flat: Floats, by: str
) -> tuple[list[Piece], int]:
    """R is linear in each load, whose value of a cell is density · gravity or given as it is."""
    if by in ("gravity", "density") and d.masses is not None:
        raise InputError(
            f"by {by!r} wants a body with a density; this one has masses of its nodes, from a rest "
            'shape with density_of="loaded": take the sensitivity of the body that was given there.'
        )
    if by == "gravity":
        force = _table(built.body_force, "d_value", flat, 3) * d.density[:, :, None]
        return [(built.body_force, force, np.tile(np.arange(3), (len(force), 1)))], 3
    if by == "density":
        force = _table(built.body_force, "d_value", flat, 3) @ d.gravity
        return [(built.body_force, force[:, :, None], _columns(np.arange(len(force)), 1))], len(
            force
        )
    made, size = (built.tractions, 3) if by == "traction" else (built.pressures, 1)
    pieces = []
    for number, part in ((k, part) for k, parts in enumerate(made) for part in parts):
        table = _table(part.term, "d_value", flat, size)
        columns = np.tile(number * size + np.arange(size), (len(table), 1))
        pieces.append((part.term, table, columns))
    return pieces, len(made) * size


def _kernel_terms(built: terms.Built) -> Iterable[Any]:
    facets = (part.term for parts in [*built.tractions, *built.pressures, *built.skins]
              for part in parts)  # fmt: skip
    return (term for term in [*built.regions, built.body_force, *facets] if term is not None)


def _table(term: Any, kernel: str, flat: Floats, cols: int) -> Floats:
    """(cells, rows, cols)."""
    out = term.tabulate(kernel, flat)
    return np.asarray(out).reshape(len(out), -1, cols)


def _columns(ids: Ints, size: int) -> Ints:
    """size columns for each id, one after another: (…, size)."""
    return np.asarray(ids[..., None] * size + np.arange(size))


def _assembled(pieces: list[Piece], d: terms.Description, rows: int, columns: int) -> csr_array:
    from scipy.sparse import coo_array, csr_array

    total = csr_array((rows, columns))
    for term, table, column in pieces:
        cells, m = term.cells.astype(np.int64), term.nodes
        vector = _columns(cells[:, :m], 3).reshape(len(cells), -1)
        row = np.hstack([vector, cells[:, m:] + 2 * len(d.mesh.points)])[:, : table.shape[1]]
        where = [
            np.broadcast_to(i, table.shape).ravel() for i in (row[:, :, None], column[:, None])
        ]
        total = total + coo_array((table.ravel(), tuple(where)), shape=(rows, columns)).tocsr()
    return csr_array(total)
