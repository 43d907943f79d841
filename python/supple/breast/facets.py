"""Boundary facets of a tetrahedral mesh: which they are, and what each of them faces."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from supple.breast.region import CUT
from supple.breast.tissues import Tissue
from supple.tetrahedra import connected

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from supple.breast.grid import PatientGrid, Points

    Ints = NDArray[np.int32]

#: Faces of a positive tetrahedron, each anticlockwise when seen from outside.
FACES = ((1, 2, 3), (0, 3, 2), (0, 1, 3), (0, 2, 1))
SKIN, CHEST, CUT_OFF = 0, 1, 2


def boundary_facets(cells: Ints) -> Ints:
    """(f, 3) facets that belong to one of the positive `cells` (c, 4) only, seen from outside."""
    facets = np.concatenate([cells[:, face] for face in FACES])
    _, first, count = np.unique(
        np.sort(facets, axis=1), axis=0, return_index=True, return_counts=True
    )
    return np.asarray(facets[first[count == 1]], np.int32)


def enclosed_volume(points: Points, facets: Ints) -> tuple[float, float]:
    """Volume inside and area of a closed triangle surface, in the points' unit."""
    a, b, c = (points[facets[:, i]] for i in range(3))
    volume = np.einsum("ij,ij->", np.cross(a, b), c) / 6.0
    return float(volume), float(facet_areas(points, facets).sum())


def facet_areas(points: Points, facets: Ints) -> Points:
    """(f,) area of each triangle."""
    a, b, c = (points[facets[:, i]] for i in range(3))
    return np.asarray(np.linalg.norm(np.cross(b - a, c - a), axis=1) / 2.0)


def euler_number(facets: Ints) -> tuple[int, bool]:
    """Nodes − edges + facets of a surface, and whether two facets meet at each of its edges."""
    sides = np.sort(np.concatenate([facets[:, [0, 1]], facets[:, [1, 2]], facets[:, [2, 0]]]))
    edges, count = np.unique(np.sort(sides, axis=1), axis=0, return_counts=True)
    return len(np.unique(facets)) - len(edges) + len(facets), bool((count == 2).all())


def facet_classes(
    grid: PatientGrid,
    contact: NDArray[np.uint8],
    points: Points,
    facets: Ints,
    least_patch_mm2: float = 300.0,
) -> NDArray[np.uint8]:
    """(f,) SKIN, CHEST or CUT_OFF: what lies nearest to each facet among air, chest and cut.

    Args:
        grid: the patient-aligned grid of `contact`.
        contact: (grid) what the body borders on, as in BreastRegion.
        points: (n, 3) mm.
        facets: (f, 3) the whole boundary.
        least_patch_mm2: a patch of one class smaller than this joins the class around it.
    """
    corners = points[facets]
    centre = corners.mean(axis=1)
    inner = [centre] + [0.5 * (corners[:, i] + centre) for i in range(3)]
    near = [grid.distance(contact == code) for code in (Tissue.AIR, Tissue.CHEST, CUT)]
    distance = [np.sum([grid.sample(field, at) for at in inner], axis=0) for field in near]
    classes = np.asarray(np.argmin(distance, axis=0), np.uint8)
    return _without_specks(classes, facet_areas(points, facets), facets, least_patch_mm2)


def facet_neighbours(facets: Ints) -> NDArray[np.intp]:
    """(e, 2) pairs of facets that share an edge."""
    sides = np.concatenate([facets[:, [0, 1]], facets[:, [1, 2]], facets[:, [2, 0]]])
    owner = np.tile(np.arange(len(facets)), 3)
    order = np.lexsort(np.sort(sides, axis=1).T)
    ordered = np.sort(sides, axis=1)[order]
    same = (ordered[1:] == ordered[:-1]).all(axis=1)
    return np.stack([owner[order][:-1][same], owner[order][1:][same]], axis=1)


def _without_specks(
    classes: NDArray[np.uint8], areas: Points, facets: Ints, least: float
) -> NDArray[np.uint8]:
    """`classes` in which each patch smaller than `least`, smallest first, joins its neighbours."""
    pairs = facet_neighbours(facets)
    for _ in range(len(facets)):
        alike = classes[pairs[:, 0]] == classes[pairs[:, 1]]
        patch = connected(pairs[alike], len(facets))
        area = np.bincount(patch, areas)
        border = patch[pairs[~alike]]
        small = np.unique(border)[area[np.unique(border)] < least]
        if not len(small):
            break
        speck = small[np.argmin(area[small])]
        touching = pairs[~alike][(border == speck).any(axis=1)]
        around = classes[touching][patch[touching] != speck]
        classes = np.where(patch == speck, np.bincount(around).argmax(), classes).astype(np.uint8)
    return classes
