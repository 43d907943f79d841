"""A body: a mesh with laws, supports and loads; solved forward, or back to its rest shape."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

from . import assembly, failures, many, newton, terms
from .alone import alone
from .body_setup import Setup
from .newton import Progress, Settings
from .state import Rest, State, outcome


class Body(Setup):
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
