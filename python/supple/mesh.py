"""The mesh: points, cells of one element in VTK order, and named parts of it."""

from __future__ import annotations

import copy
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import numpy.typing as npt

from supple import mesh_box, mesh_checks, mesh_jacobian, mesh_topology
from supple.errors import InputError, MeshError
from supple.kernels.cells import NO_NODE, Element
from supple.mesh_tags import CellWhere, Tag, Where, chosen, find_tag
from supple.profile import phase

Floats = npt.NDArray[np.float64]
Ints = npt.NDArray[np.int64]

__all__ = ["Mesh", "Tag", "Where"]


@dataclass(frozen=True, eq=False, repr=False)
class Mesh:
    """A checked mesh; its arrays are read-only.

    Attributes:
        points: (n, 3) m.
        cells: (c, nodes per cell) node ids in VTK order.
        element: "P1", "P2" (tetrahedra), "Q1", "Q2", "Q2L" (hexahedra of 8, 20, 27 nodes), "Pr1"
            or "Pr2" (prisms of 6 or 18 nodes).
        tags: name -> Tag.

    Raises:
        MeshError: wrong shapes or ids, NaN, collapsed, duplicate, overlapping, inverted or flat
            cells, nodes of no cell, a tag out of range.
    """

    points: Floats
    cells: Ints
    element: str
    tags: Mapping[str, Tag] = field(default_factory=dict)
    _outside: Ints = field(init=False)  # boundary facets, outward

    @phase("checks")
    def __post_init__(self) -> None:
        table = mesh_checks.checked_element(self.element)
        points = mesh_checks.checked_points(self.points)
        cells = mesh_checks.checked_ids(self.cells, table.nodes, len(points), "cells")
        mesh_checks.check_cells(cells, table, len(points))
        mesh_checks.check_jacobians(points, cells, table)
        facets, uses = mesh_topology.facet_uses(cells, table)
        mesh_checks.check_facets(facets, uses, table)
        tags = mesh_checks.checked_tags(self.tags, table, len(points), len(cells), facets)
        self._set(points=points, cells=cells, tags=tags, _outside=facets[uses == 1])

    def _set(self, **values: object) -> None:
        for name, value in values.items():
            if isinstance(value, np.ndarray):
                value.flags.writeable = False
            object.__setattr__(self, name, value)

    @classmethod
    def box(
        cls,
        cells: Sequence[int],
        size: Sequence[float],
        element: str = "P1",
        origin: Sequence[float] = (0.0, 0.0, 0.0),
    ) -> Mesh:
        """A box from ``origin`` to ``origin + size`` (3,) m, cut into ``cells`` (3,) blocks.

        Tetrahedra: six a block around its 000–111 diagonal; prisms: two along z on either side of
        the 000–110 one. Nodes run fastest along x.
        """
        table = mesh_checks.checked_element(element)
        counts, lengths, corner = np.array(cells), np.array(size, float), np.array(origin, float)
        if counts.shape != (3,) or counts.dtype.kind not in "iu" or counts.min() < 1:
            raise MeshError(f"cells must be three whole numbers of at least 1, got {cells}.")
        if lengths.shape != (3,) or not np.isfinite(lengths).all() or lengths.min() <= 0:
            raise MeshError(f"size must be three lengths above 0 m, got {size}.")
        if corner.shape != (3,):
            raise MeshError(f"origin must be three coordinates in m, got {origin}.")
        nx, ny, nz = counts.tolist()
        parts = mesh_box.box((nx, ny, nz), lengths, corner, table.cell.name)
        mesh = cls(*parts, mesh_topology.of_degree(1, table))
        return mesh if table.degree == 1 else mesh.elevated(element)

    @classmethod
    def read(cls, path: str | Path, unit: str | None = None, element: str | None = None) -> Mesh:
        """Read the volume cells of a file (Gmsh, VTU, VTK, Abaqus, …) and its groups as tags.

        Args:
            path: any format that meshio reads, and Gmsh 1.
            unit: "m", "mm", "cm", "dm", "um" or "in"; may be left out if the file names its unit
                (those that ``write`` makes do).
            element: which cells to keep, where a file has several kinds of volume cell.

        Returns:
            The mesh, m. Nodes of no cell are dropped. Physical groups become tags under their name
            or number; other integer cell data "name" become cell tags "name=value". Where one name
            stands for facets and cells alike, the facets' tag is "name (facets)".

        Raises:
            InputError: missing file, unknown unit. MeshError: unreadable file, no volume cells.
        """
        from supple import mesh_io

        return cls(*mesh_io.read(Path(path), unit, element))

    def write(
        self,
        path: str | Path,
        point_data: Mapping[str, npt.ArrayLike] | None = None,
        cell_data: Mapping[str, npt.ArrayLike] | None = None,
        frame: str = "LPS",
    ) -> Path:
        """Write a VTU file in m with its tags and data (n, …) per node and (c, …) per cell.

        Put units in the names ("displacement [m]"): ParaView shows them beside the colours. Frame
        and unit of the points are the names of field data. The file appears whole or not at all.
        """
        from supple import mesh_io

        return mesh_io.write(self, Path(path), point_data or {}, cell_data or {}, frame)

    @property
    def table(self) -> Element:
        """Node and facet numbering of this mesh's element."""
        return mesh_checks.checked_element(self.element)

    @property
    def volume(self) -> float:
        """Volume, m³, of the curved cells."""
        return float(mesh_jacobian.volumes(self.points, self.cells, self.table).sum())

    @property
    def size(self) -> float:
        """Largest extent along an axis, m."""
        return float(np.ptp(self.points, axis=0).max())

    def quality(self) -> Floats:
        """Mean ratio (c,) of each cell: 1 regular tetrahedron, cube or prism, 0 flat."""
        return mesh_jacobian.mean_ratio(self.points, self.cells, self.table)

    def nodes(self, where: Where) -> Ints:
        """Sorted ids (k,) of the nodes that ``where`` chooses; never empty.

        Args:
            where: callable(points (n, 3) m) -> mask (n,) | node ids | mask (n,) | tag name, which
                stands for all nodes of its cells or facets.
        """
        if isinstance(where, str):
            tag = find_tag(self.tags, where)
            ids = self.cells[tag.ids] if tag.kind == "cells" else tag.ids
            return chosen(ids[ids != NO_NODE], len(self.points), f"nodes of tag {where!r}")
        if callable(where):
            mask = np.asarray(where(self.points))
            if mask.dtype != np.bool_:
                raise InputError(
                    f"`where` must return a mask of {len(self.points)} booleans, got {mask.dtype}."
                )
            return chosen(mask, len(self.points), "nodes")
        return chosen(where, len(self.points), "nodes")

    def cell_ids(self, where: CellWhere) -> Ints:
        """Sorted ids (k,) of the cells that a mask (c,), ids or a tag of cells choose."""
        if isinstance(where, str):
            tag = find_tag(self.tags, where)
            if tag.kind != "cells":
                raise InputError(f"tag {where!r} names {tag.kind}, where cells are expected.")
            return chosen(tag.ids, len(self.cells), f"cells of tag {where!r}")
        return chosen(where, len(self.cells), "cells")

    def boundary(self, where: Where | None = None) -> Ints:
        """Outward boundary facets (f, nodes per facet), VTK order, all of whose nodes are chosen.

        A tag of facets chooses exactly those of its facets that lie on the boundary. Of prisms,
        the triangles' rows end in -1, so that they are as long as the quadrilaterals'.
        """
        if where is None:
            return self._outside
        if isinstance(where, str) and find_tag(self.tags, where).kind == "facets":
            rows = (self._outside, self.tags[where].ids)
            corners = [mesh_topology.facet_corners(facets, self.table) for facets in rows]
            known, own = mesh_topology.corner_groups(*corners)
            mask: npt.NDArray[np.bool_] = np.isin(known, own)
        else:
            nodes = np.append(self.nodes(where), NO_NODE)
            mask = np.all(np.isin(self._outside, nodes), axis=1)
        if not mask.any():
            raise InputError("no boundary facet has all of its nodes in `where`; choose more.")
        return self._outside[mask]

    def placed(self, points: npt.ArrayLike) -> Mesh:
        """Same cells at new points (n, 3) m, unchecked: to look at a result, whatever it is."""
        mesh = copy.copy(self)
        object.__setattr__(mesh, "points", np.array(points, dtype=float))
        return mesh

    def moved(self, points: npt.ArrayLike) -> Mesh:
        """The same cells and tags on other points (n, 3) m, checked for inverted cells."""
        new = mesh_checks.checked_points(points)
        if new.shape != self.points.shape:
            raise MeshError(f"points must have shape {self.points.shape}, got {new.shape}.")
        mesh_checks.check_jacobians(new, self.cells, self.table)
        mesh = object.__new__(Mesh)
        mesh._set(**{**self.__dict__, "points": new})
        return mesh

    def elevated(self, element: str | None = None) -> Mesh:
        """The mesh of degree 2 with nodes at the middles of edges (and of faces and cells).

        P1 → P2, Pr1 → Pr2, and Q1 → Q2 or, if ``element`` says so, Q2L. Point tags take in a new
        node where they hold all corners that it is the middle of.
        """
        table = self.table
        higher = mesh_checks.checked_element(element or mesh_topology.of_degree(2, table))
        if table.degree != 1 or higher.degree != 2 or higher.cell is not table.cell:
            raise MeshError(
                f"only P1, Q1 and Pr1 meshes can be elevated, to P2, Q2 or Q2L and Pr2; "
                f"got {self.element} to {higher.name}."
            )
        points, cells, parents = mesh_topology.elevate(self.points, self.cells, table, higher)
        tags = {}
        for name, tag in self.tags.items():
            ids = tag.ids
            if tag.kind == "facets":
                ids = mesh_topology.elevate_facets(ids, self.cells, table, cells, higher)
            elif tag.kind == "points":
                held = np.concatenate([np.isin(corners, ids).all(axis=1) for corners in parents])
                ids = np.concatenate([ids, len(self.points) + np.flatnonzero(held)])
            tags[name] = Tag(tag.kind, ids)
        return Mesh(points, cells, higher.name, tags)

    def __repr__(self) -> str:
        tags = f", tags {', '.join(self.tags)}" if self.tags else ""
        return f"Mesh({self.element}, {len(self.points)} nodes, {len(self.cells)} cells{tags})"
