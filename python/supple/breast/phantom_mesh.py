"""The truth's mesh: hexahedra mapped from a box of material coordinates onto the torso front."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from supple.breast.phantom_anatomy import Anatomy, Array, Dome

Index = NDArray[np.int64]

#: Corners of a box in VTK's order, as steps along (azimuth, level, depth).
_CORNERS = ((0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1))
#: Six tetrahedra around the diagonal 0-6 of a hexahedron; they match across shared faces.
_SPLIT = ((0, 1, 2, 6), (0, 2, 3, 6), (0, 3, 7, 6), (0, 7, 4, 6), (0, 4, 5, 6), (0, 5, 1, 6))


@dataclass(frozen=True)
class Cells:
    """How many cells lie along each part of the box.

    Attributes:
        flank, breast, sternum: around the thorax; the whole row is flank, breast, sternum,
            breast, flank.
        below, along, above: along z, under, at and over the breasts.
        depth: from the pectoral surface to the skin.
    """

    flank: int
    breast: int
    sternum: int
    below: int
    along: int
    above: int
    depth: int


@dataclass(frozen=True)
class Box:
    """A structured mesh in material coordinates.

    Attributes:
        axes: the grid lines: azimuth (a,) rad, level (l,) m, depth (d,) 0 to 1, increasing.
    """

    axes: tuple[Array, Array, Array]

    @property
    def shape(self) -> tuple[int, int, int]:
        """Numbers of nodes along the axes."""
        first, second, third = (axis.size for axis in self.axes)
        return first, second, third

    @property
    def zeta(self) -> Array:
        """Material coordinates (n, 3) of the nodes, depth running fastest."""
        return np.stack(np.meshgrid(*self.axes, indexing="ij"), axis=-1).reshape(-1, 3)

    @property
    def hexahedra(self) -> Index:
        """(cells, 8) node ids in VTK's order."""
        ids = np.arange(np.prod(self.shape)).reshape(self.shape)
        size = [n - 1 for n in self.shape]
        corners = [
            ids[i : i + size[0], j : j + size[1], k : k + size[2]].ravel() for i, j, k in _CORNERS
        ]
        return np.stack(corners, axis=-1)

    @property
    def tetrahedra(self) -> Index:
        """(6 cells, 4) node ids: every hexahedron cut alike around its diagonal."""
        return self.hexahedra[:, np.array(_SPLIT)].reshape(-1, 4)

    @property
    def skin(self) -> Index:
        """Node ids (a, l) of the face to the air."""
        return np.arange(np.prod(self.shape)).reshape(self.shape)[:, :, -1]

    @property
    def fixed(self) -> Index:
        """Node ids on the pectoral surface and on the outer rim of the torso front."""
        at_rim = np.zeros(self.shape, dtype=bool)
        at_rim[[0, -1]], at_rim[:, [0, -1]], at_rim[:, :, 0] = True, True, True
        return np.flatnonzero(at_rim)

    def backed(self, points: Array, inward: Array) -> tuple[Box, Array]:
        """This mesh at ``points`` (n, 3) with one more layer, depth -1 to 0, behind its base.

        Args:
            points: node positions, m.
            inward: (a, l, 3) m from the base to the back of the new layer.

        Returns:
            The deeper box and its node positions.
        """
        nodes = points.reshape(*self.shape, 3)
        nodes = np.concatenate([nodes[:, :, :1] + inward[:, :, None], nodes], axis=2)
        depth = np.concatenate([[-1.0], self.axes[2]])
        return Box((self.axes[0], self.axes[1], depth)), nodes.reshape(-1, 3)

    def refined(self, points: Array, each: int) -> tuple[Box, Array]:
        """This mesh at ``points`` (n, 3) with cells cut into each x each along azimuth and level.

        The new nodes lie where the trilinear cells carry them.
        """
        nodes = points.reshape(*self.shape, 3)
        azimuth, level = (refine(axis, each) for axis in self.axes[:2])
        nodes = interpolate_along(nodes, self.axes[0], azimuth, 0)
        nodes = interpolate_along(nodes, self.axes[1], level, 1)
        return Box((azimuth, level, self.axes[2])), nodes.reshape(-1, 3)

    def samples(self, each: int) -> Array:
        """Material points (cells, each^3, 3): midpoints of every cell cut into each^3."""
        from numpy.lib.stride_tricks import sliding_window_view

        steps = (np.arange(each) + 0.5) / each
        lines = []
        for axis in self.axes:
            ends = sliding_window_view(axis, 2)
            lines.append(ends[:, :1] + np.diff(ends, axis=1) * steps)
        a, b, c = (line.shape[0] for line in lines)
        grids = np.meshgrid(*(line.ravel() for line in lines), indexing="ij")
        points = np.stack(grids, axis=-1).reshape(a, each, b, each, c, each, 3)
        return np.asarray(points.transpose(0, 2, 4, 1, 3, 5, 6)).reshape(a * b * c, each**3, 3)

    def interpolate(self, values: Array, zeta: Array) -> Array:
        """Nodal ``values`` (n, c) at material points ``zeta`` (m, 3): (m, c), trilinear."""
        from scipy.interpolate import RegularGridInterpolator

        return np.asarray(RegularGridInterpolator(self.axes, values.reshape(*self.shape, -1))(zeta))


def make_box(anatomy: Anatomy, cells: Cells) -> Box:
    """The grid lines for a patient, denser at her breasts than around them."""
    dome = anatomy.domes[1]
    inner, outer = _rims(dome)
    low, high = dome.level - 1.08 * dome.along, dome.level + 1.08 * dome.along
    half = _line([inner, outer, 1.90], [cells.breast, cells.flank])
    middle = np.linspace(-inner, inner, cells.sternum + 1)[1:-1]
    azimuth = np.concatenate([-half[::-1], middle, half])
    level = _line([-0.135, low, high, 0.140], [cells.below, cells.along, cells.above])
    return Box((azimuth, level, np.linspace(0.0, 1.0, cells.depth + 1)))


def _rims(dome: Dome) -> tuple[float, float]:
    """Azimuths of the medial and lateral rim of the left breast, with a margin."""
    reach = 1.05 * dome.across / dome.metre
    return max(dome.azimuth - reach, 0.06), dome.azimuth + reach


def _line(ends: list[float], counts: list[int]) -> Array:
    """Consecutive uniform stretches joined at their shared ends."""
    parts = [np.linspace(a, b, n + 1) for a, b, n in zip(ends, ends[1:], counts, strict=False)]
    return np.concatenate([parts[0], *(part[1:] for part in parts[1:])])


def refine(axis: Array, each: int) -> Array:
    """Grid lines with every interval cut into ``each``."""
    at = np.arange((axis.size - 1) * each + 1) / each
    return np.asarray(np.interp(at, np.arange(axis.size), axis))


def interpolate_along(values: Array, old: Array, new: Array, axis: int) -> Array:
    """Linear interpolation of ``values`` from lines ``old`` to lines ``new`` along ``axis``."""
    cell = np.clip(np.searchsorted(old, new, side="right") - 1, 0, old.size - 2)
    part = (new - old[cell]) / (old[cell + 1] - old[cell])
    part = part.reshape([-1 if n == axis else 1 for n in range(values.ndim)])
    return np.asarray(
        np.take(values, cell, axis) * (1.0 - part) + np.take(values, cell + 1, axis) * part
    )
