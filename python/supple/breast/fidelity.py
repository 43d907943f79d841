"""How good a breast mesh is: its cells by themselves, and its body against the labels."""

from __future__ import annotations

from itertools import combinations
from typing import TYPE_CHECKING

import numpy as np
import SimpleITK as sitk
from scipy import ndimage

from supple.breast.facets import (
    FACES,
    boundary_facets,
    connected,
    enclosed_volume,
    euler_number,
    facet_areas,
    facet_neighbours,
)
from supple.breast.grid import signed_distance, voxel_coordinates
from supple.breast.region import breast_region
from supple.breast.surface import mean_ratios, signed_volumes

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from supple.breast.grid import Points
    from supple.breast.tetra import BreastMesh

    Ints = NDArray[np.int32]


def fidelity(
    mesh: BreastMesh, labels: sitk.Image, tumour_mm: Sequence[float] | None = None
) -> dict[str, float]:
    """The mesh against the body that the labels describe, in the labels' own voxels.

    Args:
        mesh: made from `labels`.
        labels: image of `Tissue` codes, LPS mm.
        tumour_mm: as given to `build_mesh`.

    Returns:
        volume_ml, region_ml (voxels of the body), segmented_ml (labelled breast tissue within
        reach, before thin sheets and islands go); volume_error, segmented_error: relative;
        voxel_mm (largest spacing); surface_p95_mm, surface_max_mm, surface_mean_mm: distance of
        points of the mesh's surface to the faces of the body's voxels; within_one_voxel,
        within_two_voxels: shares of the surface; positive: share of cells with volume > 0;
        and the figures of `cell_quality`.
    """
    region = breast_region(labels, tumour_mm=tumour_mm)
    points = mesh.points * 1e3
    facets = boundary_facets(mesh.cells)
    volume = enclosed_volume(points, facets)[0]
    away, weight = _surface_distance(region.mask, points, facets)
    voxel = max(labels.GetSpacing())
    return {
        "volume_ml": volume / 1e3,
        "region_ml": region.volume_mm3 / 1e3,
        "segmented_ml": region.segmented_mm3 / 1e3,
        "volume_error": volume / region.volume_mm3 - 1.0,
        "segmented_error": volume / region.segmented_mm3 - 1.0,
        "voxel_mm": voxel,
        "surface_mean_mm": float(np.average(away, weights=weight)),
        "surface_p95_mm": _weighted_quantile(away, weight, 0.95),
        "surface_max_mm": float(away.max()),
        "within_one_voxel": float(np.average(away <= voxel, weights=weight)),
        "within_two_voxels": float(np.average(away <= 2 * voxel, weights=weight)),
        "positive": float((signed_volumes(points, mesh.cells) > 0).mean()),
        **cell_quality(points, mesh.cells),
    }


def cell_quality(points: Points, cells: Ints) -> dict[str, float]:
    """Shape of tetrahedra and topology of their body.

    Returns:
        nodes, cells; min_volume_mm3; min_mean_ratio, mean_mean_ratio; min_dihedral_deg,
        max_dihedral_deg; mean_edge_mm; genus: handles of the surface, summed over its parts.
    """
    volume = signed_volumes(points, cells)
    ratio = mean_ratios(points, cells)
    ends = [points[cells[:, i]] - points[cells[:, j]] for i, j in combinations(range(4), 2)]
    angles = dihedral_angles(points, cells)
    return {
        "nodes": len(points),
        "cells": len(cells),
        "min_volume_mm3": float(volume.min()),
        "min_mean_ratio": float(ratio.min()),
        "mean_mean_ratio": float(ratio.mean()),
        "min_dihedral_deg": float(angles.min()),
        "max_dihedral_deg": float(angles.max()),
        "mean_edge_mm": float(np.linalg.norm(ends, axis=2).mean()),
        "genus": float(_genus(cells)),
    }


def dihedral_angles(points: Points, cells: Ints) -> Points:
    """(c, 6) angles between the faces of each positive tetrahedron, degrees."""
    normals = []
    for face in FACES:
        a, b, c = (points[cells[:, i]] for i in face)
        normal = np.cross(b - a, c - a)
        normals.append(normal / np.linalg.norm(normal, axis=1, keepdims=True))
    cosines = [-np.einsum("ij,ij->i", m, n) for m, n in combinations(normals, 2)]
    return np.asarray(np.degrees(np.arccos(np.clip(cosines, -1.0, 1.0))).T)


def _genus(cells: Ints) -> int:
    facets = boundary_facets(cells)
    parts = int(connected(facet_neighbours(facets), len(facets)).max()) + 1
    return parts - euler_number(facets)[0] // 2


def _surface_distance(mask: sitk.Image, points: Points, facets: Ints) -> tuple[Points, Points]:
    """Distance in mm to the faces of the mask's voxels at 10 points a facet, and their areas."""
    thirds = np.array([(i, j, 3 - i - j) for i in range(4) for j in range(4 - i)]) / 3.0
    at = np.einsum("sk,fkx->fsx", thirds, points[facets]).reshape(-1, 3)
    field = sitk.GetArrayFromImage(signed_distance(mask))
    index = voxel_coordinates(mask, at)[:, ::-1].T
    away = np.abs(ndimage.map_coordinates(field, index, output=float, order=1, mode="nearest"))
    weight = np.repeat(facet_areas(points, facets) / len(thirds), len(thirds))
    return away, weight


def _weighted_quantile(values: Points, weights: Points, share: float) -> float:
    order = np.argsort(values)
    below = np.cumsum(weights[order])
    return float(values[order][np.searchsorted(below, share * below[-1])])
