"""A body: a mesh with laws, supports and loads; solved forward, or back to its rest shape."""

from __future__ import annotations

import copy
import threading
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from . import assembly, failures, many, newton, parameters, supports, terms
from . import body_checks as checks
from .alone import alone
from .errors import InputError
from .laws import read_law
from .mesh_tags import CellWhere, Where
from .newton import Progress, Settings
from .state import Rest, State, outcome

if TYPE_CHECKING:
    from .mesh import Mesh
    from .surface import Surface


class Body:
    """A mesh with a law on its cells.

    Args:
        mesh: points in m.
        material: name of a shipped energy, or path of an energy file.
        formulation: "displacement"; "mixed" (continuous pressure; P2, Q2L) or "mean-dilatation"
            (one volume ratio a cell; Q1), free of locking, for laws with psi_dev and psi_vol.
        density: kg/m³, of the rest state; one number or one a cell.
        quadrature: degree of the stiffness' rule, or (degree, scheme) with a scheme "default",
            "gauss_jacobi", "gll" (hexahedra) or "xiao_gimbutas" (tetrahedra; prisms, whose rules
            are a triangle's times Gauss'); None for the element's own (DESIGN §4).
        **values: the law's parameters in SI, each one number or one a cell.

    Raises:
        MaterialError: unknown law or parameter, value out of bounds, wrong energy file.
        InputError: a wrong shape or formulation, a negative density.
    """

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

    def region(self, cells: CellWhere, material: str | Path, **values: Any) -> Body:
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

    def set(self, where: CellWhere | None = None, **values: Any) -> Body:
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
    ) -> Body:
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

    def set_skin(self, number: int = 0, **values: Any) -> Body:
        """New parameters of the skin that was added as the ``number``-th."""
        skins = self._description.skins
        if not 0 <= number < len(skins):
            raise InputError(f"number must name one of {len(skins)} skins, got {number}.")
        skin = skins[number]
        skin.values |= parameters.given(skin.law, values, len(skin.ids), skin=True)
        return self

    # Supports

    def fix(self, where: Where) -> Body:
        """Hold the nodes of ``where`` in place."""
        return self.prescribe(where, (0.0, 0.0, 0.0))

    def prescribe(self, where: Where, u: npt.ArrayLike) -> Body:
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
    ) -> Body:
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

    def force(self, where: Where, force: npt.ArrayLike) -> Body:
        """Add ``force``, N, on the nodes of ``where``: (3,) on each, or one row a node."""
        forces, nodes = self._description.forces.copy(), self.mesh.nodes(where)
        rows = np.ndim(force) == 2
        forces[nodes] += (
            checks.rows("force", force, len(nodes)) if rows else checks.vector("force", force)
        )
        self._description.forces = forces
        return self

    def traction(self, where: Where, traction: npt.ArrayLike, per: str = "rest") -> Body:
        """Add a dead traction (3,) Pa on the facets of ``where``, per "rest" or "loaded" area."""
        if per not in ("rest", "loaded"):
            raise InputError(f'per must be "rest" or "loaded", got {per!r}.')
        load = terms.FacetLoad(self.mesh.boundary(where), checks.vector("traction", traction), per)
        self._description.tractions.append(load)
        return self._restructured()

    def pressure(self, where: Where, pressure: float) -> Body:
        """Add a pressure, Pa, that follows the facets of ``where`` and pushes inwards."""
        if not np.isfinite(pressure):
            raise InputError(f"pressure must be a number in Pa, got {pressure}.")
        load = terms.FacetLoad(self.mesh.boundary(where), np.array([float(pressure)]))
        self._description.pressures.append(load)
        return self._restructured()

    def gravity(self, g: npt.ArrayLike) -> Body:
        """Set the acceleration of gravity (3,), m/s²."""
        self._description.gravity = checks.vector("gravity", g)
        return self

    def clear_loads(self) -> Body:
        """Remove gravity, forces, tractions and pressures."""
        d = self._description
        d.gravity, d.forces = np.zeros(3), np.zeros_like(d.forces)
        d.tractions.clear()
        d.pressures.clear()
        return self._restructured()

    # Solving

    def solve_many(
        self,
        parameters: Sequence[Any],
        processes: int | None = None,
        warm: bool = True,
        reduce: Callable[[State], Any] | None = None,
        change: Callable[[Body, Any], object] = many.change,
        progress: Callable[[int, int], None] | None = None,
        **settings: Any,
    ) -> list[Any]:
        """Equilibrium for each of many sets of parameters, in several processes at once.

        Each is this body with the changes of one entry and of no other; the body stays as it is.

        Args:
            parameters: mappings from names to values. "young" is a parameter of all cells, a number
                or one a cell; "tumour.young" of the cells of that tag; "skin.young" of the first
                skin; "gravity" the acceleration (3,) m/s².
            processes: at most as many as processors if None, and only this one where spawning more
                would take longer than to do the work. Each has one thread and a copy of the body.
                1 keeps to this process, and so does a call inside of a worker.
            warm: start from what the same process has solved nearby, and from zero where that
                fails. False is from zero always, with ``solver="direct"`` unless another is asked
                for: the same to the last bit in any order and by any processes.
            reduce: called with each state where it was solved; what it returns is all that comes
                back, so that large states need not.
            change: what an entry means where a mapping does not say it: ``change(body, entry)``
                makes the changes.
            progress: called with how many are done, and of how many; may raise to stop.
            **settings: load_steps, rtol, atol, max_iterations, solver: as in `solve`.

        Returns:
            in the order of ``parameters``, the `State` (or what ``reduce`` made of it); where
            there is none, the `ConvergenceError`, or the `SuppleError` of a process that died.
            Those of other entries are there all the same.

        Raises:
            InputError: an entry that does not fit the body, before anything is solved; functions
                that another process cannot import.
        """
        asked = many.Request(parameters, processes, warm, reduce, change, progress, settings)
        return many.solve(self, asked)

    @alone
    def solve(
        self,
        start: State | None = None,
        load_steps: int | None = None,
        rtol: float = 1e-10,
        atol: float | None = None,
        max_iterations: int = 25,
        solver: str = "auto",
        progress: Progress | None = None,
    ) -> State:
        """Equilibrium under the loads.

        Args:
            start: a state of this mesh to start from; from zero if None.
            load_steps: equal steps; if None the whole load at once, and where that fails along
                the path of equilibria.
            rtol: of max(‖external force‖, ‖reactions‖); the last step is ≤ 1e-8 of the size too.
            atol: N; rounding of the stiffness if None.
            max_iterations: of each load step.
            solver: of the linear equations. "direct" factorises at every iteration, but for a last
                one that the factor at hand is sure to be enough for. "pardiso" (extra "mkl") does
                the same by MKL's library. "cg" keeps factors, in single precision where that
                serves, over iterations, load steps and solves of this body, and iterates on them,
                so that a result depends on what was solved before, by less than the tolerances.
                "multigrid" (extra "multigrid") never factorises the whole matrix: for large bodies.
                "auto" picks one; `State.timings["solver"]` says which and why.
            progress: called with a dict after each iteration; may raise to stop.

        Raises:
            InputError: nothing resists a rigid motion, or a wrong argument.
            ConvergenceError: cause, history, worst cells, load factor; the body is as before.
        """
        settings = Settings(load_steps, rtol, atol, max_iterations, progress, solver=solver)
        begin = None if start is None else assembly.unknowns_of(self, start)
        result, built = newton.run(self, settings, begin)
        failures.require_converged(result, built, self._description)
        solved = terms.snapshot(self._description)
        return State(
            **outcome(result, built, self._description, self._fixed), _solved=solved, _form="direct"
        )

    @alone
    def rest_shape(
        self,
        method: str = "inverse",
        density_of: str = "rest",
        directions_of: str = "rest",
        start: Rest | None = None,
        load_steps: int | None = None,
        rtol: float = 1e-10,
        atol: float | None = None,
        max_iterations: int = 25,
        solver: str = "auto",
        progress: Progress | None = None,
        check_overlap: bool = False,
        **fixed_point_options: Any,
    ) -> Rest:
        """The shape without the loads, taking the mesh for the loaded shape.

        Args:
            method: "inverse" (exact, one solve); "sellier", "sellier-aitken", "sellier-anderson"
                (forward solves until the loaded shape is met); or "reversed-gravity" (approximate:
                the loads act the other way on the loaded shape; Mazier 2022, chapter 5).
            density_of: the state, "rest" or "loaded", that `density` counts in.
            directions_of: the state, "rest" or "loaded", in which the laws' directions (fibres) lie
                as given. An image of the loaded shape shows "loaded" ones; those at rest are then
                found with the shape: f0 along F̄⁻¹ f, F̄ a cell's average deformation gradient.
                Either way `Rest.body` has those at rest.
            start: a rest shape of this mesh to start from, as after a small change of the body;
                from the mesh itself if None.
            load_steps, rtol, atol, max_iterations, progress: as in `solve`.
            solver: of the inverse's unsymmetric tangents: "gmres" on few symmetric factorisations,
                LU where it gets nowhere; "direct" is LU always; "auto" takes "gmres", and
                "direct" for bodies with skins or sliding supports, whose forces have kinks.
            check_overlap: refuse a rest shape of which two parts are in one place
                (`supple.overlap.overlapping`); one with cells inside out is always refused.
            **fixed_point_options: of the methods of "sellier": `fixed_point.FixedPoint`.

        Raises:
            InputError: as in `solve`.
            ConvergenceError: there is no such rest shape, or none was found, with the cause; or
                the directions at rest do not settle.
        """
        from . import rest_shape  # and all that it needs: a body that is only solved does not

        settings = Settings(load_steps, rtol, atol, max_iterations, progress)
        asked = rest_shape.Request(
            method, density_of, directions_of, solver, check_overlap, settings, fixed_point_options
        )
        return rest_shape.find(self, asked, start)

    def on(self, mesh: Mesh) -> Body:
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

    def _weighed_in(self, state: str) -> Body:
        """A copy, its density that at rest or its nodes with the masses of the loaded shape."""
        body = self.on(self.mesh)
        if state == "loaded" and body._description.masses is None:
            body._description.masses = terms.nodal_masses(self._description)
        return body

    def _reversed(self) -> Body:
        body = self.on(self.mesh)
        d = body._description
        d.gravity, d.forces = -d.gravity, -d.forces
        d.tractions = [replace(t, value=-t.value) for t in d.tractions]
        d.pressures = [replace(p, value=-p.value) for p in d.pressures]
        body._prescribed = -body._prescribed
        return body

    def _restructured(self) -> Body:
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
