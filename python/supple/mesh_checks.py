"""What a mesh must be before anything is computed; each fault is a sentence with its remedy."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import numpy.typing as npt

from supple.errors import MeshError
from supple.kernels.cells import ELEMENTS, FACETS, NO_NODE, Element
from supple.mesh_jacobian import smallest_jacobian, volumes
from supple.mesh_tags import Tag
from supple.mesh_topology import corner_groups, facet_corners, groups

Floats = npt.NDArray[np.float64]
Ints = npt.NDArray[np.int64]

#: Relative det dX/dξ up to which a cell counts as flat: rounding of coordinates, nothing physical.
_FLAT = 1e-12


def some(ids: npt.ArrayLike, limit: int = 5) -> str:
    """The first ids of a list for a message: ``3, 17, 20, 21, 30 and 4 more``."""
    every = np.atleast_1d(ids)
    shown = ", ".join(str(i) for i in every[:limit])
    return shown + (f" and {len(every) - limit} more" if len(every) > limit else "")


def checked_element(element: str) -> Element:
    """The table of an element by name."""
    if element not in ELEMENTS:
        raise MeshError(f"element must be one of {', '.join(ELEMENTS)}, got {element!r}.")
    return ELEMENTS[element]


def checked_points(points: npt.ArrayLike, argument: str = "points") -> Floats:
    """A copy (n, 3) of finite coordinates."""
    try:
        result = np.array(points, dtype=np.float64)
    except (TypeError, ValueError) as error:
        raise MeshError(f"{argument} must be numbers of shape (n, 3): {error}.") from None
    if result.ndim != 2 or result.shape[1] != 3 or not len(result):
        raise MeshError(f"{argument} must have shape (n, 3), got {result.shape}.")
    bad = np.flatnonzero(~np.isfinite(result).all(axis=1))
    if len(bad):
        raise MeshError(
            f"{argument} must be finite, but {argument} {some(bad)} hold NaN or infinity; "
            "repair or remove them."
        )
    return result


def checked_ids(ids: npt.ArrayLike, columns: int, limit: int, argument: str) -> Ints:
    """A copy (n, columns) of node ids in [0, limit)."""
    raw = np.asarray(ids)
    if raw.ndim != 2 or raw.shape[1] != columns:
        raise MeshError(f"{argument} must have shape (n, {columns}), got {raw.shape}.")
    if raw.dtype.kind not in "iu":
        raise MeshError(f"{argument} must be integer node ids, got {raw.dtype}.")
    bad = np.flatnonzero(((raw < 0) | (raw >= limit)).any(axis=1))
    if len(bad):
        raise MeshError(
            f"{argument} {some(bad)} name nodes outside 0 to {limit - 1}; number nodes from 0."
        )
    return raw.astype(np.int64)


def check_cells(cells: Ints, element: Element, nodes: int) -> None:
    """Refuse no cells, cells with repeated nodes, duplicate cells and nodes of no cell."""
    if not len(cells):
        raise MeshError("cells must hold at least one cell, got none.")
    ordered = np.sort(cells, axis=1)
    bad = np.flatnonzero((ordered[:, 1:] == ordered[:, :-1]).any(axis=1))
    if len(bad):
        raise MeshError(f"cells {some(bad)} name a node twice; remove these collapsed cells.")
    group = groups(ordered)
    if group.max() + 1 < len(cells):
        first = np.unique(group, return_index=True)[1]
        bad = np.setdiff1d(np.arange(len(cells)), first)
        raise MeshError(f"cells {some(bad)} repeat an earlier cell; remove the duplicates.")
    unused = np.flatnonzero(np.bincount(cells.ravel(), minlength=nodes) == 0)
    if len(unused):
        raise MeshError(
            f"{len(unused)} of {nodes} nodes ({some(unused)}) belong to no cell and would have no "
            "stiffness; remove them (Mesh.read does)."
        )


def check_facets(facets: Ints, uses: Ints, element: Element) -> None:
    """Refuse a facet that more than two cells share: cells overlap there."""
    bad = np.flatnonzero(uses > 2)
    if len(bad):
        raise MeshError(
            f"cells {some(np.unique(bad // len(element.facets)))} share a facet with two or more "
            "other cells, so they overlap; remove the extra cells."
        )


def check_jacobians(points: Floats, cells: Ints, element: Element) -> None:
    """Refuse cells whose map from the reference cell turns inside out or flattens anywhere."""
    smallest = smallest_jacobian(points, cells, element)
    inverted = np.flatnonzero(smallest < -_FLAT)
    if len(inverted) and (volumes(points, cells, element) < 0).all():
        raise MeshError(
            "every cell is inverted: the nodes are not in VTK order (or one axis is mirrored); "
            "reorder the nodes of each cell."
        )
    if len(inverted):
        raise MeshError(
            f"cells {some(inverted)} are inverted at a corner or inside (det dX/dξ < 0); put their "
            "nodes in VTK order or mesh again."
        )
    flat = np.flatnonzero(smallest <= _FLAT)
    if len(flat):
        raise MeshError(f"cells {some(flat)} have no volume (det dX/dξ = 0); remove or mesh again.")


def checked_tags(
    tags: Mapping[str, Tag], element: Element, nodes: int, cells: int, facets: Ints
) -> dict[str, Tag]:
    """The same tags with read-only ids, each in range, facets being facets of the cells."""
    result = {}
    for name, tag in tags.items():
        if not isinstance(tag, Tag):
            raise MeshError(
                f"tag {name!r} must be a supple.Tag(kind, ids), got {type(tag).__name__}."
            )
        argument = f"ids of tag {name!r}:"
        if tag.kind == "facets":
            ids = _checked_facets(tag.ids, element, nodes, argument)
            corners = [facet_corners(block, element) for block in (facets, ids)]
            known, own = corner_groups(*corners)
            bad = np.flatnonzero(~np.isin(own, known))
            if len(bad):
                raise MeshError(f"{argument} {some(bad)} are facets of no cell; remove them.")
        else:
            limit = nodes if tag.kind == "points" else cells
            ids = np.unique(checked_ids(np.reshape(tag.ids, (-1, 1)), 1, limit, argument))
        ids.flags.writeable = False
        result[str(name)] = Tag(tag.kind, ids)
    return result


def _checked_facets(ids: npt.ArrayLike, element: Element, nodes: int, argument: str) -> Ints:
    """A copy (f, most nodes) of facets; only rows of a narrower kind may end in NO_NODE."""
    width = element.facets.shape[1]
    if len(element.facet_elements) == 1:
        return checked_ids(ids, width, nodes, argument)
    given = np.asarray(ids) != NO_NODE
    rows = checked_ids(np.where(given, ids, 0), width, nodes, argument)
    rows[~given] = NO_NODE
    counts = given.sum(axis=1)
    known = [FACETS[kind].nodes for kind in element.facet_elements]
    gap = (given[:, 1:] & ~given[:, :-1]).any(axis=1)
    bad = np.flatnonzero(gap | ~np.isin(counts, known))
    if len(bad):
        raise MeshError(
            f"{argument} {some(bad)} must hold {' or '.join(map(str, known))} nodes and then "
            f"{NO_NODE} up to {width} columns."
        )
    return rows
