"""A body: a mesh with laws, supports and loads; solved forward, or back to its rest shape."""

from __future__ import annotations

import copy
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from . import failures, newton, parameters, supports, terms
from .core import core
from .errors import InputError, MaterialError, MeshError
from .laws import read_law
from .mesh_tags import CellWhere, Where
from .newton import Progress, Settings
from .state import Equilibrium, Rest, State, outcome

if TYPE_CHECKING:
    from scipy.sparse import csr_array

    from .kernels.law import Law
    from .mesh import Mesh
    from .surface import Surface

Floats = npt.NDArray[np.float64]

METHODS = ("inverse", "reversed-gravity")


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
        _require_offered(formulation, mesh.element)
        _require_split(law, formulation)
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
            _degree(mesh, quadrature),
            formulation,
        )
        self._fixed = np.zeros((n, 3), dtype=bool)
        self._prescribed = np.zeros((n, 3))
        self._built: dict[tuple[bool, str], terms.Built] = {}

    @property
    def mesh(self) -> Mesh:
        """The mesh, m."""
        return self._description.mesh

    # Laws and parameters

    def region(self, cells: CellWhere, material: str | Path, **values: Any) -> Body:
        """Another law on some cells: a mask, ids or a tag. Values as in the constructor."""
        d, law = self._description, read_law(material)
        _require_split(law, d.formulation)
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
        forces[nodes] += _rows("force", force, len(nodes)) if rows else _vector("force", force)
        self._description.forces = forces
        return self

    def traction(self, where: Where, traction: npt.ArrayLike, per: str = "rest") -> Body:
        """Add a dead traction (3,) Pa on the facets of ``where``, per "rest" or "loaded" area."""
        if per not in ("rest", "loaded"):
            raise InputError(f'per must be "rest" or "loaded", got {per!r}.')
        load = terms.FacetLoad(self.mesh.boundary(where), _vector("traction", traction), per)
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
        self._description.gravity = _vector("gravity", g)
        return self

    def clear_loads(self) -> Body:
        """Remove gravity, forces, tractions and pressures."""
        d = self._description
        d.gravity, d.forces = np.zeros(3), np.zeros_like(d.forces)
        d.tractions.clear()
        d.pressures.clear()
        return self._restructured()

    # Solving

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
            load_steps: equal steps; adaptive with cut-back if None.
            rtol: of max(‖external force‖, ‖reactions‖); the last step is ≤ 1e-8 of the size too.
            atol: N; rounding of the stiffness if None.
            max_iterations: of each load step.
            solver: "auto" or "direct" (sparse factorisation).
            progress: called with a dict after each iteration; may raise to stop.

        Raises:
            InputError: nothing resists a rigid motion, or a wrong argument.
            ConvergenceError: cause, history, worst cells, load factor; the body is as before.
        """
        if solver not in ("auto", "direct"):
            raise InputError(f'solver must be "auto" or "direct", got {solver!r}.')
        settings = Settings(load_steps, rtol, atol, max_iterations, progress)
        result, built = self._run(settings, None if start is None else self._start(start))
        failures.require_converged(result, built, self._description)
        solved = terms.snapshot(self._description)
        return State(
            **outcome(result, built, self._description, self._fixed), _solved=solved, _form="direct"
        )

    def rest_shape(
        self,
        method: str = "inverse",
        density_of: str = "rest",
        start: Rest | None = None,
        load_steps: int | None = None,
        rtol: float = 1e-10,
        atol: float | None = None,
        max_iterations: int = 25,
        progress: Progress | None = None,
    ) -> Rest:
        """The shape without the loads, taking the mesh for the loaded shape.

        Args:
            method: "inverse" (exact, one solve) or "reversed-gravity" (approximate: the loads act
                the other way on the loaded shape; Mazier 2022, chapter 5).
            density_of: the state, "rest" or "loaded", that `density` counts in.
            start: a rest shape of this mesh to start from, as after a small change of the body;
                from the mesh itself if None.
            load_steps, rtol, atol, max_iterations, progress: as in `solve`.

        Raises:
            InputError: as in `solve`.
            ConvergenceError: there is no such rest shape, or none was found, with the cause.
        """
        if method not in METHODS:
            raise InputError(f"method must be one of {METHODS}, got {method!r}.")
        if density_of not in ("rest", "loaded"):
            raise InputError(f'density_of must be "rest" or "loaded", got {density_of!r}.')
        settings = Settings(load_steps, rtol, atol, max_iterations, progress)
        if start is not None and not isinstance(start, Rest):
            raise InputError(f"start must be a rest shape, got {type(start).__name__}.")
        begin = None if start is None else self._start(start)
        if method == "inverse":
            result, built = self._run(settings, begin, inverse=True, density_of=density_of)
        else:
            result, built = self._reversed()._run(settings, begin)
        failures.require_converged(result, built, self._description, inverse=True)
        solved = terms.snapshot(self._description)
        fields = outcome(result, built, self._description, self._fixed)
        rest = Rest(**fields, _solved=solved, _form="inverse", method=method)
        failures.require_usable(rest)
        return rest

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
        body._built = {}
        return body

    # Inside

    def _reversed(self) -> Body:
        body = self.on(self.mesh)
        d = body._description
        d.gravity, d.forces = -d.gravity, -d.forces
        d.tractions = [replace(t, value=-t.value) for t in d.tractions]
        d.pressures = [replace(p, value=-p.value) for p in d.pressures]
        body._prescribed = -body._prescribed
        return body

    def _run(
        self,
        settings: Settings,
        start: Floats | None = None,
        inverse: bool = False,
        density_of: str = "rest",
    ) -> tuple[Any, terms.Built]:
        native = settings.checked(self._rounding(), self.mesh)
        native.warm = start is not None
        native.kinks = bool(self._description.skins or self._description.slides)
        supports.require_held(self.mesh, self._fixed, self._normals())
        built = self._system(inverse, density_of)
        laws = {r.law.name: r.law for r in self._description.regions if len(r.ids)}
        barriers = [law for law in laws.values() if "barrier" in law.exceptions]
        native.refuse_inversion = inverse or len(barriers) < len(laws)
        scalars = np.zeros(built.system.scalars)
        built.system.set_free(np.append(~self._fixed.ravel(), scalars == 0))
        built.system.reset_timings()
        target = np.append(-self._prescribed if inverse else self._prescribed, scalars)
        if start is None:
            start = np.zeros_like(target)
        else:
            start[self._prescribed.size :] /= built.scalar_unit
        judge = partial(self._judge, built.scalar_unit) if inverse else None
        return newton.solve(built.system, start, target, native, settings, judge), built

    def _judge(self, scalar_unit: float, found: Floats, load_factor: float) -> Any:
        """Whether this body, loaded, would rest on the rest shape of the unknowns ``found``.

        One that any push leaves cannot have been seen in the given shape. Loads without an energy,
        which follow the facets, hide it.
        """
        outcome, n = core().Outcome, self._prescribed.size
        try:
            mesh = self.mesh.moved(self.mesh.points + found[:n].reshape(-1, 3))
        except MeshError:
            return outcome.inverted
        d = self._description
        if d.pressures or any(traction.per == "loaded" for traction in d.tractions):
            return outcome.converged
        built = self.on(mesh)._system()
        pressure = found[n:] * (scalar_unit / built.scalar_unit)
        built.system.set_free(np.append(~self._fixed.ravel(), np.ones(len(pressure), bool)))
        directions = built.system.unstable_directions(np.append(-found[:n], pressure))
        return outcome.unstable if directions else outcome.converged

    def _system(self, inverse: bool = False, density_of: str = "rest") -> terms.Built:
        key = (inverse, density_of if inverse else "rest")
        if key not in self._built:
            self._built[key] = terms.build(self._description, *key)
        terms.refresh(self._built[key], self._description)
        return self._built[key]

    def _restructured(self) -> Body:
        self._built.clear()
        return self

    def _rounding(self) -> float:
        """Size of the rounding errors in the internal forces, N: moduli × area, springs × place."""
        total = 1e-14 * terms.modulus(self._description) * self.mesh.size**2
        for slide in self._description.slides:
            place = max(np.abs(self.mesh.points).max(), np.abs(slide.surface.points).max())
            total += 2e-15 * float(np.linalg.norm(slide.stiffness)) * float(place)
        return total

    def _normals(self) -> dict[int, Floats]:
        normals: dict[int, Floats] = {}
        for slide in self._description.slides:
            landed = slide.surface.closest(self.mesh.points[slide.nodes])
            normals |= dict(zip(slide.nodes.tolist(), landed.normal, strict=True))
        return normals

    def _start(self, start: Equilibrium) -> Floats:
        if start.u.shape != self._prescribed.shape:
            raise InputError(
                f"start must be a state of this mesh with {len(self.mesh.points)} nodes, "
                f"got one with {len(start.u)}."
            )
        mixed = self._description.formulation == "mixed"  # another formulation's state may start it
        return unknowns(self, start.u, start.pressure if mixed else None)


def unknowns(body: Body, u: npt.ArrayLike, pressure: npt.ArrayLike | None = None) -> Floats:
    """``u`` (n, 3) m, node-major, then in a mixed formulation ``pressure`` (n,) Pa at the corners.

    Raises:
        InputError: another shape, or a pressure where there is none.
    """
    moved, nodes = np.asarray(u, dtype=float), terms.pressure_nodes(body._description)
    if moved.shape != body.mesh.points.shape:
        raise InputError(f"u must have shape {body.mesh.points.shape}, got {moved.shape}.")
    if pressure is None:
        return np.append(moved, np.zeros(len(nodes)))
    p = np.asarray(pressure, dtype=float)
    if not len(nodes):
        raise InputError(
            f"pressure must be None in formulation {body._description.formulation!r}, which has "
            'none of its own; leave it out or make the body with formulation "mixed".'
        )
    if p.shape != (len(moved),):
        raise InputError(
            f"pressure must have shape ({len(moved)},), one a node, got {p.shape}; "
            "nodes that are no corners may hold any number."
        )
    return np.append(moved, p[nodes])


def assemble(
    body: Body, u: npt.ArrayLike, pressure: npt.ArrayLike | None = None
) -> tuple[float, Floats, csr_array]:
    """Energy, residual and tangent of a body at ``u`` (n, 3) m, all dofs, before elimination.

    Args:
        pressure: (n,) Pa, of a mixed formulation, which reads it at the corners; else None.

    Returns:
        energy (J; NaN where a load has none), residual (n, 3) N, internal minus external, and
        tangent (3n, 3n) N/m as csr; dofs are node-major: x, y, z of node 0 first. In a mixed
        formulation the residual is flat, (3n + c,), its last c entries (m³) and the tangent's last
        c rows and columns those of the corners' pressures in the order of their nodes.

    Raises:
        InputError: ``u`` or ``pressure`` has another shape.
    """
    from scipy.sparse import csr_array, diags_array

    flat, built = unknowns(body, u, pressure), body._system()
    system, n = built.system, body.mesh.points.size
    flat[n:] /= built.scalar_unit
    energy = system.energy(flat, 1.0) if system.has_energy() else float("nan")
    residual = system.residual(flat, 1.0)
    tangent = csr_array(system.tangent(flat), shape=(flat.size, flat.size))
    if flat.size == n:
        return energy, residual.reshape(-1, 3), tangent
    unit = np.append(np.ones(n), np.full(flat.size - n, 1 / built.scalar_unit))
    return energy, unit * residual, csr_array(diags_array(unit) @ tangent @ diags_array(unit))


def _require_offered(formulation: str, element: str) -> None:
    from .kernels.unit import OFFERED

    if formulation not in OFFERED:
        raise InputError(f"formulation must be one of {tuple(OFFERED)}, got {formulation!r}.")
    if element not in OFFERED[formulation]:
        raise InputError(
            f"formulation {formulation!r} wants a mesh of {' or '.join(OFFERED[formulation])}, "
            f"got {element}; use another mesh (elevated() gives P2, Q2L) or another formulation."
        )


def _require_split(law: Law, formulation: str) -> None:
    if formulation != "displacement" and not law.is_split:
        raise MaterialError(
            f"formulation {formulation!r} needs a law with psi_dev and psi_vol, and {law.name} "
            'gives psi as a whole; use formulation "displacement" or another law.'
        )


def _degree(mesh: Mesh, quadrature: int | tuple[int, str] | None) -> int | None:
    """The rule that was asked for, checked before anything is compiled."""
    from .kernels.degree import checked

    if quadrature is None:
        return None
    try:
        return checked(quadrature, mesh.table.cell.name)
    except ValueError as problem:
        raise InputError(str(problem)) from None


def _vector(name: str, value: npt.ArrayLike) -> Floats:
    vector = np.asarray(value, dtype=float)
    if vector.shape != (3,) or not np.isfinite(vector).all():
        raise InputError(f"{name} must be three numbers, got {value!r}.")
    return vector


def _rows(name: str, value: npt.ArrayLike, count: int) -> Floats:
    rows = np.asarray(value, dtype=float)
    if rows.shape != (count, 3) or not np.isfinite(rows).all():
        raise InputError(f"{name} must be finite with shape ({count}, 3), got {rows.shape}.")
    return rows
