"""The MRI-like image and the label image of the deformed patient.

Contrast is that of a T1-weighted scan without fat suppression: fat bright; gland, muscle, tumour
and skin dark; lung and air nearly black. Voxels across an interface hold a mixture, a smooth bias
field multiplies the signal and the magnitude carries Rician noise.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from supple.breast.phantom_anatomy import Anatomy, Array, Torso
from supple.breast.phantom_raster import Grid
from supple.breast.phantom_skin import Voxels
from supple.breast.phantom_tumour import Tumour
from supple.breast.tissues import Tissue

Volume = NDArray[np.float32]
Labels = NDArray[np.uint8]

#: Thickness, m, of the layer of chest wall that is voxelised with the body: more than the mesh's
#: base, made of flat faces, deviates from the curved wall.
BACKING = 8e-3

#: Signal of each tissue before bias and noise; noise is the standard deviation of both channels.
SIGNAL = {
    "fat": 800.0,
    "gland": 330.0,
    "tumour": 250.0,
    "skin": 430.0,
    "muscle": 290.0,
    "marrow": 520.0,
    "lung": 40.0,
    "heart": 350.0,
    "noise": 18.0,
}


@dataclass(frozen=True)
class Scene:
    """What is in front of the scanner.

    Attributes:
        body: the deformed body's voxels, backed by a layer of the chest wall of ``BACKING``.
        chest: signed distance (z, y, x), m, to the pectoral surface, positive outward.
    """

    grid: Grid
    anatomy: Anatomy
    body: Voxels
    tumour: Tumour
    chest: Volume

    @property
    def gland(self) -> Array:
        """Depth in the gland, m, of each voxel of the body."""
        return self.anatomy.gland_depth(self.body.zeta)

    @property
    def swelling(self) -> Array:
        """Depth in the tumour, m at rest, of each voxel of the body."""
        return self.tumour.depth(self.anatomy, self.body.zeta)


def chest_distance(grid: Grid, torso: Torso) -> Volume:
    """Signed distance (z, y, x), m, of every voxel to the pectoral surface, positive outward."""
    x = grid.along(0).astype(np.float32)[None, :]
    y = grid.along(1).astype(np.float32)[:, None]
    slices = [torso.outside(x, y, float(z)) for z in grid.along(2)]
    return np.stack(slices).astype(np.float32)


def draw_labels(scene: Scene) -> Labels:
    """Tissue codes (z, y, x): a voxel is what lies at its centre."""
    tissue = np.full(scene.body.flat.size, Tissue.FAT, dtype=np.uint8)
    tissue[scene.gland > 0] = Tissue.GLAND
    tissue[scene.swelling > 0] = Tissue.TUMOUR
    tissue[scene.body.outside > 0] = Tissue.AIR
    tissue[scene.body.zeta[:, 2] < 0] = Tissue.CHEST
    labels = np.where(scene.chest < 0, np.uint8(Tissue.CHEST), np.uint8(Tissue.AIR))
    labels.reshape(-1)[scene.body.flat] = tissue
    return np.asarray(labels)


def draw_image(scene: Scene, labels: Labels, rng: np.random.Generator) -> NDArray[np.int16]:
    """The magnitude image (z, y, x) of the scene that has these labels."""
    signal = np.zeros(scene.grid.shape, dtype=np.float32)
    chest = np.flatnonzero(labels.reshape(-1) == Tissue.CHEST)
    signal.reshape(-1)[chest] = _chest_signal(scene, chest)
    signal.reshape(-1)[scene.body.flat] = _body_signal(scene)
    signal *= _bias(scene.grid, rng)
    return _magnitude(signal, rng)


def _part(depth: Array, extent: Array | float) -> Array:
    """Fraction of a voxel inside an interface whose centre is ``depth`` inside."""
    return np.asarray(np.clip(0.5 + depth / extent, 0.0, 1.0))


def _body_signal(scene: Scene) -> Array:
    """Signal of the body's voxels: tissues, skin, and the parts of air and muscle."""
    body, extent = scene.body, float(scene.grid.spacing.mean())
    value = np.full(body.flat.size, SIGNAL["fat"])
    value += (SIGNAL["gland"] - value) * _part(scene.gland, extent)
    value += (SIGNAL["tumour"] - value) * _part(scene.swelling, extent)
    value += (SIGNAL["skin"] - value) * (1.0 - _part(-body.outside - 1.5e-3, body.extent))
    value += (SIGNAL["muscle"] - value) * _part(-_wall_height(scene), extent)
    return np.asarray(value * _part(-body.outside, body.extent))


def _wall_height(scene: Scene) -> Array:
    """Height, m (approximately), of the body's voxels over the pectoral surface."""
    azimuth, level, depth = scene.body.zeta.T
    thick = scene.anatomy.torso.layer(azimuth)
    for dome in scene.anatomy.domes:
        thick = thick + dome.projection * dome.profile(azimuth, level)
    return np.asarray(np.where(depth < 0.0, BACKING, thick) * depth)


def _chest_signal(scene: Scene, flat: NDArray[np.int64]) -> Array:
    """Signal behind the pectoral surface: muscle, ribs, then lungs, heart and liver."""
    depth = -scene.chest.reshape(-1)[flat]
    x, y, z = scene.grid.centres(flat).T
    value = np.full(flat.size, SIGNAL["muscle"])
    rib = np.sin((z + 0.25 * np.abs(x)) * (2.0 * np.pi / 0.024)) > 0.1
    value[rib & (depth > 0.012)] = SIGNAL["marrow"]
    inside = depth > 0.021
    heart = ((x - 0.025) / 0.045) ** 2 + ((y + 0.03) / 0.05) ** 2 + (z / 0.06) ** 2 < 1.0
    liver = z < -0.060 - 4.0 * (x + 0.03) ** 2
    value[inside] = np.where(heart | liver, SIGNAL["heart"], SIGNAL["lung"])[inside]
    return value


def _bias(grid: Grid, rng: np.random.Generator) -> Volume:
    """A smooth positive field (z, y, x), brighter towards the coil in front, mean about 1."""
    x, y, z = (np.linspace(-1.0, 1.0, n, dtype=np.float32) for n in grid.shape[::-1])
    a, b, c, d = rng.uniform(-0.08, 0.08, 4).astype(np.float32)
    field = (1 + a * x + b * x**2)[None, None, :] * (1 - (0.15 + c) * y)[None, :, None]
    return np.asarray(field * (1 + d * z - 0.1 * z**2)[:, None, None], dtype=np.float32)


def _magnitude(signal: Volume, rng: np.random.Generator) -> NDArray[np.int16]:
    """Rician noise: the modulus of the signal with equal Gaussian noise in both channels."""
    sigma = np.float32(SIGNAL["noise"])
    real = signal + sigma * rng.standard_normal(signal.shape, dtype=np.float32)
    imaginary = sigma * rng.standard_normal(signal.shape, dtype=np.float32)
    return np.asarray(np.rint(np.hypot(real, imaginary)), dtype=np.int16)
