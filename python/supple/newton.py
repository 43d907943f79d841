"""Runs the runtime's Newton solver for a body; failures.py says in words why it stopped."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from . import assembly, profile, solvers, supports, terms
from .core import core
from .errors import InputError

if TYPE_CHECKING:
    from .body import Body
    from .mesh import Mesh

Floats = npt.NDArray[np.float64]
Progress = Callable[[dict[str, float]], None]
#: What is wrong with unknowns under a load factor, as an Outcome of the runtime.
Judge = Callable[[Floats, float], Any]

_FIELDS = ("load_factor", "iteration", "residual", "tolerance", "step", "length", "shift")


@dataclass(frozen=True)
class Settings:
    """How a body is solved; see `Body.solve`."""

    load_steps: int | None = None
    rtol: float = 1e-10
    atol: float | None = None
    max_iterations: int = 25
    progress: Progress | None = None
    step_tol: float = 1e-8  # of the size
    solver: str = "auto"  # of symmetric tangents

    def checked(self, rounding: float, mesh: Mesh) -> Any:
        """The runtime's settings; ``rounding`` is that of the internal forces, N.

        Raises:
            InputError: a tolerance or a count that makes no sense.
        """
        if not 0 < self.rtol < 1:
            raise InputError(f"rtol must lie between 0 and 1, got {self.rtol}.")
        if self.atol is not None and not 0 <= self.atol < np.inf:
            raise InputError(f"atol must be at least 0 N and finite, or None, got {self.atol}.")
        if self.max_iterations < 1:
            raise InputError(f"max_iterations must be at least 1, got {self.max_iterations}.")
        if self.load_steps is not None and self.load_steps < 1:
            raise InputError(f"load_steps must be at least 1 or None, got {self.load_steps}.")
        solvers.require_known(self.solver)
        native = core().NewtonSettings()
        native.rtol, native.max_iterations = self.rtol, self.max_iterations
        native.load_steps = self.load_steps or 0
        native.size, native.step_tol = mesh.size, self.step_tol
        native.atol = rounding if self.atol is None else self.atol
        return native


def run(
    body: Body,
    settings: Settings,
    start: Floats | None = None,
    inverse: bool = False,
    density_of: str = "rest",
    gmres: bool = False,
    judge: Judge | None = None,
) -> tuple[Any, terms.Built]:
    """What the runtime finds for a body under its loads, and the system that it was found with.

    Args:
        start: unknowns (`assembly.unknowns`), m and Pa; from zero if None.
        inverse: take the mesh for the loaded shape.
        density_of: of the inverse, as in `Body.rest_shape`.
        gmres: solve the inverse's tangents so where that arrives.
        judge: asked of the equilibria that the inverse may end at, on its path too.

    Raises:
        InputError: nothing resists a rigid motion, or a setting makes no sense.
    """
    native = settings.checked(_rounding(body), body.mesh)
    d, fixed = body._description, body._fixed
    if start is None and _is_stressed(body):
        start = _unloaded(body, settings, inverse)
    native.warm = start is not None
    native.kinks = d.has_kinks
    supports.require_held(body.mesh, fixed, _normals(body))
    built = assembly.system(body, inverse, density_of)
    laws = {r.law.name: r.law for r in d.regions if len(r.ids)}
    barriers = [law for law in laws.values() if "barrier" in law.exceptions]
    native.refuse_inversion = inverse or len(barriers) < len(laws)
    scalars = np.zeros(built.system.scalars)
    built.system.set_free(np.append(~fixed.ravel(), scalars == 0))
    unknowns = int((~fixed).sum())
    built.solver = solvers.pick(settings.solver, built.system, unknowns, gmres)
    solvers.use(built.solver, built.system, body.mesh)
    built.system.reset_timings()
    target = np.append(-body._prescribed if inverse else body._prescribed, scalars)
    if start is None:
        start = np.zeros_like(target)
    else:
        start[fixed.size :] /= built.scalar_unit
    result = solve(built.system, start, target, native, settings, judge)
    other = solvers.behind(built.solver, settings.solver, unknowns)
    if other and result.outcome.name != "converged":
        built.solver = other
        solvers.use(other, built.system, body.mesh)
        result = solve(built.system, start, target, native, settings, judge)
    profile.native(built.system.timings, len(result.history))
    return result, built


def solve(
    system: Any,
    start: Floats,
    prescribed: Floats,
    native: Any,
    settings: Settings,
    judge: Judge | None = None,
) -> Any:
    """Run from ``start`` (dofs); the result's unknowns are ``result.u``, displacements first."""
    if not np.isfinite(system.residual(start, 1.0)).all():
        raise InputError(
            "the forces are not finite at the start: a parameter is outside of what its law can "
            "carry (a skin of this law wants poisson below 0.5), or the start is inverted."
        )
    report = settings.progress
    hook = None if report is None else lambda i: report(as_dict(i))
    return system.solve(start, np.nan_to_num(prescribed), native, hook, judge)


def as_dict(iteration: Any) -> dict[str, float]:
    """One iteration of the history."""
    return {name: getattr(iteration, name) for name in _FIELDS}


def unstable_directions(body: Body, u: Floats, inverse: Any = None) -> int:
    """In which the body buckles at unknowns ``u``; 0 where a load without energy hides it.

    Args:
        inverse: the system of the inverse form that led to ``u``; what it keeps spares a factor.
    """
    if body._description.pressures:  # which have none: nothing needs to be built
        return 0
    system = assembly.system(body).system
    if not system.has_energy():
        return 0
    system.set_free(np.append(~body._fixed.ravel(), np.ones(system.scalars, bool)))
    return int(system.unstable_directions(u, inverse))


def _is_stressed(body: Body) -> bool:
    """Whether a law is under stress at rest, so that no load is no equilibrium at u = 0."""
    return any("stress_free" in r.law.exceptions for r in body._description.regions)


def _unloaded(body: Body, settings: Settings, inverse: bool) -> Floats | None:
    """Unknowns in equilibrium without loads, where the way to the load begins; None if lost."""
    bare = body.on(body.mesh).clear_loads()
    start = assembly.unknowns(bare, np.zeros_like(body.mesh.points))
    result, built = run(bare, replace(settings, progress=None), start, inverse)
    if result.outcome.name != "converged":
        return None
    found = np.array(result.u)
    found[body._fixed.size :] *= built.scalar_unit
    return found


def _rounding(body: Body) -> float:
    """Size of the rounding errors in the internal forces, N: moduli × area, springs × place.

    Of the moduli, the bulk modulus where the displacement carries the volume: as large beside
    Young's as Poisson's ratio is near to 1/2.
    """
    mesh, d = body.mesh, body._description
    ratios = [r.values["poisson"].max() for r in d.regions if len(r.ids) and "poisson" in r.values]
    stiffening = max([1.0, *(1 / (3 * (1 - 2 * ratio)) for ratio in ratios if ratio < 0.5)])
    total = 1e-14 * stiffening * terms.modulus(d) * mesh.size**2
    for slide in d.slides:
        place = max(np.abs(mesh.points).max(), np.abs(slide.surface.points).max())
        total += 2e-15 * float(np.linalg.norm(slide.stiffness)) * float(place)
    return float(total)


def _normals(body: Body) -> dict[int, Floats]:
    """By node, the direction in which a sliding support holds it."""
    normals: dict[int, Floats] = {}
    for slide in body._description.slides:
        landed = slide.surface.closest(body.mesh.points[slide.nodes])
        normals |= dict(zip(slide.nodes.tolist(), landed.normal, strict=True))
    return normals
