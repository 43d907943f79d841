"""From a fit to finite elements: the front of the torso, closed by a chest wall, as tetrahedra.

skin around both breasts ─► chest wall behind it ─► closed surface ─► signed distance
─► lattice cut along its zero, remeshed (supple.tetrahedra) ─► facets tagged by what they face
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from supple.errors import InputError, MeshError
from supple.registration.breast_patch import SIDES
from supple.registration.chest_wall import around, stretched
from supple.registration.outline import Cut, cut_along, cut_at
from supple.registration.skin import vertex_normals
from supple.surface import Surface

if TYPE_CHECKING:
    from supple.mesh import Mesh
    from supple.registration.registration import Registration
    from supple.registration.template import Template

Floats = npt.NDArray[np.float64]
Ints = npt.NDArray[np.int64]

#: What a facet faces, in the order of `Front.part`; names of the mesh's tags.
PARTS = ("skin", "chest", "cut")
#: How often the normals are smoothed along which the chest wall is moved back.
_SMOOTHED = 3


@dataclass(frozen=True)
class FrontSettings:
    """Lengths in m.

    Attributes:
        margin: how far the body goes on beyond the outlines of the breasts.
        depth: of the chest wall behind the skin around the breasts: their tissue goes on there.
        size: longest edge of the tetrahedra.
    """

    margin: float = 30e-3
    depth: float = 12e-3
    size: float = 12e-3

    def __post_init__(self) -> None:
        for name in ("margin", "depth", "size"):
            if not 1e-3 <= getattr(self, name) <= 0.1:
                raise InputError(
                    f"{name} must be 0.001 to 0.1 m, got {getattr(self, name)}; correct it."
                )


@dataclass(frozen=True, eq=False, repr=False)
class Front:
    """The closed surface, and what each of its triangles (t,) is: 0 skin, 1 chest wall, 2 cut."""

    surface: Surface
    part: Ints


def closed(registration: Registration, settings: FrontSettings | None = None) -> Surface:
    """The registered front of the torso, closed by a chest wall; outward, m, the scan's frame.

    Raises:
        MeshError: the outlines are so far apart that ``margin`` does not join them.
    """
    return front(registration, settings or FrontSettings()).surface


def front(registration: Registration, settings: FrontSettings) -> Front:
    """The same with its parts.

    The chest wall goes on from the skin around the breasts (`chest_wall`), moved
    back by ``depth`` along its normals; a strip joins it to the rim of the skin.
    """
    template, vertices = registration.template, registration.points
    cut = _cut(template, settings.margin)
    support = around(template, cut)
    inner, weights = stretched(template, cut, support)
    skin = cut.at(vertices)
    wall = skin.copy()
    wall[inner] = weights @ np.vstack([skin[cut.rim], vertices[support]])
    wall = wall - settings.depth * vertex_normals(wall, cut.triangles, _SMOOTHED)
    q, next_ = len(skin), np.roll(cut.rim, -1)
    strip = np.vstack([np.stack([cut.rim, q + cut.rim, next_], axis=1),
                       np.stack([next_, q + cut.rim, q + next_], axis=1)])  # fmt: skip
    triangles = np.vstack([cut.triangles, q + cut.triangles[:, ::-1], strip])
    part = np.repeat([0, 1, 2], [len(cut.triangles), len(cut.triangles), len(strip)])
    return Front(Surface(np.vstack([skin, wall]), triangles), part)


def body_mesh(registration: Registration, settings: FrontSettings | None = None) -> Mesh:
    """Tetrahedra (P1) of the registered front, m, in the scan's frame.

    Returns:
        A mesh whose boundary facets are tagged "skin", "chest" (wall) and "cut", where the body
        goes on in the patient.

    Raises:
        InputError: a length that is none. MeshError: no valid mesh came out.
    """
    from supple.mesh import Mesh
    from supple.mesh_tags import Tag

    s = settings or FrontSettings()
    body = front(registration, s)
    points, cells = _tetrahedra(body.surface, s)
    plain = Mesh(1e-3 * points, cells.astype(np.int64), "P1")
    facets = plain.boundary()
    landed = body.surface.closest(plain.points[facets].mean(axis=1))
    part = body.part[landed.triangle]
    missing = [name for k, name in enumerate(PARTS) if not (part == k).any()]
    if missing:
        raise MeshError(f"no facet of the mesh is {missing[0]}; take a smaller size.")
    tags = {name: Tag("facets", facets[part == k]) for k, name in enumerate(PARTS)}
    return Mesh(plain.points, plain.cells, "P1", tags)


def _cut(template: Template, margin: float) -> Cut:
    """The skin within the margin of the outlines, the corner between them filled, without arms."""
    left, right = (cut_along(template, f"breast_{side}", f"nipple_{side}").distance
                   for side in SIDES)  # fmt: skip
    both = -margin * np.logaddexp(-left / margin, -right / margin)  # a smooth minimum
    arms = [k for k, bone in enumerate(template.bones) if bone.name.startswith("arm")]
    of_arms = (template.weights[:, arms].sum(axis=1) - 0.5) * 0.1  # m: a level, no distance
    level = np.maximum(both - margin, of_arms)
    return cut_at(template, level, f"the outlines of the breasts, a margin of {margin:g} m wider,")


def _tetrahedra(surface: Surface, s: FrontSettings) -> tuple[Floats, npt.NDArray[np.int32]]:
    """Nodes (n, 3) mm and positive cells (c, 4) inside a closed surface."""
    from supple import tetrahedra

    edge = 1e3 * min(s.size / 2, s.depth / 2)
    low, high = 1e3 * surface.points.min(axis=0), 1e3 * surface.points.max(axis=0)
    nodes, cells = tetrahedra.lattice(low - 1.5 * edge, high - low + 3 * edge, edge)
    level = 1e3 * _signed_distance(surface, 1e-3 * nodes)
    kept = cells[level[cells].min(axis=1) < edge]
    points, cells = tetrahedra.cut_along_zero(*tetrahedra.compact(nodes, kept, level))
    points, cells, parts = tetrahedra.largest_parts(points, cells, 0.05)
    if parts != 1:
        raise MeshError(f"the front of the torso falls into {parts} parts; take a larger depth.")
    wanted = np.full(len(points), 1e3 * s.size)
    return tetrahedra.remesh(points, cells, wanted, gradation=1.5, chord=1e3 * s.size / 8)


def _signed_distance(surface: Surface, places: Floats) -> Floats:
    """(k,) m to a closed surface, negative inside."""
    from supple.overlap import windings

    distance = surface.closest(places).distance
    inside = windings(surface.points, surface.triangles, places) > 0
    return np.asarray(np.where(inside, -distance, distance))
