"""The supine scan and the model's skin: aligned, and how far apart."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from supple.breast.tissues import Tissue
from supple.errors import InputError
from supple.surface import Surface

if TYPE_CHECKING:
    import SimpleITK as sitk
    from numpy.typing import NDArray

    from supple.breast.tetra import BreastMesh

    Points = NDArray[np.float64]
    Ints = NDArray[np.int32]

#: Scan points farther than this from the model's skin are not of it, m.
REACH = 0.04
#: Largest number of scan points that is compared.
MOST = 4000


@dataclass(frozen=True)
class Scan:
    """Points (k, 3) m of a supine surface scan; ``aligned`` in the image's frame."""

    points: Points
    aligned: bool = False

    @classmethod
    def read(cls, path: Path, unit: str) -> Scan:
        """Read a surface or a point cloud.

        Raises:
            InputError: missing, empty, NaN, or in another unit than said.
        """
        return cls(np.asarray(Surface.read(path, unit=unit, points_only=True).points))


@dataclass(frozen=True)
class SkinDistance:
    """Distance of the scan from the model's skin where the two overlap."""

    mae_mm: float
    distances: Points  # (k,) m
    share: float  # of the compared scan points that overlap


def aligned_scan(scan: Scan, labels: sitk.Image) -> tuple[Scan, list[str]]:
    """The scan in the image's frame, by the skin that lies still in both poses.

    Raises:
        InputError: the alignment is not to be trusted: why, and what to do.
    """
    from supple.registration.rigid import align

    torso = torso_skin(labels)
    alignment = align(scan.points, torso.points, torso.triangles)
    if not alignment.trustworthy:
        reasons = " ".join(alignment.warnings)
        return replace(scan, points=alignment.apply(scan.points), aligned=True), [
            f"The scan's alignment is not certain: {reasons}"
        ]
    moved = alignment.apply(scan.points)
    return Scan(moved, aligned=True), list(alignment.warnings)


def torso_skin(labels: sitk.Image) -> Surface:
    """The front of the body's surface in a label image, m, LPS.

    Raises:
        InputError: the labels hold no body.
    """
    import SimpleITK as sitk
    from skimage.measure import marching_cubes

    # Air around the image's own border would close the body where it only leaves the image.
    body = sitk.Cast(labels != int(Tissue.AIR), sitk.sitkFloat32)
    smooth = sitk.GetArrayFromImage(sitk.SmoothingRecursiveGaussian(body, 2.0)).transpose(2, 1, 0)
    if not (smooth.min() < 0.5 < smooth.max()):
        raise InputError("labels must hold a body with air in front, got one value only.")
    vertices, faces, _, _ = marching_cubes(smooth, 0.5, step_size=2)
    frame = np.array(labels.GetDirection()).reshape(3, 3) * np.array(labels.GetSpacing())
    points = (vertices @ frame.T + np.array(labels.GetOrigin())) / 1e3
    normal = np.cross(points[faces[:, 1]] - points[faces[:, 0]],
                      points[faces[:, 2]] - points[faces[:, 0]])  # fmt: skip
    centre = points.mean(axis=0)
    outward = np.sign(((points[faces].mean(axis=1) - centre) * normal).sum()) * normal
    faces = faces[outward[:, 1] < 0.3 * np.linalg.norm(outward, axis=1)]  # the front and flanks
    nodes, rows = np.unique(faces, return_inverse=True)
    return Surface(points[nodes], rows.reshape(-1, 3))


def skin_distance(scan: Scan, mesh: BreastMesh, supine: Points) -> SkinDistance:
    """Mean distance of the scan's points from the model's supine skin (n, 3) m.

    Points count where the skin lies opposite: those that land on its rim or beyond `REACH` do not.

    Raises:
        InputError: fewer than 100 points are left: scan and model do not overlap.
    """
    nodes, rows = np.unique(mesh.skin, return_inverse=True)
    triangles = rows.reshape(-1, 3)
    points = scan.points[:: max(1, len(scan.points) // MOST)]
    landed = Surface(supine[nodes], triangles).closest(points)
    on_rim = _rim(triangles)[triangles[landed.triangle]] & (landed.barycentric > 1e-9)
    beyond = on_rim.sum(axis=1) == (landed.barycentric > 1e-9).sum(axis=1)
    counts = ~beyond & (landed.distance < REACH)
    if counts.sum() < 100:
        raise InputError(
            f"scan must show the breasts of this patient, got {int(counts.sum())} points near the "
            "model's skin; check the scan, its unit and its side."
        )
    distance = np.asarray(landed.distance)[counts]
    return SkinDistance(1e3 * float(distance.mean()), distance, float(counts.mean()))


def facets_of(cells: Ints) -> Ints:
    """Outside facets (f, 3) of some tetrahedra (c, 4), outward."""
    faces = cells[:, [[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]]].reshape(-1, 3)
    if len(faces) == 0:
        return faces
    _, first, count = np.unique(
        np.sort(faces, axis=1), axis=0, return_index=True, return_counts=True
    )
    return np.asarray(faces[first[count == 1]])


def _rim(triangles: NDArray[np.int64]) -> NDArray[np.bool_]:
    """(nodes,) whether a node lies on an edge that belongs to one triangle only."""
    edges = np.sort(triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    unique, count = np.unique(edges, axis=0, return_counts=True)
    rim = np.zeros(int(triangles.max()) + 1, dtype=bool)
    rim[unique[count == 1]] = True
    return rim
