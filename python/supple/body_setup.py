"""What a body is: a mesh, its laws and their parameters, supports and loads."""

from __future__ import annotations

import copy
import threading
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Self

import numpy as np
import numpy.typing as npt

from . import body_checks as checks
from . import parameters, supports, terms
from .errors import InputError
from .laws import read_law
from .mesh_tags import CellWhere, Where

if TYPE_CHECKING:
    from .mesh import Mesh
    from .surface import Surface


class Setup:
    """The part of `Body` that says what is to be solved; its arguments are described there."""

    def __init__(
        self,
        mesh: Mesh,
        material: str | Path,
        formulation: str = "displacement",
        density: npt.ArrayLike = 0.0,
        quadrature: int | tuple[int, str] | None = None,
        **values: Any,
    ) -> None:
        law, count = read_law(material), len(mesh.cells)
        checks.require_offered(formulation, mesh.element)
        checks.require_split(law, formulation)
        region = terms.Region(law, np.arange(count), parameters.defaults(law, count))
        region.values |= parameters.given(law, values, count)
        rho = parameters.per_cell("density", density, count)
        if not (np.isfinite(rho).all() and (rho >= 0).all()):
            raise InputError(f"density must be at least 0 kg/m³, got {rho.min():g}.")
        n = len(mesh.points)
        self._description = terms.Description(
            mesh,
            [region],
            rho,
            np.zeros(3),
            np.zeros((n, 3)),
            checks.degree(mesh, quadrature),
            formulation,
        )
        self._fixed = np.zeros((n, 3), dtype=bool)
        self._prescribed = np.zeros((n, 3))
        self._restructured()
        self._busy = threading.Lock()

    @property
    def mesh(self) -> Mesh:
        """The mesh, m."""
        return self._description.mesh

    # Laws and parameters

    def region(self, cells: CellWhere, material: str | Path, **values: Any) -> Self:
        """Another law on some cells: a mask, ids or a tag. Values as in the constructor."""
        d, law = self._description, read_law(material)
        checks.require_split(law, d.formulation)
        ids = self.mesh.cell_ids(cells)
        new = terms.Region(law, ids, parameters.defaults(law, len(ids)))
        new.values |= parameters.given(law, values, len(ids))
        for old in d.regions:
            keep = ~np.isin(old.ids, ids)
            old.ids = old.ids[keep]
            old.values = {name: value[keep] for name, value in old.values.items()}
        d.regions.append(new)
        return self._restructured()

    def set(self, where: CellWhere | None = None, **values: Any) -> Self:
        """New parameters, scalars or one a chosen cell (all cells if ``where`` is None)."""
        chosen = np.arange(len(self.mesh.cells)) if where is None else self.mesh.cell_ids(where)
        changes = []  # all checked before the first is made
        for region in self._description.regions:
            inside = np.isin(region.ids, chosen)
            if inside.any():
                new = parameters.given(region.law, values, len(chosen))
                rows = np.searchsorted(chosen, region.ids[inside])
                changes.append((region, inside, {n: v[rows] for n, v in new.items()}))
        for region, inside, new in changes:
            for name, value in new.items():
                changed = region.values[name].copy()
                changed[inside] = value
                region.values[name] = changed
        return self

    def skin(
        self, where: Where, material: str | Path, thickness: npt.ArrayLike, **values: Any
    ) -> Self:
        """A membrane on the boundary facets of ``where`` that carries tension only.

        Args:
            thickness: m at rest, one number or one a facet.
            **values: the law's parameters; poisson is 0.5 unless given, a skin keeps its volume.
        """
        facets, law = self.mesh.boundary(where), read_law(material)
        skin = terms.Region(law, facets, parameters.defaults(law, len(facets), skin=True))
        skin.values |= parameters.given(law, values, len(facets), skin=True)
        skin.values["thickness"] = parameters.per_cell("thickness", thickness, len(facets))
        if not (skin.values["thickness"] > 0).all():
            raise InputError(f"thickness must be above 0 m, got {np.min(thickness):g}.")
        self._description.skins.append(skin)
        return self._restructured()

    def set_skin(self, number: int = 0, **values: Any) -> Self:
        """New parameters of the skin that was added as the ``number``-th."""
        skins = self._description.skins
        if not skins:
            raise InputError("set_skin needs a skin, and the body has none; add one by skin().")
        if not 0 <= number < len(skins):
            raise InputError(f"number must name one of {len(skins)} skins, got {number}.")
        skin = skins[number]
        skin.values |= parameters.given(skin.law, values, len(skin.ids), skin=True)
        return self

    # Supports

    def fix(self, where: Where) -> Self:
        """Hold the nodes of ``where`` in place."""
        return self.prescribe(where, (0.0, 0.0, 0.0))

    def prescribe(self, where: Where, u: npt.ArrayLike) -> Self:
        """Give the nodes of ``where`` the displacement ``u``, m: (3,) or one row a node.

        A NaN leaves its component as it was, so planes of symmetry add up where they meet.
        """
        nodes, value = self.mesh.nodes(where), np.asarray(u, dtype=float)
        if value.shape not in ((3,), (len(nodes), 3)):
            raise InputError(f"u must have shape (3,) or ({len(nodes)}, 3), got {value.shape}.")
        if np.isinf(value).any():
            raise InputError("u must be finite, or NaN where a component is free, got infinity.")
        value = np.broadcast_to(value, (len(nodes), 3))
        given = ~np.isnan(value)
        self._fixed[nodes] |= given
        self._prescribed[nodes] = np.where(given, value, self._prescribed[nodes])
        return self

    def slide(
        self, where: Where, surface: Surface, compliance: float = 1e-8, per_node: bool = False
    ) -> Self:
        """Hold the nodes of ``where`` to a rigid surface, free to slide on it.

        A rest shape and a solve on it come back to the shape given but for the depth to which the
        nodes sink in, compliance × force.

        Args:
            compliance: m/N of the whole region, shared by tributary area; of each node if
                ``per_node`` (Mazier 2022 uses 1e-8 m/N).
        """
        if not compliance > 0:
            raise InputError(f"compliance must be above 0 m/N, got {compliance}.")
        nodes = self.mesh.nodes(where)
        share = np.ones(len(nodes)) if per_node else supports.node_shares(self.mesh, nodes)
        self._description.slides.append(terms.Slide(nodes, surface, share / compliance))
        return self._restructured()

    # Loads

    def force(self, where: Where, force: npt.ArrayLike) -> Self:
        """Add ``force``, N, on the nodes of ``where``: (3,) on each, or one row a node."""
        forces, nodes = self._description.forces.copy(), self.mesh.nodes(where)
        rows = np.ndim(force) == 2
        forces[nodes] += (
            checks.rows("force", force, len(nodes)) if rows else checks.vector("force", force)
        )
        self._description.forces = forces
        return self

    def traction(self, where: Where, traction: npt.ArrayLike, per: str = "rest") -> Self:
        """Add a dead traction (3,) Pa on the facets of ``where``, per "rest" or "loaded" area."""
        if per not in ("rest", "loaded"):
            raise InputError(f'per must be "rest" or "loaded", got {per!r}.')
        load = terms.FacetLoad(self.mesh.boundary(where), checks.vector("traction", traction), per)
        self._description.tractions.append(load)
        return self._restructured()

    def pressure(self, where: Where, pressure: float) -> Self:
        """Add a pressure, Pa, that follows the facets of ``where`` and pushes inwards."""
        if not np.isfinite(pressure):
            raise InputError(f"pressure must be a number in Pa, got {pressure}.")
        load = terms.FacetLoad(self.mesh.boundary(where), np.array([float(pressure)]))
        self._description.pressures.append(load)
        return self._restructured()

    def gravity(self, g: npt.ArrayLike) -> Self:
        """Set the acceleration of gravity (3,), m/s²."""
        self._description.gravity = checks.vector("gravity", g)
        return self

    def clear_loads(self) -> Self:
        """Remove gravity, forces, tractions and pressures."""
        d = self._description
        d.gravity, d.forces = np.zeros(3), np.zeros_like(d.forces)
        d.tractions.clear()
        d.pressures.clear()
        return self._restructured()

    def on(self, mesh: Mesh) -> Self:
        """The same laws, supports and loads on a moved copy of the mesh, such as ``rest.mesh``."""
        if mesh.element != self.mesh.element or not np.array_equal(mesh.cells, self.mesh.cells):
            raise InputError("mesh must have the cells of the body's own mesh; use mesh.moved().")
        body = copy.copy(self)
        snapshot = terms.snapshot(self._description)
        body._description = replace(
            snapshot,
            mesh=mesh,
            tractions=list(snapshot.tractions),
            pressures=list(snapshot.pressures),
            skins=[terms.Region(s.law, s.ids, dict(s.values)) for s in snapshot.skins],
            slides=list(snapshot.slides),
        )
        body._fixed, body._prescribed = self._fixed.copy(), self._prescribed.copy()
        return body

    # Inside

    def _weighed_in(self, state: str) -> Self:
        """A copy, its density that at rest or its nodes with the masses of the loaded shape."""
        body = self.on(self.mesh)
        if state == "loaded" and body._description.masses is None:
            body._description.masses = terms.nodal_masses(self._description)
        return body

    def _reversed(self) -> Self:
        body = self.on(self.mesh)
        d = body._description
        d.gravity, d.forces = -d.gravity, -d.forces
        d.tractions = [replace(t, value=-t.value) for t in d.tractions]
        d.pressures = [replace(p, value=-p.value) for p in d.pressures]
        body._prescribed = -body._prescribed
        return body

    def _restructured(self) -> Self:
        self._built: dict[tuple[bool, str], terms.Built] = {}
        self._judging: dict[tuple[bool, str], terms.Built] = {}  # on rest shapes that are found
        return self

    def __getstate__(self) -> dict[str, Any]:
        """What a copy gets, here or in another process: nothing of the runtime."""
        return {n: v for n, v in vars(self).items() if n not in ("_built", "_judging", "_busy")}

    def __setstate__(self, state: dict[str, Any]) -> None:
        vars(self).update(state)
        self._busy = threading.Lock()
        self._restructured()
