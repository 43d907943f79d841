"""The synthetic patient at rest: a torso front as a map from a box, and the tissue of each point.

Material coordinates zeta = (azimuth rad, level m, depth): the azimuth runs around the thorax from
the patient's right (negative) to her left, the level is z, the depth goes from 0 on the pectoral
surface to 1 on the skin. Positions are metres, LPS: the thorax's axis is x = y = 0, nipples lie
near z = 0.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.floating[Any]]

#: Soft rim of a breast: width of the fold around it, as a fraction of its squared radius.
_FOLD = 0.12
#: Fat that always lies between gland and skin, m.
_COVER = 5e-3


@dataclass(frozen=True)
class Torso:
    """The thorax: an elliptic cylinder that tapers, with the landmarks of a front.

    Attributes:
        half_width, half_depth: semi-axes at the level of greatest girth, m.
        fat: thickness of the subcutaneous layer on the flanks, m.
        presternal: the same over the sternum, m.
    """

    half_width: float
    half_depth: float
    fat: float
    presternal: float

    def girth(self, level: Array) -> Array:
        """Scale of both semi-axes at ``level``, 1 at the greatest girth."""
        return np.asarray(1.0 - 0.06 * ((level + 0.04) / 0.12) ** 2)

    def relief(self, azimuth: Array, level: Array) -> Array:
        """Relative height of sternum, notch, clavicles and epigastrium over the cylinder."""
        middle = np.exp(-((azimuth / 0.17) ** 2))
        notch = np.exp(-((azimuth / 0.20) ** 2) - ((level - 0.120) / 0.018) ** 2)
        clavicle = np.exp(-((np.abs(azimuth) - 0.55) ** 2 / 0.10))
        clavicle = clavicle * np.exp(-(((level - 0.112 - 0.015 * np.abs(azimuth)) / 0.015) ** 2))
        belly = np.exp(-((azimuth / 0.40) ** 2) - ((level + 0.115) / 0.030) ** 2)
        return np.asarray(-0.045 * middle - 0.05 * notch + 0.05 * clavicle - 0.05 * belly)

    def wall(self, azimuth: Array, level: Array) -> Array:
        """Points (..., 3) m of the pectoral surface."""
        size = self.girth(level) * (1.0 + self.relief(azimuth, level))
        x = self.half_width * size * np.sin(azimuth)
        y = -self.half_depth * size * np.cos(azimuth)
        return np.stack(np.broadcast_arrays(x, y, level), axis=-1)

    def normal(self, azimuth: Array) -> Array:
        """Unit normals (..., 3) of the cylinder without relief, outward."""
        x, y = np.sin(azimuth) / self.half_width, -np.cos(azimuth) / self.half_depth
        length = np.hypot(x, y)
        return np.stack([x / length, y / length, np.zeros_like(length)], axis=-1)

    def layer(self, azimuth: Array) -> Array:
        """Thickness of the subcutaneous layer, m."""
        middle = np.exp(-((azimuth / 0.22) ** 2))
        return np.asarray(self.fat + (self.presternal - self.fat) * middle)

    def outside(self, x: Array, y: Array, z: float) -> Array:
        """Signed distance, m, of points at level ``z`` to the pectoral surface, positive outward.

        First order in the distance; exact on the surface.
        """
        size = self.girth(np.asarray(z))
        u, v = x / np.float32(self.half_width * size), y / np.float32(self.half_depth * size)
        radius = np.hypot(u, v) + np.float32(1e-6)
        height = radius - 1 - self.relief(np.arctan2(u, -v), np.asarray(z, dtype=np.float32))
        slope = np.hypot(u / (self.half_width * size), v / (self.half_depth * size)) / radius
        return np.asarray(height / np.maximum(slope, 1e-6))


@dataclass(frozen=True)
class Dome:
    """One breast at rest over its footprint on the wall.

    Attributes:
        azimuth, level: centre of the footprint, rad and m.
        metre: arc length of the wall per radian of azimuth there, m.
        across, along: semi-axes of the footprint around the thorax and along z, m.
        projection: height of the apex over the subcutaneous layer, m.
        fullness: how much the flanks bulge, relative to the footprint.
        ptosis: how far the apex hangs towards the feet, relative to the projection.
        tilt: angle of the breast's axis from straight ahead to the side, rad, signed.
    """

    azimuth: float
    level: float
    metre: float
    across: float
    along: float
    projection: float
    fullness: float
    ptosis: float
    tilt: float

    def plane(self, azimuth: Array, level: Array) -> tuple[Array, Array]:
        """Footprint coordinates relative to its semi-axes: (1, 0) is its lateral or medial rim."""
        across = (azimuth - self.azimuth) * (self.metre / self.across)
        return np.asarray(across), np.asarray((level - self.level) / self.along)

    def profile(self, azimuth: Array, level: Array) -> Array:
        """Height of the skin over the subcutaneous layer relative to the projection, 0 to 1."""
        across, along = self.plane(azimuth, level)
        return np.asarray(_FOLD * np.logaddexp(0.0, (1.0 - across**2 - along**2) / _FOLD))

    def offset(self, azimuth: Array, level: Array, depth: Array) -> Array:
        """What the breast adds, (..., 3) m, to a point of the subcutaneous layer."""
        across, along = self.plane(azimuth, level)
        height = depth * self.profile(azimuth, level)
        bulge = self.fullness * 4.0 * height * (1.0 - height)
        aside = bulge * across * self.across
        down = bulge * along * self.along - self.ptosis * self.projection * height**2
        ahead = self.projection * height
        sine, cosine = np.sin(self.tilt), np.cos(self.tilt)
        x, y = aside * cosine + ahead * sine, aside * sine - ahead * cosine
        return np.stack([x, y, down], axis=-1)


@dataclass(frozen=True)
class Anatomy:
    """The torso with both breasts and the gland in them.

    Attributes:
        domes: the right and the left breast.
        gland: radius of the gland relative to the breast's.
        waves: (w, 4) wave numbers across, along and in height, and phases, that make its lobes.
    """

    torso: Torso
    domes: tuple[Dome, Dome]
    gland: float
    waves: Array

    def dome(self, azimuth: float) -> Dome:
        """The breast on the side of ``azimuth``."""
        return self.domes[int(azimuth > 0)]

    def rest(self, zeta: Array) -> Array:
        """Rest positions (..., 3) m of material points ``zeta`` (..., 3)."""
        azimuth, level, depth = np.moveaxis(np.asarray(zeta, dtype=np.float64), -1, 0)
        rise = (depth * self.torso.layer(azimuth))[..., None] * self.torso.normal(azimuth)
        points = self.torso.wall(azimuth, level) + rise
        for dome in self.domes:
            points = points + dome.offset(azimuth, level, depth)
        return np.asarray(points)

    def gland_depth(self, zeta: Array) -> Array:
        """How deep, m (approximately), material points lie inside the gland; negative outside."""
        inside = np.full(zeta.shape[:-1], -self.domes[0].across)
        for dome in self.domes:
            near = dome.profile(zeta[..., 0], zeta[..., 1]) > 0.1
            inside[near] = self._lobes(dome, zeta[near])
        return inside

    def _lobes(self, dome: Dome, zeta: Array) -> Array:
        """Depth, m, in one breast's gland: a wavy ellipsoid that reaches for the nipple."""
        across, along = dome.plane(zeta[:, 0], zeta[:, 1])
        height = zeta[:, 2] * dome.profile(zeta[:, 0], zeta[:, 1])
        radius = np.sqrt((across**2 + along**2) / self.gland**2 + ((height - 0.5) / 0.36) ** 2)
        for a, b, c, phase in self.waves:
            radius -= 0.08 * np.sin(a * across + b * along + c * height + phase)
        cover = 0.8 * dome.projection * (1.0 - zeta[:, 2]) * dome.profile(zeta[:, 0], zeta[:, 1])
        return np.minimum((1.0 - radius) * self.gland * dome.across, cover - _COVER)
