"""Supports: whether they hold the body, and how a region's compliance is shared by its nodes."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from .core import core
from .errors import InputError
from .mesh_topology import by_kind
from .profile import phase

if TYPE_CHECKING:
    from .mesh import Mesh

Floats = npt.NDArray[np.float64]
Ints = npt.NDArray[np.int64]

_MOTIONS = ("shift along x", "shift along y", "shift along z",
            "turn about x", "turn about y", "turn about z")  # fmt: skip


@phase("checks")
def require_held(mesh: Mesh, fixed: npt.NDArray[np.bool_], normals: dict[int, Floats]) -> None:
    """Refuse a body with a rigid motion that no support resists.

    Args:
        fixed: (n, 3) prescribed dofs.
        normals: node → unit normal (3,) along which a sliding support holds it.

    Raises:
        InputError: names the free motion, piece by piece where the mesh has several.
    """
    for piece in pieces(mesh):
        inside = np.zeros(len(mesh.points), dtype=bool)
        inside[piece] = True
        modes = _rigid_modes(mesh.points - mesh.points[piece].mean(axis=0), mesh.size)
        rows = [modes[fixed & inside[:, None]]]
        rows += [(normal @ modes[node])[None] for node, normal in normals.items() if inside[node]]
        held = np.vstack([*rows, np.zeros((6, 6))])
        _, size, directions = np.linalg.svd(held, full_matrices=False)
        rank = int((size > 1e-6 * max(size[0], 1.0)).sum())
        if rank < 6:
            free = directions[rank]
            motion = _MOTIONS[int(np.abs(free).argmax())]
            what = (
                "the body" if len(piece) == len(mesh.points) else f"a piece of {len(piece)} nodes"
            )
            raise InputError(
                f"{what} is not held: nothing resists a {motion}; fix or support more nodes."
            )


def pieces(mesh: Mesh) -> list[Ints]:
    """Node ids of each connected piece of the mesh."""
    label = core().connected_pieces(len(mesh.points), mesh.cells)
    return [np.flatnonzero(label == k) for k in range(int(label.max()) + 1)]


def node_shares(mesh: Mesh, nodes: Ints) -> Floats:
    """Share (k,) of each node in the area of the boundary facets between ``nodes``; sums to 1.

    Raises:
        InputError: no boundary facet has all of its nodes there.
    """
    total, facets = np.zeros(len(mesh.points)), mesh.boundary(nodes)
    for kind, rows in by_kind(facets, mesh.table):
        own = facets[rows, : kind.nodes]
        area = _flat_areas(mesh.points[own[:, : kind.corners]])
        np.add.at(total, own, np.repeat(area[:, None] / kind.nodes, kind.nodes, axis=1))
    share = total[nodes] / total[nodes].sum()
    if (share == 0).any():
        raise InputError(
            f"slide: {int((share == 0).sum())} of {len(nodes)} nodes belong to no boundary facet "
            "inside the chosen region; choose whole facets."
        )
    return np.asarray(share)


def _flat_areas(corners: Floats) -> Floats:
    """Areas (f,) of flat triangles (f, 3, 3) or quadrilaterals (f, 4, 3)."""
    first, second = (1, 2) if corners.shape[1] == 3 else (2, 3)
    start = 0 if corners.shape[1] == 3 else 1
    normal = np.cross(corners[:, first] - corners[:, 0], corners[:, second] - corners[:, start])
    return np.asarray(0.5 * np.linalg.norm(normal, axis=1))


def _rigid_modes(offsets: Floats, size: float) -> Floats:
    """(n, 3, 6) displacement of each node in the six rigid motions, scaled to about one."""
    modes = np.zeros((len(offsets), 3, 6))
    modes[:, :, :3] = np.eye(3)
    x, y, z = (offsets / size).T
    modes[:, 1, 3], modes[:, 2, 3] = -z, y
    modes[:, 0, 4], modes[:, 2, 4] = z, -x
    modes[:, 0, 5], modes[:, 1, 5] = -y, x
    return modes
