"""What may be wrong with a scan, mended and said: doubles, walls, orientation, pieces.

1. tidy     numbers that are none, ids that name no point, triangles without area
2. weld     points that coincide, so that seams are closed
3. orient   neighbours agree on which side is outside
4. walls    of an inner and an outer sheet, the outer
5. outside  normals point away from the body
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from supple.errors import InputError
from supple.registration.scan_sheets import outer_sheet
from supple.registration.scan_topology import consistent, half_edges, pieces
from supple.surface import Surface, flat

Floats = npt.NDArray[np.float64]
Ints = npt.NDArray[np.int64]
Mask = npt.NDArray[np.bool_]

#: Least number of points of a scan, and largest share of them that may be no numbers.
LEAST, LOST = 200, 0.01
#: Least share of the points that a surface's triangles name.
_CLOUD = 0.1
#: Extent, m, beyond which nothing is a scan of a body in metres.
_EXTENT = (0.1, 3.0)
#: Points closer than this are one, m: the least step that files of four decimals of a mm hold.
_WELD = 1e-7
#: -∫ n·(x - c) dA over ∫ |x - c| dA above which a scan, or against it a large piece, faces inward,
#: and the share of the area that a large piece has.
_SURE, _ODD, _LARGE = 0.05, 0.3, 0.15


def tidy(points: npt.ArrayLike, triangles: npt.ArrayLike, source: str = "the scan") -> tuple[
    Floats, Ints, list[str]
]:  # fmt: skip
    """Points and triangles that a Surface can hold, and what was left out.

    Args:
        points: (n, 3), any unit; NaN and infinity are dropped up to 1 %, and so are those of no
            triangle, where there are triangles.
        triangles: (t, 3) rows of points, or none.
        source: what messages call the scan.

    Raises:
        InputError: no points, fewer than 200, more than 1 % NaN or infinite, ids of no point.
    """
    xyz = np.asarray(points, dtype=np.float64).reshape(-1, 3)
    faces = np.asarray(triangles, dtype=np.int64).reshape(-1, 3)
    if len(xyz) < LEAST:
        raise InputError(f"{source} holds {len(xyz)} points, fewer than the {LEAST} of any torso; "
                         "export the whole scan.")  # fmt: skip
    if len(faces) and (faces.min() < 0 or faces.max() >= len(xyz)):
        raise InputError(f"{source} has triangles with corners outside its {len(xyz)} points; "
                         "export it again.")  # fmt: skip
    said = []
    good = np.asarray(np.isfinite(xyz).all(axis=1))
    if not good.all():
        lost = int((~good).sum())
        if lost > LOST * len(xyz):
            raise InputError(f"{source} has {lost} points of {len(xyz)} that are NaN or infinite, "
                             f"more than {LOST:.0%}; export it again.")  # fmt: skip
        said.append(f"{lost} points that are NaN or infinite are left out.")
        new = np.cumsum(good) - 1
        faces = new[faces[good[faces].all(axis=1)]]
        xyz = xyz[good]
    none = flat(xyz, faces)
    if none.any():
        said.append(f"{int(none.sum())} triangles without area are left out.")
        faces = faces[~none]
    xyz, faces, loose = _tied(xyz, faces)
    return xyz, faces, [*said, *loose]


def _tied(points: Floats, triangles: Ints) -> tuple[Floats, Ints, list[str]]:
    """Without points of no triangle: what was cut from a surface may have left its points behind.

    A cloud with a few triangles stays a cloud.
    """
    corners, count = np.zeros(len(points), dtype=bool), len(points)
    corners[triangles] = True
    held = int(corners.sum())
    if held in (0, count):
        return points, triangles, []
    if held < max(LEAST, _CLOUD * count):
        said = f"Only {held} points of {count} are in triangles: taken as a cloud of points."
        return points, triangles[:0], [said]
    said = f"{count - held} points of {count} are in no triangle: left out."
    return *_used(points, triangles), [said]


def clean(surface: Surface) -> tuple[Surface, list[str]]:
    """The scan welded, oriented outward and of one wall, and a sentence for each thing mended.

    A cloud of points keeps its points, doubles apart. Stray pieces stay: the fit judges them.

    Raises:
        InputError: fewer than 200 points, or an extent that is no body's in metres.
    """
    size = surface.size
    if len(surface.points) < LEAST:
        raise InputError(f"the scan holds {len(surface.points)} points, fewer than the {LEAST} of "
                         "any torso; give the whole scan.")  # fmt: skip
    if not _EXTENT[0] <= size <= _EXTENT[1]:
        raise InputError(f"the scan spans {size:.4g} m, but a body spans {_EXTENT[0]} to "
                         f"{_EXTENT[1]} m; convert it to metres.")  # fmt: skip
    points, triangles, said = _welded(surface.points, surface.triangles)
    if len(triangles):
        triangles, more = _mended(points, triangles)
        said += more
    same = points is surface.points and triangles is surface.triangles
    if len(triangles) and not same:
        points, triangles = _used(points, triangles)
    if len(points) < LEAST:
        raise InputError(f"the scan holds {len(points)} different points, fewer than the {LEAST} "
                         "of any torso; give the whole scan.")  # fmt: skip
    if same:
        return surface, said
    return Surface(points, triangles), said


def _mended(points: Floats, triangles: Ints) -> tuple[Ints, list[str]]:
    said = []
    edges = half_edges(triangles, len(points))
    flip = consistent(triangles, edges)
    if flip.any():
        said.append(f"{int(flip.sum())} triangles disagreed with their neighbours on which side "
                    "is outside: turned.")  # fmt: skip
        triangles = turned(triangles, flip)
    of, count = pieces(edges)
    middle, normal = _middles(points, triangles)
    keep = outer_sheet(points, triangles, of, normal)
    if not keep.all():
        said.append("The scan has an inner and an outer wall: the outer is kept, "
                    f"{int(keep.sum())} of {len(keep)} triangles.")  # fmt: skip
        triangles, middle, normal = triangles[keep], middle[keep], normal[keep]
    piece = of[triangles[:, 0]]
    flip, area = _inward(middle, normal, piece, count)
    if flip.any():
        said.append("The triangles faced inward: turned inside out.")
        triangles = turned(triangles, flip[piece])
    share, several = float(area.max() / area.sum()), int((area > 0).sum())
    if several > 1 and share < 0.98:
        said.append(f"The scan is in {several} pieces; the largest is {share:.0%} of its area.")
    return triangles, said


def _middles(points: Floats, triangles: Ints) -> tuple[Floats, Floats]:
    """Middle (t, 3) of each triangle, m, and its normal (t, 3) as long as its area, m²."""
    x = np.ascontiguousarray(points.T)
    a, b, c = (x[:, ids] for ids in np.ascontiguousarray(triangles.T))
    middle = (a + b + c) / 3
    b -= a
    c -= a
    normal = np.empty_like(a)
    for i in range(3):
        j, k = (i + 1) % 3, (i + 2) % 3
        normal[i] = (b[j] * c[k] - b[k] * c[j]) / 2
    return middle.T, normal.T


def _inward(middle: Floats, normal: Floats, of: Ints, count: int) -> tuple[Mask, Floats]:
    """Which pieces face inward, and the area (m²) of each.

    ∫ n·(x - c) dA is, of a closed surface, three times its volume, and of the right sign for an
    open one that bulges, as each side of a body does. The scan votes as a whole, because a small
    piece need not bulge; only a large one that clearly differs from the whole is turned by itself.
    """
    area = np.sqrt(np.einsum("td,td->t", normal, normal))
    arm = middle - area @ middle / area.sum()
    flow = np.bincount(of, np.einsum("td,td->t", normal, arm), count)
    reach = np.bincount(of, area * np.sqrt(np.einsum("td,td->t", arm, arm)), count)
    total = np.bincount(of, area, count)
    whole = -1.0 if flow.sum() < -_SURE * reach.sum() else 1.0
    odd = whole * flow < -_ODD * reach
    odd &= total > _LARGE * total.sum()
    return np.asarray(odd ^ (whole < 0)), np.asarray(total, dtype=np.float64)


def turned(triangles: Ints, flip: npt.NDArray[np.bool_]) -> Ints:
    """Triangles (t, 3) with those of ``flip`` (t,) the other way round."""
    result = triangles.copy()
    result[flip] = result[flip][:, [0, 2, 1]]
    return result


def seen_from(surface: Surface) -> Floats:
    """Which way the skin looks on the whole, (3,): a unit vector times how one-sided it is.

    About 0.6 for half a torso, 0 for one scanned all around: ∫ n dA / ∫ dA. With LPS normals
    outward, +y means that only the back was scanned.
    """
    area = surface.areas
    return np.asarray(area @ surface.normals / area.sum())


def _welded(points: Floats, triangles: Ints) -> tuple[Floats, Ints, list[str]]:
    """Without points that coincide; a scan of which none do is handed back as it is."""
    at = np.rint((points - points.min(axis=0)) / _WELD).astype(np.int64)
    key = (at[:, 0] * 73856093) ^ (at[:, 1] * 19349663) ^ (at[:, 2] * 83492791)
    ranked = np.sort(key)
    if not (ranked[1:] == ranked[:-1]).any():
        return points, triangles, []
    order = np.lexsort((at[:, 2], at[:, 1], at[:, 0]))
    same = np.zeros(len(points), dtype=bool)
    same[1:] = (np.diff(at[order], axis=0) == 0).all(axis=1)
    if not same.any():
        return points, triangles, []
    group = np.empty(len(points), dtype=np.int64)
    group[order] = np.cumsum(~same) - 1
    points, triangles = points[order[~same]], group[triangles]
    triangles = triangles[~flat(points, triangles)]
    said = f"{int(same.sum())} points stood at the place of another: joined."
    return points, triangles, [said]


def _used(points: Floats, triangles: Ints) -> tuple[Floats, Ints]:
    """Without the points that no triangle uses, if any."""
    used = np.zeros(len(points), dtype=bool)
    used[triangles] = True
    if used.all():
        return points, triangles
    return points[used], (np.cumsum(used) - 1)[triangles]
