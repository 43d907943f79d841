"""From template to scan and back: the drawing, landmarks, and any map over the skin.

    place in a triangle of the template ─► registered skin ─► closest point of the scan
    template's triangle ◄─ closest point of the registered skin ◄─ point of the scan

Where the scan has a hole, or faces another way, a point stays on the registered skin and says so.
Where skin and scan are one surface, each way undoes the other.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from supple.errors import InputError
from supple.registration.skin import edges, free_edges, vertex_normals
from supple.registration.template import OnSurface, Template

if TYPE_CHECKING:
    from supple.registration.registration import Registration
    from supple.surface import Surface

Floats = npt.NDArray[np.float64]
Ints = npt.NDArray[np.int64]
Mask = npt.NDArray[np.bool_]

#: Farther from the skin than this (m) a scan shows something else.
REACH = 10e-3
#: Over a hole, the closest point is on its rim, this far (m) or farther to the side.
RIM = 2e-3
#: Least cosine between the normals of skin and scan, the scan's smoothed so many times.
FACING, _SMOOTHED = 0.2, 5


@dataclass(frozen=True, eq=False, repr=False)
class Carried:
    """Points that came from the template.

    Attributes:
        points: (k, 3) m, in the scan's frame.
        on_scan: (k,) whether they lie on the scan; the others lie on the registered skin.
        offset: (k,) m from the registered skin.
        closed: of a curve: its last point is followed by its first.
    """

    points: Floats
    on_scan: Mask
    offset: Floats
    closed: bool = False


@dataclass(frozen=True, eq=False, repr=False)
class Landed:
    """Points that went to the template.

    Attributes:
        places: (k) of them in its triangles.
        distance: (k,) m that they were off the registered skin.
        within: (k,) whether that is in reach.
    """

    places: OnSurface
    distance: Floats
    within: Mask


@dataclass(frozen=True, eq=False, repr=False)
class Transfer:
    """The way between a template, as it was registered, and a scan.

    Attributes:
        template: of the registration.
        points: (n, 3) m, its registered vertices, in the scan's frame.
        scan: a surface; of a cloud of points nothing is a surface, and all stays on the skin.
        reach: m.
    """

    template: Template
    points: Floats
    scan: Surface
    reach: float = REACH
    _skin_tree: Any = field(init=False)
    _scan_tree: Any = field(init=False)
    _rim: Mask = field(init=False)  # (t, 3) free edges of the scan
    _rim_points: Mask = field(init=False)  # (m,) their ends
    _normals: Floats = field(init=False)  # (n, 3) of the registered skin
    _scan_normals: Floats = field(init=False)  # (m, 3) of the scan

    @classmethod
    def of(cls, registration: Registration, scan: Surface, reach: float = REACH) -> Transfer:
        """That of a registration to ``scan``, without what it found to be clutter."""
        from supple.surface import Surface

        kept = scan.triangles
        if len(registration.used) == len(scan.points):
            kept = kept[registration.used[kept].all(axis=1)]
        return cls(registration.template, registration.points, Surface(scan.points, kept), reach)

    def __post_init__(self) -> None:
        from supple.core import core

        if np.shape(self.points) != self.template.points.shape:
            raise InputError(
                f"points must be the template's {self.template.points.shape} vertices, m, got "
                f"{np.shape(self.points)}; give those of its registration."
            )
        skin, faces = self.template.triangles, self.scan.triangles
        rim, rim_points = free_edges(faces, self.scan.points), np.zeros(len(self.scan.points), bool)
        rim_points[edges(faces)[rim].ravel()] = True
        tree = core().SurfaceTree
        made = {
            "_skin_tree": tree(self.points, skin.astype(np.int32)),
            "_scan_tree": tree(self.scan.points, faces.astype(np.int32)) if len(faces) else None,
            "_rim": rim,
            "_rim_points": rim_points,
            "_normals": vertex_normals(self.points, skin),
            "_scan_normals": vertex_normals(self.scan.points, faces, _SMOOTHED),
        }
        for name, value in made.items():
            object.__setattr__(self, name, value)

    def to_scan(self, places: OnSurface) -> Carried:
        """Where places on the template are on the scan."""
        faces = self.template.triangles
        at, normals = places.at(self.points, faces), places.at(self._normals, faces)
        if self._scan_tree is None:
            return Carried(at, np.zeros(len(at), bool), np.zeros(len(at)), places.closed)
        shown, landed = self._shown(at, normals)
        there = np.where(shown[:, None], landed.point, at)
        return Carried(there, shown, np.where(shown, landed.distance, 0.0), places.closed)

    def to_template(self, points: npt.ArrayLike) -> Landed:
        """Which places of the template the points (k, 3) m of the scan are."""
        landed = self._skin_tree.closest(_points(points))
        places = OnSurface(landed.triangle.astype(np.int64), landed.barycentric)
        return Landed(places, landed.distance, landed.distance <= self.reach)

    def landmarks(self) -> dict[str, Carried]:
        """Every landmark of the template on the scan."""
        return {name: self.to_scan(place) for name, place in self.template.landmarks.items()}

    def curves(self, spacing: float | None = 2e-3) -> dict[str, Carried]:
        """The drawing on the scan.

        Args:
            spacing: longest distance (m) of points before they are put on the scan; None keeps
                those of the template.
        """
        return {name: self.to_scan(place if spacing is None else self._denser(place, spacing))
                for name, place in self.template.curves.items()}  # fmt: skip

    def map_to_scan(self, values: npt.ArrayLike) -> tuple[Floats, Mask]:
        """Values (n, …) of the template's vertices at the scan's points (m, …).

        Returns:
            The values, NaN where the skin is not in reach, and (m,) where it is.
        """
        given = _values(values, len(self.template.points), "the template's vertices")
        landed = self.to_template(self.scan.points)
        corners = given[self.template.triangles[landed.places.triangle]]
        return _weighted(landed.places.barycentric, corners, landed.within), landed.within

    def map_to_template(self, values: npt.ArrayLike) -> tuple[Floats, Mask]:
        """Values (m, …) of the scan's points at the template's vertices (n, …).

        Returns:
            The values, NaN where the scan does not show the skin, and (n,) where it does.
        """
        given = _values(values, len(self.scan.points), "the scan's points")
        if self._scan_tree is None:
            raise InputError("the scan has no triangles to interpolate in; give a surface.")
        shown, landed = self._shown(self.points, self._normals)
        corners = given[self.scan.triangles[landed.triangle]]
        return _weighted(landed.barycentric, corners, shown), shown

    def _denser(self, curve: OnSurface, spacing: float) -> OnSurface:
        """The curve with points added on the chords of the registered skin."""
        at = curve.at(self.points, self.template.triangles)
        ends = np.vstack([at, at[:1]]) if curve.closed else at
        steps = np.linalg.norm(np.diff(ends, axis=0), axis=1)
        counts = np.maximum(np.ceil(steps / spacing), 1).astype(int)
        along = np.concatenate([k + np.arange(n) / n for k, n in enumerate(counts)])
        if not curve.closed:
            along = np.append(along, len(ends) - 1)
        first = np.minimum(along.astype(int), len(ends) - 2)
        share = (along - first)[:, None]
        landed = self._skin_tree.closest((1 - share) * ends[first] + share * ends[first + 1])
        return OnSurface(landed.triangle.astype(np.int64), landed.barycentric, curve.closed)

    def _shown(self, points: Floats, normals: Floats) -> tuple[Mask, Any]:
        """Whether the scan shows points of the skin, and where it is closest to them."""
        landed = self._scan_tree.closest(np.ascontiguousarray(points))
        off = points - landed.point
        aside = off - np.einsum("kd,kd->k", off, landed.normal)[:, None] * landed.normal
        over_hole = self._on_rim(landed) & (np.linalg.norm(aside, axis=1) > RIM)
        corners = self._scan_normals[self.scan.triangles[landed.triangle]]
        scans = np.einsum("kc,kcd->kd", landed.barycentric, corners)
        cosine = np.einsum("kd,kd->k", normals, scans)
        facing = cosine > FACING * np.linalg.norm(scans, axis=1)
        return np.asarray((landed.distance <= self.reach) & facing & ~over_hole), landed

    def _on_rim(self, landed: Any) -> Mask:
        """Whether closest points lie on a free edge of the scan."""
        weights = landed.barycentric
        opposite = weights[:, [2, 0, 1]] <= 1e-9  # edge k runs from corner k to the next
        corner = self._rim_points[self.scan.triangles[landed.triangle]] & (weights >= 1 - 1e-9)
        return np.asarray(((self._rim[landed.triangle] & opposite) | corner).any(axis=1))


def _points(points: npt.ArrayLike) -> Floats:
    array = np.ascontiguousarray(points, dtype=np.float64)
    if array.ndim != 2 or array.shape[1] != 3 or not np.isfinite(array).all():
        raise InputError(f"points must be finite (k, 3) m, got shape {array.shape}; correct them.")
    return array


def _values(values: npt.ArrayLike, count: int, of: str) -> Floats:
    array = np.asarray(values, dtype=np.float64)
    if array.ndim == 0 or len(array) != count:
        raise InputError(f"values must be one for each of {of} ({count}), got {array.shape}.")
    return array


def _weighted(weights: Floats, corners: Floats, known: Mask) -> Floats:
    """Values (k, …) of corners (k, 3, …) by their weights (k, 3), NaN where not known."""
    mixed = np.einsum("kc,kc...->k...", weights, corners)
    mixed[~known] = np.nan
    return np.asarray(mixed)
