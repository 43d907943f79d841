"""A torso template: a skin with bones, blend weights, blendshapes, landmarks and drawn curves."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from types import MappingProxyType

import numpy as np
import numpy.typing as npt

from supple.errors import InputError, MeshError
from supple.mesh_checks import checked_ids, checked_points

Floats = npt.NDArray[np.float64]
Ints = npt.NDArray[np.int64]

#: Bones of the thesis' torso, parents before children: name, parent.
BONES = (
    ("abdomen", -1), ("chest", 0), ("neck", 1), ("shoulder_left", 1), ("shoulder_right", 1),
    ("arm_left", 3), ("arm_right", 4), ("breast_left", 1), ("breast_right", 1),
)  # fmt: skip
#: Landmarks of a breast surgeon's drawing: two on the midline, five on each side.
LANDMARKS = (
    "sternal_notch", "xiphoid",
    *(f"{name}_{side}" for side in ("left", "right") for name in
      ("nipple", "axilla", "breast_medial", "breast_lateral", "breast_inferior")),
)  # fmt: skip
#: The drawing: two arrows along the sternum and the outlines of the breasts.
CURVES = ("sternum_arrow_upper", "sternum_arrow_lower", "breast_left", "breast_right")
#: Parts of the skin that every template names; a vertex may be in several or in none.
REGIONS = (
    "breast_left", "breast_right", "sternum", "back", "abdomen", "neck", "arm_left", "arm_right",
)  # fmt: skip


@dataclass(frozen=True)
class Bone:
    """A bone of its own rotation, translation and scale, tied to its parent at ``joint``."""

    name: str
    parent: int  #: number of an earlier bone; -1 of the root
    joint: tuple[float, float, float]  #: m, on the template


@dataclass(frozen=True, eq=False, repr=False)
class OnSurface:
    """Points in triangles of a surface, so that they move with it.

    Attributes:
        triangle: (k,) numbers of triangles.
        barycentric: (k, 3) weights of their corners, which sum to 1.
        closed: of a curve: its last point is followed by its first.
    """

    triangle: Ints
    barycentric: Floats
    closed: bool = False

    def at(self, points: Floats, triangles: Ints) -> Floats:
        """Where they are, (k, 3) m, when the vertices are at ``points`` (n, 3) m."""
        corners = points[triangles[self.triangle]]
        return np.asarray(np.einsum("kc,kcd->kd", self.barycentric, corners))

    def __len__(self) -> int:
        return len(self.triangle)


@dataclass(frozen=True, eq=False, repr=False)
class Template:
    """A torso at rest: upright, arms a little away from the body, LPS, m.

    Attributes:
        points: (n, 3) m: +x the patient's left, +y to the back, +z to the head.
        triangles: (t, 3), counter-clockwise seen from outside.
        bones: K of them, a parent before its children, the root first.
        weights: (n, K) of the bones at each vertex: ≥ 0, each row sums to 1.
        blendshapes: (A, n, 3) m, what a coefficient of 1 adds to ``points``.
        blendshape_names: A names; those of a pair end in ``_left`` and ``_right``.
        blendshape_bounds: (A, 2) least and largest coefficient that still is a body; 0 is inside.
        landmarks: name → one point on the skin, `LANDMARKS` among them.
        curves: name → the drawing, `CURVES` among them.
        regions: name → (n,) bool, `REGIONS` among them.
        mirror: (n,) the vertex opposite in the plane x = 0; itself on the midline.
        name: of the template.
        source: where its shape is from, and its licence.

    Raises:
        MeshError, InputError: shapes, numbers or names that contradict each other.
    """

    points: Floats
    triangles: Ints
    bones: tuple[Bone, ...]
    weights: Floats
    blendshapes: Floats
    blendshape_names: tuple[str, ...]
    blendshape_bounds: Floats
    landmarks: Mapping[str, OnSurface]
    curves: Mapping[str, OnSurface]
    regions: Mapping[str, npt.NDArray[np.bool_]]
    mirror: Ints
    name: str = "torso"
    source: str = ""
    _joints: Floats = field(init=False)
    _parents: Ints = field(init=False)

    def __post_init__(self) -> None:
        n, bones, shapes = len(self.points), len(self.bones), len(self.blendshape_names)
        self._put("points", checked_points(self.points))
        self._put("triangles", checked_ids(self.triangles, 3, n, "triangles"))
        self._put("_joints", _numbers([bone.joint for bone in self.bones], (bones, 3), "joints"))
        self._put("_parents", np.array([bone.parent for bone in self.bones]))
        self._put("weights", _numbers(self.weights, (n, bones), "weights"))
        self._put("blendshapes", _numbers(self.blendshapes, (shapes, n, 3), "blendshapes"))
        bounds = _numbers(self.blendshape_bounds, (shapes, 2), "blendshape_bounds")
        self._put("blendshape_bounds", bounds)
        self._put("mirror", checked_ids(np.asarray(self.mirror)[:, None], 1, n, "mirror").ravel())
        for name in ("landmarks", "curves", "regions"):
            self._put(name, MappingProxyType(dict(getattr(self, name))))
        self._check()
        for array in (self.points, self.triangles, self.weights, self.blendshapes, bounds,
                      self.mirror, self._joints, self._parents):  # fmt: skip
            array.flags.writeable = False

    def _put(self, name: str, value: object) -> None:
        object.__setattr__(self, name, value)

    def _check(self) -> None:
        if not self.bones or any(p >= k or (p < 0) != (k == 0) for k, p in enumerate(self.parents)):
            raise InputError("bones must begin with the root (parent -1), parents before children.")
        if self.weights.min() < 0 or abs(self.weights.sum(axis=1) - 1).max() > 1e-9:
            raise InputError("weights must be ≥ 0, and those of a vertex must sum to 1.")
        low, high = self.blendshape_bounds.T
        if (low > 0).any() or (high < 0).any():
            raise InputError("blendshape_bounds must hold 0, the template itself.")
        every = np.arange(len(self.points))
        if len(self.mirror) != len(every) or not np.array_equal(self.mirror[self.mirror], every):
            raise InputError(f"mirror must name {len(every)} vertices, mirror[mirror[i]] == i.")
        for place, needed in (("landmarks", LANDMARKS), ("curves", CURVES), ("regions", REGIONS)):
            missing = [name for name in needed if name not in getattr(self, place)]
            if missing:
                raise InputError(f"{place} must name {', '.join(missing)} too.")
        for name, part in {**self.landmarks, **self.curves}.items():
            if len(part) == 0 or part.triangle.max() >= len(self.triangles):
                raise MeshError(f"{name!r} must lie on triangles 0 to {len(self.triangles) - 1}.")
            if abs(part.barycentric.sum(axis=1) - 1).max() > 1e-9:
                raise InputError(f"barycentric of {name!r} must sum to 1 in each row.")
        for name, region in self.regions.items():
            if region.shape != (len(self.points),) or region.dtype != bool:
                raise InputError(f"region {name!r} must be a mask ({len(self.points)},) of bool.")

    @property
    def joints(self) -> Floats:
        """(K, 3) m."""
        return self._joints

    @property
    def parents(self) -> Ints:
        """(K,) numbers of bones, -1 of the root."""
        return self._parents

    def landmark_points(self, points: Floats | None = None) -> dict[str, Floats]:
        """Each landmark (3,) m, of the template or with its vertices at ``points`` (n, 3) m."""
        at = self.points if points is None else points
        return {name: part.at(at, self.triangles)[0] for name, part in self.landmarks.items()}

    def curve_points(self, points: Floats | None = None) -> dict[str, Floats]:
        """Each curve (k, 3) m, of the template or with its vertices at ``points`` (n, 3) m."""
        at = self.points if points is None else points
        return {name: part.at(at, self.triangles) for name, part in self.curves.items()}

    def __repr__(self) -> str:
        return (f"Template({self.name!r}, {len(self.points)} points, {len(self.bones)} bones, "
                f"{len(self.blendshape_names)} blendshapes)")  # fmt: skip


def _numbers(value: npt.ArrayLike, shape: tuple[int, ...], name: str) -> Floats:
    array = np.array(value, dtype=np.float64).reshape(
        shape if np.size(value) == 0 else np.shape(value)
    )
    if array.shape != shape or not np.isfinite(array).all():
        raise InputError(f"{name} must be finite numbers of shape {shape}, got {array.shape}.")
    return array
