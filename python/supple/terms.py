"""A body's description → the terms of its equilibrium in the runtime, direct or inverse.

    regions, gravity, tractions, pressures, skins, sliding supports, nodal forces → _core.System

Structure (which terms on which cells) and values (parameters, loads) are apart: new values reach
the terms that exist, so pattern, reduction and symbolic factor live as long as the structure.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from .core import core
from .laws import compiled
from .solvers import Pick

if TYPE_CHECKING:
    from .kernels.reader import Law
    from .mesh import Mesh
    from .surface import Surface

Floats = npt.NDArray[np.float64]
Ints = npt.NDArray[np.int64]


@dataclass
class Region:
    """A law on some cells, or on some facets as their skin; values are (count, size) rows."""

    law: Law
    ids: Ints
    values: dict[str, Floats]


@dataclass
class FacetLoad:
    """A traction (3,) or a pressure (1,), Pa, on boundary facets as `Mesh.boundary` gives them."""

    facets: Ints
    value: Floats
    per: str = "rest"


@dataclass
class Slide:
    """Nodes held to a rigid surface without friction; stiffness (k,) N/m."""

    nodes: Ints
    surface: Surface
    stiffness: Floats


@dataclass
class Description:
    """What a body is made of; `Body` fills it, `build` reads it."""

    mesh: Mesh
    regions: list[Region]
    density: Floats  # (c, 1) kg/m³
    gravity: Floats  # (3,) m/s²
    forces: Floats  # (n, 3) N
    quadrature: int | None = None  # may name its scheme (kernels.degree)
    formulation: str = "displacement"
    tractions: list[FacetLoad] = field(default_factory=list)
    pressures: list[FacetLoad] = field(default_factory=list)
    skins: list[Region] = field(default_factory=list)  # ids are rows of `Mesh.boundary`
    slides: list[Slide] = field(default_factory=list)
    masses: Floats | None = None  # (n,) kg of the nodes, instead of the density

    @property
    def has_kinks(self) -> bool:
        """Forces are smooth in pieces only: skins go slack, faces are slid on."""
        return bool(self.skins or self.slides)


@dataclass
class FacetTerm:
    """The term of one kind of facet, and which rows of the load's or skin's facets it holds."""

    term: Any
    rows: Ints


@dataclass
class Built:
    """A runtime system and its terms, by the part of the description that each stands for."""

    system: Any
    regions: list[Any]
    skins: list[list[FacetTerm]]
    tractions: list[list[FacetTerm]]
    pressures: list[list[FacetTerm]]
    body_force: Any  # None where the nodes have masses
    forces: Any
    scalar_unit: float = 1.0  # Pa/m, see KernelTerm::set_scalar_unit
    solver: Pick | None = None  # of its last run


def build(
    d: Description, inverse: bool = False, density_of: str = "rest", suffix: str = ""
) -> Built:
    """Make the system; kernels that are not compiled yet are compiled here.

    Args:
        suffix: SENSITIVITY for terms that hold the sensitivity kernels instead.
    """
    system = new_system(d)
    built = Built(system, [], [], [], [], None, core().NodalForce(np.zeros(d.mesh.points.size)))
    built.scalar_unit = modulus(d) / d.mesh.size
    form = ("inverse" if inverse else "direct") + suffix
    for region in d.regions:
        built.regions.append(region_term(system, d, region, form) if len(region.ids) else None)
        if built.regions[-1] is not None:
            built.regions[-1].set_scalar_unit(built.scalar_unit)
    if d.masses is None:
        per_rest = inverse and density_of == "rest"
        load = "body_force_rest" if per_rest else "body_force"
        built.body_force = _load(system, load + suffix, d.mesh.element, _cells(d.mesh))
    for traction in d.tractions:
        moved = (traction.per == "rest") == inverse
        unit = "traction_moved" if moved else "traction"
        built.tractions.append(_facet_load(system, d, unit + suffix, traction))
    for pressure in d.pressures:
        unit = "pressure" if inverse else "pressure_moved"
        built.pressures.append(_facet_load(system, d, unit + suffix, pressure))
    for skin in d.skins:
        built.skins.append(skin_terms(system, d, skin, f"skin_{form}"))
    for slide in d.slides:
        system.add(_slide(system, slide, inverse))
    system.add(built.forces)
    return built


def refresh(built: Built, d: Description) -> None:
    """Hand the description's present values to the terms."""
    for term, region in zip(built.regions, d.regions, strict=True):
        if term is not None:
            set_values(term, region.values)
    for parts, skin in zip(built.skins, d.skins, strict=True):
        for part in parts:
            set_values(part.term, {n: v[part.rows] for n, v in skin.values.items()})
    if built.body_force is not None:
        weight = d.density * d.gravity
        built.body_force.set_field("value", weight.ravel())
        built.body_force.is_silent = not weight.any()
    for parts, load in [*zip(built.tractions, d.tractions, strict=True),
                        *zip(built.pressures, d.pressures, strict=True)]:  # fmt: skip
        for part in parts:
            part.term.set_field("value", np.tile(load.value, len(part.rows)))
    pull = 0.0 if d.masses is None else np.outer(d.masses, d.gravity)
    built.forces.set_forces((d.forces + pull).ravel())


def nodal_masses(d: Description) -> Floats:
    """∫ ρ N_a dV of every node over the description's own mesh (n,), kg; gravity pulls at them."""
    from .kernels.unit import Unit

    system = new_system(d)
    term = core().KernelTerm(compiled(Unit("body_force", d.mesh.element)), system, _cells(d.mesh))
    term.set_field("value", (d.density * [1.0, 0.0, 0.0]).ravel())
    force = -term.residual(np.zeros(d.mesh.points.size + system.scalars))
    return np.asarray(force[: d.mesh.points.size].reshape(-1, 3)[:, 0])


def new_system(d: Description) -> Any:
    """A runtime system of the mesh's dofs, and of the pressures in a mixed formulation."""
    return core().System(np.ascontiguousarray(d.mesh.points).ravel(), pressure_nodes(d).tolist())


def pressure_nodes(d: Description) -> Ints:
    """Nodes that carry a pressure: the corners in a mixed formulation, none in the others."""
    corners = d.mesh.table.corners if d.formulation == "mixed" else 0
    return np.unique(d.mesh.cells[:, :corners]).astype(np.int64)


def modulus(d: Description) -> float:
    """Largest modulus among the parameters, Pa; where p carries the volume, that of psi_dev."""
    found = []
    for region in d.regions:
        names = {p.name for p in region.law.parameters if p.kind.unit == "Pa"}
        if d.formulation == "mixed":
            names &= set(region.law.arguments("psi_dev", region.values))
        found += [float(region.values[name].max()) for name in names if len(region.ids)]
    return max(found, default=1.0)


def region_term(system: Any, d: Description, region: Region, form: str) -> Any:
    """The term of a law on its cells, added to the system."""
    from .kernels.unit import FORMULATIONS, Unit

    unit = Unit(FORMULATIONS[d.formulation] + form, d.mesh.element, region.law.path, d.quadrature)
    cells = _cells(d.mesh)[region.ids]
    if d.formulation == "mixed":
        corners = cells[:, : d.mesh.table.corners]
        scalars = np.searchsorted(pressure_nodes(d), corners) + len(d.mesh.points)
        cells = np.hstack([cells, scalars.astype(np.int32)])
    return _add(system, compiled(unit), cells)


def mass_term(system: Any, mesh: Mesh) -> Any:
    """The mass matrix of the mesh's shape functions, on the points of the system."""
    from .kernels.unit import Unit

    return core().KernelTerm(compiled(Unit("mass", mesh.element)), system, _cells(mesh))


def skin_terms(system: Any, d: Description, skin: Region, form: str) -> list[FacetTerm]:
    """The terms of a skin, one a kind of facet, added to the system."""
    from .kernels.unit import Unit

    return [
        FacetTerm(_add(system, compiled(Unit(form, kind, skin.law.path)), facets), rows)
        for kind, facets, rows in _facets(d.mesh, skin.ids)
    ]


def set_values(term: Any, values: dict[str, Floats]) -> None:
    """Parameters (count, size) to the term's fields."""
    for name, value in values.items():
        term.set_field(name, value.ravel())


def _load(system: Any, form: str, element: str, cells: npt.NDArray[np.int32]) -> Any:
    from .kernels.unit import Unit

    term = _add(system, compiled(Unit(form, element)), cells)
    term.is_load = True
    return term


def _facet_load(system: Any, d: Description, form: str, load: FacetLoad) -> list[FacetTerm]:
    return [
        FacetTerm(_load(system, form, kind, facets), rows)
        for kind, facets, rows in _facets(d.mesh, load.facets)
    ]


def _add(system: Any, library: str, cells: npt.NDArray[np.int32]) -> Any:
    term = core().KernelTerm(library, system, cells)
    system.add(term)
    return term


def _slide(system: Any, slide: Slide, inverse: bool) -> Any:
    surface = slide.surface
    return core().Sliding(
        system, slide.nodes.tolist(), slide.stiffness, surface.points,
        surface.triangles.astype(np.int32), inverse,
    )  # fmt: skip


def _cells(mesh: Mesh) -> npt.NDArray[np.int32]:
    """Cells in kernel order."""
    return np.ascontiguousarray(mesh.cells[:, mesh.table.from_vtk], dtype=np.int32)


def _facets(mesh: Mesh, facets: Ints) -> Iterator[tuple[str, npt.NDArray[np.int32], Ints]]:
    """Facets in kernel order and which rows they are, by the name of their element."""
    from .mesh_topology import by_kind

    for kind, rows in by_kind(facets, mesh.table):
        yield kind.name, np.ascontiguousarray(facets[np.ix_(rows, kind.from_vtk)], np.int32), rows


def snapshot(d: Description) -> Description:
    """A copy that later changes of the body do not reach; arrays are shared, never written to."""
    regions = [Region(r.law, r.ids, dict(r.values)) for r in d.regions]
    return replace(d, regions=regions)
