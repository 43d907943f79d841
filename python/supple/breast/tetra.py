"""Label image to finite-element breasts: tetrahedra, their tissue, and what their facets face.

labels ─► region ─► smooth closed surface ─► lattice cut along it ─► remeshed, surface fitted
       ─► improved inside ─► tissue of each cell, class of each facet
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
import SimpleITK as sitk

from supple.breast.facets import (
    CHEST,
    CUT_OFF,
    SKIN,
    boundary_facets,
    euler_number,
    facet_areas,
    facet_classes,
)
from supple.breast.fidelity import cell_quality, fidelity
from supple.breast.grid import voxel_coordinates
from supple.breast.region import breast_region
from supple.breast.remesh import cut_lattice
from supple.breast.surface import fit_to_level, signed_volumes, smooth_level
from supple.breast.tissues import BREAST, Tissue
from supple.errors import InputError, MeshError
from supple.tetrahedra import largest_parts, remesh

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from supple.breast.grid import Points
    from supple.breast.region import BreastRegion

    Ints = NDArray[np.int32]

__all__ = ["BreastMesh", "MeshSettings", "build_mesh", "fidelity"]


@dataclass(frozen=True)
class BreastMesh:
    """Finite-element breasts in the prone image.

    Attributes:
        points: (n, 3) m, LPS.
        cells: (c, 4) node ids of tetrahedra, all of positive volume.
        tissue: (c,) `Tissue` code of each cell: FAT, GLAND or TUMOUR.
        skin: (f, 3) node ids of the facets that face air, anticlockwise seen from outside.
        chest: (g, 3) the same for facets on the chest wall.
        cut: (h, 3) the same for facets where the body is cut off: tissue goes on beyond them.
        quality: nodes, cells, volume_ml, min_mean_ratio, min_dihedral_deg and so on.
        warnings: one sentence each.
    """

    points: Points
    cells: Ints
    tissue: NDArray[np.uint8]
    skin: Ints
    chest: Ints
    cut: Ints
    quality: dict[str, float]
    warnings: tuple[str, ...]


@dataclass(frozen=True)
class MeshSettings:
    """Lengths in mm.

    Attributes:
        smoothing: standard deviation of the Gaussian that takes the voxels' steps off.
        cells: how many to aim at where no edge_mm is given, and the bounds of `edge` then.
        lattice: longest edge of the boxes that the body is cut from: sheets are not much thicker.
        chord: how far a facet may lie off the surface.
        gradation: ratio of the lengths of neighbouring edges.
        across_tumour: edges per diameter of the tumour.
        least_part: a part with fewer cells than this share of the largest one's is dropped.
    """

    smoothing: float = 2.0
    cells: int = 12000
    edge: tuple[float, float] = (10.0, 25.0)
    lattice: float = 5.0
    chord: float = 1.5
    gradation: float = 1.5
    across_tumour: float = 3.0
    least_part: float = 0.05


def build_mesh(
    labels: sitk.Image,
    *,
    edge_mm: float | None = None,
    tumour_mm: Sequence[float] | None = None,
    tumour_diameter_mm: float | None = None,
    settings: MeshSettings | None = None,
) -> BreastMesh:
    """Tetrahedra for both breasts of a prone label image.

    Args:
        labels: 3-D image of `Tissue` codes, LPS mm, any direction cosines.
        edge_mm: longest edge that the mesher aims at; edges are shorter where skin is curved
            and around the tumour. None: what some 12,000 cells need.
        tumour_mm: the tumour's centre, LPS mm.
        tumour_diameter_mm: cells within this sphere become TUMOUR, whatever their label.
        settings: smoothing and accuracy.

    Raises:
        InputError: the labels hold no breast or no chest wall; the tumour lies outside; a length
            is not positive.
        MeshError: no valid mesh came out.
    """
    s = settings or MeshSettings()
    _check_lengths(edge_mm=edge_mm, tumour_diameter_mm=tumour_diameter_mm)
    _check_point(tumour_mm)
    region = breast_region(labels, tumour_mm=tumour_mm)
    tumour = _tumour(region, tumour_mm, tumour_diameter_mm)
    edge = edge_mm or _edge_for(region, s)
    points, cells, parts = _body(region, edge, tumour, s)
    return _assemble(region, points, cells, _tissues(labels, points, cells, tumour), parts)


def _edge_for(region: BreastRegion, s: MeshSettings) -> float:
    """Longest edge, mm, that gives roughly `s.cells` cells; measured on bodies of 1 to 6 litres."""
    litres = region.volume_mm3 / 1e6
    return float(np.clip(16.0 * litres**0.4 * np.sqrt(12000.0 / s.cells), *s.edge))


def _body(
    region: BreastRegion, edge: float, tumour: _Tumour | None, s: MeshSettings
) -> tuple[Points, Ints, int]:
    """Nodes in mm, cells, number of parts; tried again, finer, where that fails."""
    for attempt in (1.0, 1.07, 1.2, 1.4):
        try:
            level = smooth_level(region, s.smoothing / attempt)
            points, cells = cut_lattice(region.grid, level, min(edge / 3, s.lattice) / attempt)
            points, cells, parts = largest_parts(points, cells, s.least_part)
            for chord in (s.chord, s.chord, None):
                edges = _edges(points, edge, tumour, s)
                points, cells = remesh(points, cells, edges, gradation=s.gradation, chord=chord)
                if chord is not None:
                    points = fit_to_level(region.grid, level, points, cells, region.volume_mm3)
            _check_mesh(points, cells)
            _check_parts(region, parts)
            return points, cells, parts
        except MeshError as error:
            failure = error
    raise failure


def _check_lengths(**lengths: float | None) -> None:
    for name, value in lengths.items():
        if value is not None and not 0.0 < value < np.inf:
            raise InputError(f"{name} must be a positive length in mm, got {value}: correct it.")


def _check_point(centre: Sequence[float] | None) -> None:
    if centre is not None and (len(centre) != 3 or not np.isfinite(centre).all()):
        raise InputError(f"tumour_mm must be x, y, z in LPS mm, got {centre}: give three numbers.")


@dataclass(frozen=True)
class _Tumour:
    centre: Points  # (3,) mm
    diameter: float  # mm


def _tumour(
    region: BreastRegion, centre: Sequence[float] | None, diameter: float | None
) -> _Tumour | None:
    """The tumour as a ball, None where its centre or its size is not known.

    Raises:
        InputError: its centre lies outside of the body.
    """
    if centre is None:
        return None
    point = np.asarray(centre, float)
    inside = region.grid.points(region.level < 0)
    away = float(np.linalg.norm(inside - point, axis=1).min())
    if away > region.grid.spacing:
        low, high = inside.min(axis=0), inside.max(axis=0)
        box = ", ".join(
            f"{axis} {a:.0f} to {b:.0f}" for axis, a, b in zip("xyz", low, high, strict=True)
        )
        raise InputError(
            f"tumour_mm must lie in the breasts ({box} mm LPS), got"
            f" ({point[0]:g}, {point[1]:g}, {point[2]:g}), {away:.0f} mm outside of them: give its"
            " centre in the image's LPS mm."
        )
    return None if diameter is None else _Tumour(point, float(diameter))


def _edges(points: Points, edge: float, tumour: _Tumour | None, s: MeshSettings) -> Points:
    """(n,) length of the edges wanted at `points`, mm: short at the tumour, `edge` far off."""
    if tumour is None:
        return np.full(len(points), edge)
    beyond = np.linalg.norm(points - tumour.centre, axis=1) - tumour.diameter / 2
    finest = max(tumour.diameter / s.across_tumour, edge / 8)
    return np.asarray(np.minimum(finest + (s.gradation - 1.0) * beyond.clip(0.0), edge))


def _tissues(
    labels: sitk.Image, points: Points, cells: Ints, tumour: _Tumour | None
) -> NDArray[np.uint8]:
    """(c,) the code that most of each cell's inner points hold; tumour where the ball is."""
    at = np.einsum("sk,ckx->csx", _inner_points(), points[cells])
    index = voxel_coordinates(labels, at.reshape(-1, 3)).round().astype(int)
    index = np.clip(index, 0, np.array(labels.GetSize()) - 1)
    codes = sitk.GetArrayViewFromImage(labels)[tuple(index[:, ::-1].T)].reshape(at.shape[:2])
    votes = np.stack([(codes == code).sum(axis=1) for code in BREAST])
    tissue = np.array(BREAST, np.uint8)[votes.argmax(axis=0)]
    if tumour is not None:
        away = np.linalg.norm(at - tumour.centre, axis=2)
        tissue[(away <= tumour.diameter / 2).mean(axis=1) >= 0.5] = Tissue.TUMOUR
        tissue[away.min(axis=1).argmin()] = Tissue.TUMOUR
    return np.asarray(tissue, np.uint8)


def _inner_points() -> Points:
    """(15, 4) barycentric points of a tetrahedron: its centre, and two rings about it."""
    weights = [np.full(4, 0.25)]
    for share in (0.7, 0.45):
        weights += [np.where(np.arange(4) == i, share, (1 - share) / 3) for i in range(4)]
    weights += [
        np.where(np.isin(np.arange(4), (i, j)), 0.4, 0.1) for i in range(4) for j in range(i)
    ]
    return np.array(weights)


def _check_mesh(points: Points, cells: Ints) -> None:
    worst = float(signed_volumes(points, cells).min())
    closed = euler_number(boundary_facets(cells))[1]
    if worst <= 0.0 or not closed:
        raise MeshError(
            f"the mesh must be closed with positive cells, got a smallest cell of {worst:.3g} mm³"
            f" and a surface that is {'closed' if closed else 'open'}: try another edge_mm."
        )


def _check_parts(region: BreastRegion, parts: int) -> None:
    if parts > region.parts:
        raise MeshError(
            f"the mesh must have {region.parts} part(s) as the labels do, got {parts}: a sheet of"
            " fat between them is too thin for the mesher; give labels without it."
        )


def _assemble(
    region: BreastRegion, points: Points, cells: Ints, tissue: NDArray[np.uint8], parts: int
) -> BreastMesh:
    facets = boundary_facets(cells)
    classes = facet_classes(region.grid, region.contact, points, facets)
    skin, chest, cut = (facets[classes == name] for name in (SKIN, CHEST, CUT_OFF))
    if not len(skin) or not len(chest):
        missing = "the air" if not len(skin) else "the chest wall"
        raise MeshError(f"no facet of the mesh faces {missing}: check the labels around it.")
    quality: dict[str, Any] = cell_quality(points, cells)
    quality["volume_ml"] = float(signed_volumes(points, cells).sum()) / 1e3
    quality["parts"] = parts
    for name, part in (("skin", skin), ("chest", chest), ("cut", cut)):
        quality[f"{name}_cm2"] = float(facet_areas(points, part).sum()) / 1e2
    warnings = region.warnings + _notes(region, parts, int(quality["genus"]))
    return BreastMesh(points * 1e-3, cells, tissue, skin, chest, cut, quality, warnings)


def _notes(region: BreastRegion, parts: int, genus: int) -> tuple[str, ...]:
    notes = []
    if parts > 1:
        notes.append(f"The breasts are {parts} separate bodies: no tissue joins them.")
    if genus > 0:
        notes.append(
            f"Handles or tunnels in the body's surface: {genus}; look at them in prone.vtu."
        )
    lost = 1.0 - region.volume_mm3 / region.segmented_mm3
    if abs(lost) > 0.03:
        notes.append(
            f"Clean-up took {lost:.0%} of the segmented tissue (thin sheets, islands, cavities)."
        )
    return tuple(notes)
