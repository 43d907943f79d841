"""Meshes of a box: the beam and the block of every verification."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

Floats = npt.NDArray[np.float64]
Ints = npt.NDArray[np.int64]

#: Corners of the unit cube by number: bit 0 is x, bit 1 is y, bit 2 is z.
#: Six tetrahedra around the 000–111 diagonal, each positive.
_TETRAHEDRA = [(0, 1, 3, 7), (0, 1, 7, 5), (0, 5, 7, 4), (0, 3, 2, 7), (0, 6, 4, 7), (0, 2, 6, 7)]
#: Two prisms along z on either side of the 000–110 diagonal.
_PRISMS = [(0, 1, 3, 4, 5, 7), (0, 3, 2, 4, 7, 6)]
_PARTS = {
    "tetrahedron": np.array(_TETRAHEDRA),
    "prism": np.array(_PRISMS),
    "hexahedron": np.array([(0, 1, 3, 2, 4, 5, 7, 6)]),
}


def box(
    counts: tuple[int, int, int], size: Floats, origin: Floats, cell: str
) -> tuple[Floats, Ints]:
    """Points (n, 3) m, x fastest, and cells of degree 1 of a box of ``counts`` blocks."""
    axes = [np.linspace(0.0, s, n + 1) for s, n in zip(size, counts, strict=True)]
    z, y, x = np.meshgrid(*axes[::-1], indexing="ij")
    points = np.column_stack([x.ravel(), y.ravel(), z.ravel()]) + origin
    split = _PARTS[cell]
    return points, _corners(counts)[:, split].reshape(-1, split.shape[1])


def _corners(counts: tuple[int, int, int]) -> Ints:
    """Node ids (blocks, 8) of every block's corners, numbered as bits."""
    nx, ny, nz = counts
    k, j, i = np.meshgrid(np.arange(nz), np.arange(ny), np.arange(nx), indexing="ij")

    def node(b: int) -> Ints:
        x, y, z = i + (b & 1), j + (b >> 1 & 1), k + (b >> 2 & 1)
        return np.asarray(x + (nx + 1) * (y + (ny + 1) * z), dtype=np.int64).ravel()

    return np.stack([node(b) for b in range(8)], axis=1)
