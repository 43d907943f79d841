"""A body in numbers: its system in the runtime, its unknowns, energy and forces at them."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from . import terms
from .alone import alone
from .errors import InputError

if TYPE_CHECKING:
    from scipy.sparse import csr_array

    from .body import Body
    from .state import Equilibrium

Floats = npt.NDArray[np.float64]


@alone
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

    flat, built = unknowns(body, u, pressure), system(body)
    runtime, n = built.system, body.mesh.points.size
    flat[n:] /= built.scalar_unit
    energy = runtime.energy(flat, 1.0) if runtime.has_energy() else float("nan")
    residual = runtime.residual(flat, 1.0)
    tangent = csr_array(runtime.tangent(flat), shape=(flat.size, flat.size))
    if flat.size == n:
        return energy, residual.reshape(-1, 3), tangent
    unit = np.append(np.ones(n), np.full(flat.size - n, 1 / built.scalar_unit))
    return energy, unit * residual, csr_array(diags_array(unit) @ tangent @ diags_array(unit))


def system(body: Body, inverse: bool = False, density_of: str = "rest") -> terms.Built:
    """The body's system with its present values; made once for as long as its structure lasts."""
    key = (inverse, density_of if inverse else "rest")
    if key not in body._built:
        body._built[key] = terms.build(body._description, *key)
    terms.refresh(body._built[key], body._description)
    return body._built[key]


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


def unknowns_of(body: Body, start: Equilibrium) -> Floats:
    """The unknowns of an equilibrium to start from, which may be one of another formulation.

    Raises:
        InputError: it is no equilibrium, or not of this mesh.
    """
    if not hasattr(start, "u"):
        raise InputError(
            f"start must be a state, as solve gives it, or None, got {type(start).__name__}."
        )
    if start.u.shape != body.mesh.points.shape:
        raise InputError(
            f"start must be a state of this mesh with {len(body.mesh.points)} nodes, "
            f"got one with {len(start.u)}."
        )
    mixed = body._description.formulation == "mixed"
    return unknowns(body, start.u, start.pressure if mixed else None)
