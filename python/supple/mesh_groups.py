"""Physical groups, sets and integer cell data of a mesh file as tags."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
import numpy.typing as npt

from supple.kernels.cells import FACETS, Element
from supple.mesh_tags import Kind, Tag
from supple.mesh_topology import padded

Ints = npt.NDArray[np.int64]
Part = tuple[Kind, str, Ints]

#: More values than this are no groups: ids of cells, of parent nodes, …
_MOST_VALUES = 256
_SKIPPED = ("gmsh:physical", "gmsh:geometrical", "gmsh:dim_tags", "gmsh:bounding_entities")


def groups_of(raw: Any, table: Element) -> dict[str, Tag]:
    """Tags of a meshio.Mesh of which the cells of ``table`` are kept; the file's node ids."""
    parts: dict[tuple[Kind, str], list[Ints]] = {}
    for kind, name, ids in _parts(raw, table):
        parts.setdefault((kind, name), []).append(ids)
    strongest = {name: kind for kind, name in sorted(parts, key=_rank, reverse=True)}
    tags = {}
    for (kind, name), pieces in parts.items():
        label = name if strongest[name] == kind else f"{name} ({kind})"
        tags[label] = Tag(kind, _together(pieces))
    return tags


def _rank(part: tuple[Kind, str]) -> int:
    """Who takes a name that several kinds bear: cells, then facets, then points."""
    return ("cells", "facets", "points").index(part[0])


def _together(ids: list[Ints]) -> Ints:
    """One array from several, without repeats."""
    if ids[0].ndim == 1:
        return np.unique(np.concatenate(ids)).astype(np.int64)
    rows = np.vstack(ids).astype(np.int64)
    first = np.unique(rows, axis=0, return_index=True)[1]
    return rows[np.sort(first)]


def _parts(raw: Any, table: Element) -> Iterator[Part]:
    """Every named part, in pieces."""
    yield from _from_fields(raw)
    facets = [FACETS[kind].meshio for kind in table.facet_elements]
    first = 0
    for number, block in enumerate(raw.cells):
        for name, mask in _named(raw, number):
            if block.type == table.meshio:
                yield "cells", name, first + np.flatnonzero(mask)
            elif block.type in facets:
                yield "facets", name, padded(block.data[mask], table)
            elif block.type == "vertex":
                yield "points", name, block.data[mask].ravel()
        first += len(block.data) if block.type == table.meshio else 0


def _from_fields(raw: Any) -> Iterator[Part]:
    """Sets of points, and what ``Mesh.write`` keeps in point and field data."""
    for name, ids in raw.point_sets.items():
        yield "points", name, np.asarray(ids, dtype=np.int64).ravel()
    for name, values in raw.point_data.items():
        if name.startswith("tag:"):
            yield "points", name[4:], np.flatnonzero(values)
    for name, rows in raw.field_data.items():
        if name.startswith("facets:"):
            yield "facets", name[7:], np.atleast_2d(rows)


def _named(raw: Any, number: int) -> Iterator[tuple[str, npt.NDArray[np.bool_]]]:
    """Names and masks of the groups of block ``number``."""
    block = raw.cells[number]
    for name, sets in raw.cell_sets.items():
        if name not in _SKIPPED and sets[number] is not None and len(sets[number]):
            yield name, np.isin(np.arange(len(block.data)), sets[number])
    for name, blocks in raw.cell_data.items():
        values = np.asarray(blocks[number])
        if values.ndim != 1 or values.dtype.kind not in "iu" or not len(values):
            continue
        if name.startswith("tag:"):
            yield name[4:], values != 0
        elif name == "gmsh:physical":
            yield from _physical(raw, values, block.dim)
        elif name not in _SKIPPED and len(np.unique(values)) <= _MOST_VALUES:
            for value in np.unique(values):
                yield f"{name}={value}", values == value


def _physical(raw: Any, values: Ints, dim: int) -> Iterator[tuple[str, npt.NDArray[np.bool_]]]:
    """Gmsh's physical groups, by name where the file has one; 0 stands for none."""
    names = {tuple(map(int, v)): k for k, v in raw.field_data.items() if np.shape(v) == (2,)}
    for value in np.unique(values[values != 0]):
        yield names.get((int(value), dim), str(value)), values == value
