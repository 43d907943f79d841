"""How good a breast mesh is: its cells by themselves, and its body against the labels."""

from __future__ import annotations

from itertools import combinations
from typing import TYPE_CHECKING

import numpy as np
import SimpleITK as sitk
from scipy import ndimage, spatial

from supple.breast.facets import (
    FACES,
    boundary_facets,
    enclosed_volume,
    euler_number,
    facet_areas,
    facet_neighbours,
)
from supple.breast.grid import signed_distance, voxel_coordinates
from supple.breast.region import breast_region
from supple.breast.surface import mean_ratios, signed_volumes
from supple.tetrahedra import connected

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
        within_two_voxels: shares of that surface; region_within_two_voxels: share of the body's
        outer voxels that have the mesh's surface that near, so that no sheet is lost; positive:
        share of cells with volume > 0; and the figures of `cell_quality`.
    """
    region = breast_region(labels, tumour_mm=tumour_mm)
    points = mesh.points * 1e3
    facets = boundary_facets(mesh.cells)
    volume = enclosed_volume(points, facets)[0]
    samples = np.einsum("sk,fkx->fsx", _barycentric(6), points[facets]).reshape(-1, 3)
    weight = np.repeat(facet_areas(points, facets), len(samples) // len(facets))
    away = _distance_to_faces(region.mask, samples)
    missed = _distance_from_faces(region.mask, samples)
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
        "region_within_two_voxels": float((missed <= 2 * voxel).mean()),
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


def _barycentric(steps: int) -> Points:
    """(s, 3) evenly spread points of a triangle."""
    return (
        np.array([(i, j, steps - i - j) for i in range(steps + 1) for j in range(steps + 1 - i)])
        / steps
    )


def _distance_to_faces(mask: sitk.Image, at: Points) -> Points:
    """Distance in mm of points (n, 3) to the faces of the mask's voxels."""
    field = sitk.GetArrayFromImage(signed_distance(mask))
    index = voxel_coordinates(mask, at)[:, ::-1].T
    values = ndimage.map_coordinates(field, index, output=float, order=1, mode="nearest")
    return np.asarray(np.abs(values), float)


def _distance_from_faces(mask: sitk.Image, samples: Points) -> Points:
    """Distance in mm of the mask's outer voxels to the nearest of `samples` (n, 3)."""
    inside = sitk.GetArrayFromImage(mask).astype(bool)
    outer = np.argwhere(inside & ~ndimage.binary_erosion(inside))[:, ::-1]
    axes = np.array(mask.GetDirection()).reshape(3, 3) * np.array(mask.GetSpacing())
    centres = outer @ axes.T + np.array(mask.GetOrigin())
    return np.asarray(spatial.cKDTree(samples).query(centres)[0])


def _weighted_quantile(values: Points, weights: Points, share: float) -> float:
    order = np.argsort(values)
    below = np.cumsum(weights[order])
    return float(values[order][np.searchsorted(below, share * below[-1])])
