"""A grid along the patient's axes, and signed distances: what the geometry stage computes on."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product
from typing import TYPE_CHECKING, Any

import numpy as np
import SimpleITK as sitk
from scipy import ndimage

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

    Field = NDArray[np.float32]
    Mask = NDArray[np.bool_]
    Points = NDArray[np.float64]

FAR = 1e4  # mm, stands for "nowhere near"


@dataclass(frozen=True)
class PatientGrid:
    """A grid along the patient's axes (LPS mm); arrays on it are indexed [z, y, x]."""

    origin: Points  # (3,) x y z of the first node, mm
    spacing: float  # mm, the same along each axis
    shape: tuple[int, int, int]  # nodes along z, y, x

    @classmethod
    def around(cls, low: ArrayLike, high: ArrayLike, spacing: float) -> PatientGrid:
        """The grid that covers the box from `low` (3,) to `high` (3,) mm."""
        start, end = np.asarray(low, float), np.asarray(high, float)
        nx, ny, nz = (int(n) + 1 for n in np.ceil((end - start) / spacing))
        return cls(start, spacing, (nz, ny, nx))

    def axes(self) -> tuple[Points, Points, Points]:
        """x, y and z of the nodes along each axis, mm."""
        x, y, z = (self.origin[a] + self.spacing * np.arange(self.shape[2 - a]) for a in range(3))
        return x, y, z

    def corners(self) -> Points:
        """(8, 3) mm of the outermost nodes."""
        end = self.origin + self.spacing * (np.array(self.shape[::-1]) - 1)
        return np.array(list(product(*zip(self.origin, end, strict=True))))

    def points(self, mask: Mask) -> Points:
        """(n, 3) mm of the nodes in `mask`, in the order of np.argwhere."""
        return np.asarray(np.argwhere(mask)[:, ::-1] * self.spacing + self.origin, float)

    def nodes_at(self, points: ArrayLike) -> tuple[NDArray[np.intp], ...]:
        """Index [z, y, x] of the nodes nearest to `points` (n, 3) mm, moved in from outside."""
        index = np.rint((np.asarray(points, float) - self.origin) / self.spacing).astype(np.intp)
        last = np.array(self.shape[::-1]) - 1
        return tuple(np.clip(index, 0, last)[:, ::-1].T)

    def sample(self, field: NDArray[Any], points: Points) -> Points:
        """Values of `field` at `points` (n, 3) mm; linear between nodes, constant beyond them."""
        index = ((points - self.origin) / self.spacing)[:, ::-1].T
        values = ndimage.map_coordinates(field, index, output=float, order=1, mode="nearest")
        return np.asarray(values, float)

    def gradient(self, field: Field) -> tuple[Field, Field, Field]:
        """Slopes of `field` along x, y and z, per mm."""
        along_z, along_y, along_x = (
            np.asarray(g, np.float32) for g in np.gradient(field, self.spacing)
        )
        return along_x, along_y, along_z

    def distance(self, mask: Mask) -> Field:
        """Distance in mm to the nearest node of `mask`; FAR where it has none."""
        if not mask.any():
            return np.full(self.shape, FAR, np.float32)
        image = self.image(mask.astype(np.uint8))
        return np.asarray(np.maximum(_array(_maurer(image)), 0.0), np.float32)

    def signed_distance(self, mask: Mask) -> Field:
        """Distance in mm to the faces between nodes in and out of `mask`, negative inside."""
        return np.asarray(_array(signed_distance(self.image(mask.astype(np.uint8)))), np.float32)

    def closing(self, mask: Mask, radius: float) -> Mask:
        """`mask` and all gaps into which a ball of `radius` mm does not fit."""
        return np.asarray(self.distance(self.distance(mask) > radius) > radius, bool)

    def image(self, array: NDArray[Any]) -> sitk.Image:
        """`array` as an image that knows where it lies."""
        image = sitk.GetImageFromArray(array)
        image.SetOrigin(self.origin.tolist())
        image.SetSpacing([self.spacing] * 3)
        return image

    def resample(self, image: sitk.Image, interpolator: int, outside: float) -> NDArray[Any]:
        """`image`, of any direction cosines, on this grid; `outside` where it has no voxel."""
        moved = sitk.Resample(
            image, [int(n) for n in self.shape[::-1]], sitk.Transform(), interpolator,
            self.origin.tolist(), [self.spacing] * 3, np.eye(3).ravel().tolist(), outside,
        )  # fmt: skip
        return _array(moved)


def signed_distance(mask: sitk.Image) -> sitk.Image:
    """Distance in mm to the faces between voxels of 1 and 0, negative inside.

    A Maurer map is zero on the outermost voxels' centres; the mean of the maps of a mask and of
    its complement is zero half-way, on the face between them.
    """
    distance: sitk.Image = 0.5 * (_maurer(mask) - _maurer(1 - mask))
    return distance


def voxel_coordinates(image: sitk.Image, points: Points) -> Points:
    """Continuous voxel index i, j, k (n, 3) in `image` of `points` (n, 3) LPS mm."""
    axes = np.array(image.GetDirection()).reshape(3, 3) * np.array(image.GetSpacing())
    return np.asarray(np.linalg.solve(axes, (points - np.array(image.GetOrigin())).T).T, float)


def corners(image: sitk.Image) -> tuple[Points, Points]:
    """The lowest and the highest x, y, z among the outer corners of an image, mm."""
    ends = [(-0.5, n - 0.5) for n in image.GetSize()]
    points = [image.TransformContinuousIndexToPhysicalPoint(p) for p in product(*ends)]
    return np.min(points, axis=0), np.max(points, axis=0)


def _maurer(mask: sitk.Image) -> sitk.Image:
    maurer: sitk.Image = sitk.SignedMaurerDistanceMap(
        mask, squaredDistance=False, useImageSpacing=True
    )
    return maurer


def _array(image: sitk.Image) -> NDArray[Any]:
    return np.asarray(sitk.GetArrayFromImage(image))
