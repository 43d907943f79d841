"""A body in equilibrium: displacement, strains and stresses, reactions, how it was found."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from . import terms
from .errors import InputError
from .prestress import Prestress, prestress, write_loaded
from .projection import to_nodes

if TYPE_CHECKING:
    from .body import Body
    from .mesh import Mesh

Floats = npt.NDArray[np.float64]

#: Keys of `Equilibrium.timings`: seconds, then counts.
PHASES = ("assembly", "factor", "solve", "total", "factorisations", "krylov_iterations")


@dataclass(frozen=True)
class PointValues:
    """Fields at the quadrature points of all cells, q a cell; measures are rest volumes."""

    F: Floats  # (c, q, 3, 3)
    P: Floats  # (c, q, 3, 3) Pa
    psi: Floats  # (c, q) Pa
    volume: Floats  # (c, q) m³ at rest
    places: Floats  # (q, 3) in the reference cell


@dataclass(frozen=True, eq=False)
class Equilibrium:
    """What a forward solve and a rest shape have in common.

    Attributes:
        u: (n, 3) displacement of the nodes of the mesh that was solved on, m.
        iterations: Newton iterations over all load steps.
        history: one dict an iteration.
        timings: seconds of "assembly", "factor", "solve", "total"; how many "factorisations" and
            "krylov_iterations" there were; which "solver" was picked and why, a sentence.
        energy: potential energy, J; NaN where the loads have none.
        warnings: what to know before the result is used; empty when all is well.
        reactions: (n, 3) N, the supports' forces on the body at prescribed dofs, else 0.
        pressure: (n,) Pa, the multiplier of a mixed formulation, σ_vol = p g'(J), so positive in
            tension; linear between the corners. None in the others.
    """

    u: Floats
    iterations: int
    history: list[dict[str, float]]
    timings: dict[str, float | str]
    energy: float
    reactions: Floats
    warnings: tuple[str, ...]
    _solved: terms.Description = field(repr=False)  # as it was, with its mesh
    _form: str = field(repr=False)
    pressure: Floats | None = None

    @property
    def points(self) -> Floats:
        """(n, 3) m, where the nodes went."""
        return np.asarray(self._solved.mesh.points + self.u)

    def deformation_gradient(self, at: str = "cells") -> Floats:
        """F from rest to loaded.

        Args:
            at: "cells" for averages (c, 3, 3) by rest volume; "quadrature" for the points
                themselves (c, q, 3, 3); "nodes" for their least-squares fit (n, 3, 3) by the
                element's continuous functions over the rest shape, which smears jumps between
                regions.

        Raises:
            InputError: another ``at``.
        """
        return self._at(self._values.F, at)

    def right_cauchy_green(self, at: str = "cells") -> Floats:
        """C = FᵀF, same shapes as `deformation_gradient`."""
        F = self._values.F
        return self._at(np.swapaxes(F, -1, -2) @ F, at)

    def green_lagrange(self, at: str = "cells") -> Floats:
        """E = (FᵀF - I)/2, same shapes as `deformation_gradient`."""
        F = self._values.F
        return self._at(0.5 * (np.swapaxes(F, -1, -2) @ F - np.eye(3)), at)

    def first_piola(self, at: str = "cells") -> Floats:
        """P = ∂ψ/∂F, Pa, same shapes as `deformation_gradient`."""
        return self._at(self._values.P, at)

    def second_piola(self, at: str = "cells") -> Floats:
        """S = F⁻¹P, Pa, same shapes as `deformation_gradient`."""
        return self._at(np.asarray(np.linalg.solve(self._values.F, self._values.P)), at)

    def cauchy(self, at: str = "cells") -> Floats:
        """σ = P Fᵀ / J, Pa, same shapes as `deformation_gradient`."""
        F, P = self._values.F, self._values.P
        J = np.linalg.det(F)[..., None, None]
        return self._at(P @ np.swapaxes(F, -1, -2) / J, at)

    def energy_density(self, at: str = "cells") -> Floats:
        """ψ, Pa, per rest volume: (c,), (c, q) or (n,), as `deformation_gradient`."""
        return self._at(self._values.psi, at)

    def volume_ratio(self, at: str = "smallest") -> Floats:
        """J = det F: "smallest" (c,) of each cell's points, or as `energy_density`."""
        J = np.asarray(np.linalg.det(self._values.F))
        return np.asarray(J.min(axis=1)) if at == "smallest" else self._at(J, at)

    def directions(self, of: str = "rest") -> dict[str, Floats]:
        """Directions of the laws, such as fibres: name → unit vectors (c, 3).

        Args:
            of: "rest", or "loaded" for those of the loaded shape, along F̄ f0 with F̄ the cell's
                average deformation gradient. NaN in cells whose law has none of that name.

        Raises:
            InputError: another ``of``.
        """
        from . import directions

        if of not in ("rest", "loaded"):
            raise InputError(f'of must be "rest" or "loaded", got {of!r}.')
        return directions.of(self, loaded=of == "loaded")

    def von_mises(self) -> Floats:
        """sqrt(3/2 s:s) of the averaged Cauchy stress (c,), Pa."""
        sigma = self.cauchy()
        mean = np.trace(sigma, axis1=1, axis2=2)[:, None, None] / 3
        deviator = sigma - mean * np.eye(3)
        return np.asarray(np.sqrt(1.5 * (deviator**2).sum(axis=(1, 2))))

    def prestress(self, at: str = "cells") -> Prestress:
        """F, J and σ of the loaded shape together, ``at`` as in `deformation_gradient`."""
        return prestress(self, at)

    def write(self, path: str | Path, cell_data: Mapping[str, npt.ArrayLike] | None = None) -> Path:
        """Write the moved shape as VTU with displacement, J and von Mises stress.

        Positions minus the displacement are those before the solve. Frame LPS, metres, both named
        in the file. A rest shape's J and stress are those of its loaded state.
        """
        fields = {"J [1]": self.volume_ratio(), "von Mises stress [Pa]": self.von_mises()}
        return self._solved.mesh.placed(self.points).write(
            path, {"displacement [m]": self.u}, {**fields, **(cell_data or {})}
        )

    @cached_property
    def _values(self) -> PointValues:
        mesh = self._solved.mesh
        system = terms.new_system(self._solved)
        nodes = terms.pressure_nodes(self._solved)
        unknowns = (
            self.u.ravel() if self.pressure is None else np.append(self.u, self.pressure[nodes])
        )
        parts, rows = [], []
        for region in self._solved.regions:
            if len(region.ids) == 0:
                continue
            term = terms.region_term(system, self._solved, region, self._form)
            terms.set_values(term, region.values)
            q = len(term.weights)
            table = term.tabulate("points", unknowns).reshape(len(region.ids), q, 20)
            table[..., 19] *= term.weights
            parts.append(table)
            rows.append(region.ids)
        table = np.empty((len(mesh.cells), *parts[0].shape[1:]))
        table[np.concatenate(rows)] = np.concatenate(parts)
        shape = (*table.shape[:2], 3, 3)
        F, P = table[..., :9].reshape(shape), table[..., 9:18].reshape(shape)
        return PointValues(F, P, table[..., 18], table[..., 19], term.quadrature)

    def _at(self, values: Floats, at: str) -> Floats:
        if at == "quadrature":
            return values
        volume = self._values.volume
        if at == "nodes":
            rest = self._solved.mesh.points if self._form == "direct" else self.points
            return to_nodes(self._solved.mesh, rest, self._values.places, values)
        if at != "cells":
            raise InputError(f'at must be "cells", "quadrature" or "nodes", got {at!r}.')
        weight = volume / volume.sum(axis=1, keepdims=True)
        return np.asarray(np.einsum("cq,cq...->c...", weight, values))


@dataclass(frozen=True, eq=False)
class State(Equilibrium):
    """A body in equilibrium under its loads; `Equilibrium` lists its attributes."""

    @property
    def mesh(self) -> Mesh:
        """The mesh that ``u`` starts from, the rest shape."""
        return self._solved.mesh


@dataclass(frozen=True, eq=False)
class Rest(Equilibrium):
    """The shape without loads, from a loaded one (Mazier 2022, chapter 3); ``u`` is X - x.

    Attributes:
        method: "inverse" is exact; "reversed-gravity" is an approximation to compare with; those
            of "sellier" are as exact as they were asked to be.
        density_of: the state, "rest" or "loaded", that the density counts in.
        solves: forward solves that a method of "sellier" took, else 0; ``iterations``,
            ``history`` and ``timings`` are over all of them.
        misses: after each of its steps the largest distance of a node from where it should be, as
            a share of the size.
    """

    method: str = "inverse"
    density_of: str = "rest"
    solves: int = 0
    misses: tuple[float, ...] = ()
    _body: Body = field(repr=False, kw_only=True)  # on the loaded shape, with what is its at rest

    @property
    def loaded(self) -> Mesh:
        """The mesh that was given, the loaded shape."""
        return self._solved.mesh

    @cached_property
    def mesh(self) -> Mesh:
        """The rest shape; `body` is the same body on it."""
        return self._solved.mesh.moved(self.points)

    def body(self) -> Body:
        """The body at rest: on `mesh`, with the laws, supports and loads of the one given.

        Its directions are those at rest, whichever were given. Where the density counted in the
        loaded shape, gravity pulls at its nodes with the masses that they had there. Solved, it
        takes the loaded shape again.
        """
        return self._body.on(self.mesh)

    def write_loaded(self, path: str | Path) -> Path:
        """Write the loaded shape as VTU with what it carries: where a later simulation starts.

        For each cell F (from rest to loaded) and the Cauchy stress as tensors, nine columns row by
        row as ParaView reads them, J and von Mises stress: averages by rest volume as of
        `prestress`. For each node the displacement to the rest shape, and a mixed form's pressure.
        """
        return write_loaded(self, path)


def outcome(
    result: Any, built: terms.Built, d: terms.Description, fixed: npt.NDArray[np.bool_]
) -> dict[str, Any]:
    """The fields of an `Equilibrium` that a converged result gives."""
    from .newton import as_dict

    t = built.system.timings
    has_energy = built.system.has_energy()
    return {
        "u": result.u[: fixed.size].reshape(-1, 3),
        "pressure": _pressure(result.u[fixed.size :] * built.scalar_unit, d),
        "iterations": sum(1 for i in result.history if i.iteration > 0),
        "history": [as_dict(i) for i in result.history],
        "timings": {n: getattr(t, n) for n in PHASES} | {"solver": str(built.solver)},
        "energy": built.system.energy(result.u, 1.0) if has_energy else float("nan"),
        "reactions": np.where(fixed, result.residual[: fixed.size].reshape(-1, 3), 0.0),
        "warnings": _warnings(built.system.volume_ratio(result.u), result.fold),
    }


def _pressure(corners: Floats, d: terms.Description) -> Floats | None:
    """The pressures of the corners, and of every other node what a linear field has there."""
    if not len(corners):
        return None
    mesh, p = d.mesh, np.zeros(len(d.mesh.points))
    p[terms.pressure_nodes(d)] = corners
    p[mesh.cells] = p[mesh.cells[:, : mesh.table.corners]] @ mesh.table.corner_values().T
    return p


def _warnings(smallest: Any, fold: float) -> tuple[str, ...]:
    """Inverted cells, which laws with a finite energy at J = 0 let through, and folds passed."""
    found = []
    if smallest.value <= 0:
        found.append(
            f"cells are inverted: the smallest J is {smallest.value:.3g}; use a law with ln J."
        )
    if fold:
        found.append(
            f"the path passes a limit point at {100 * fold:.4g} % of the load, turns back and "
            "comes to the whole load later: a body that is loaded slowly snaps there."
        )
    return tuple(found)
