"""Manufactured solution: a body under the exact loads of a chosen field must give that field back.

    field → loads from ψ (kernels/forms/manufactured.py) → solve → errors of u and E → rates

U = 1e-2 z (e^x, e^y, e^z) m on the unit cube (Mazier 2022, eq. 64; the scripts of SofaCaribou, from
which that grew, take 1e-3 and a cylinder): its face z = 0 is held, every other face carries the
traction P N, the inside the body force -Div P. The error of u falls as h^(p+1), that of the
Green–Lagrange strain E as h^p, both in the L2 norm.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from .. import parameters
from ..body import Body
from ..core import core
from ..kernels.cells import ELEMENTS as TABLES
from ..kernels.unit import Unit
from ..laws import compiled, read_law
from ..mesh import Mesh
from ..mesh_topology import by_kind

Floats = npt.NDArray[np.float64]
Ints = npt.NDArray[np.int64]

AMPLITUDE = 1e-2
#: A rate may miss its theory by this much.
BAR = 0.1
ELEMENTS = ("P1", "P2", "Q1", "Q2")
#: Put to the thesis' law only.
FURTHER = ("Q2L", "Pr1", "Pr2")
#: Cells along an edge of the cube, by the element's degree.
MESHES = {1: (8, 12, 16, 20), 2: (4, 6, 8, 10)}


@dataclass(frozen=True)
class Case:
    """A law by name or file, and its parameters in SI; a direction is (3,)."""

    material: str | Path
    values: Mapping[str, Any] = field(default_factory=dict)

    @property
    def name(self) -> str:
        return Path(self.material).stem


_F, _S, _T = (np.array(axis) / 3 for axis in ([2, 1, 2], [-2, 2, 1], [1, 2, 2]))
#: The thesis' law and two with fibres; moderate bulk moduli, since locking is another study's. Both
#: families of the artery are in tension everywhere: its energy is smooth along the whole field.
CASES = (
    Case("saint_venant_kirchhoff", {"young": 3e3, "poisson": 0.3}),
    Case("holzapfel_gasser_ogden", {"bulk": 5e3, "k2": 10.0, "fibre1": _F, "fibre2": _T}),
    Case("costa", {"bulk": 5e3, "fibre": _F, "sheet": _S}),
)


def plan() -> list[tuple[Case, str]]:
    """Law and element of every series of the study."""
    return [(c, e) for c in CASES for e in ELEMENTS] + [(CASES[0], e) for e in FURTHER]


@dataclass(frozen=True)
class Series:
    """Relative errors in the L2 norm of one law and element on refined meshes."""

    case: Case
    element: str
    cells: tuple[int, ...]  # along an edge of the cube
    u: Floats  # (meshes,)
    strain: Floats  # (meshes,) of E

    @property
    def degree(self) -> int:
        return TABLES[self.element].degree

    @property
    def rates(self) -> Floats:
        """Observed rates (2, meshes - 1) of u and of E from each mesh to the next."""
        finer = np.diff(np.log(self.cells))
        return np.asarray(-np.diff(np.log([self.u, self.strain]), axis=1) / finer)

    @property
    def miss(self) -> float:
        """Largest distance of any of the rates from p + 1 for u, p for E."""
        theory = np.array([[self.degree + 1], [self.degree]])
        return float(np.abs(self.rates - theory).max())


def exact(X: Floats) -> tuple[Floats, Floats]:
    """The field U (..., 3), m, and its gradient ∂U/∂X (..., 3, 3) at X (..., 3), m."""
    waves = AMPLITUDE * np.exp(X)
    gradient = X[..., 2, None, None] * waves[..., None] * np.eye(3)
    gradient[..., 2] += waves
    return X[..., 2, None] * waves, gradient


def run(
    case: Case,
    element: str,
    cells: tuple[int, ...] | None = None,
    formulation: str = "displacement",
) -> Series:
    """Solve on every mesh; the stiffness is integrated at degree p + 3, loads at 2 p + 4."""
    counts = MESHES[TABLES[element].degree] if cells is None else cells
    meshes = (Mesh.box((n, n, n), (1, 1, 1), element) for n in counts)
    found = np.array([errors(case, mesh, formulation) for mesh in meshes])
    return Series(case, element, counts, *found.T)


def errors(case: Case, mesh: Mesh, formulation: str = "displacement") -> tuple[float, float]:
    """Relative errors of u and E, L2 norms, on a mesh of the unit cube."""
    p = mesh.table.degree
    body = Body(mesh, case.material, formulation, quadrature=p + 3, **case.values)
    held = np.flatnonzero(mesh.points[:, 2] < 1e-9)
    body.prescribe(held, exact(mesh.points[held])[0])
    body.force(np.arange(len(mesh.points)), exact_loads(case, mesh, 2 * p + 4))
    system = _system(mesh)
    return _errors(_force_term(system, case, mesh, 2 * p + 4), body.solve().u)


def exact_loads(case: Case, mesh: Mesh, degree: int) -> Floats:
    """Nodal forces (n, 3), N, of body force and tractions, integrated at ``degree``."""
    system, outside = _system(mesh), mesh.boundary()
    terms = [_force_term(system, case, mesh, degree)]
    for kind, rows in by_kind(outside, mesh.table):
        facets = outside[np.ix_(rows, kind.from_vtk)]
        terms.append(_term(system, case, "manufactured_traction", kind.name, facets, degree))
    residual = sum(term.residual(np.zeros(mesh.points.size)) for term in terms)
    return np.asarray(-residual).reshape(-1, 3)  # internal minus external force


def _system(mesh: Mesh) -> Any:
    return core().System(np.ascontiguousarray(mesh.points).ravel(), [])


def _force_term(system: Any, case: Case, mesh: Mesh, degree: int) -> Any:
    cells = mesh.cells[:, mesh.table.from_vtk]
    return _term(system, case, "manufactured_force", mesh.element, cells, degree)


def _term(system: Any, case: Case, form: str, element: str, cells: Ints, degree: int) -> Any:
    law, count = read_law(case.material), len(cells)
    library = compiled(Unit(form, element, law.path, degree))
    term = core().KernelTerm(library, system, np.ascontiguousarray(cells, dtype=np.int32))
    term.set_field("amplitude", np.full(count, AMPLITUDE))
    values = parameters.defaults(law, count) | parameters.given(law, case.values, count)
    for name, value in values.items():
        term.set_field(name, value.ravel())
    return term


def _errors(solid: Any, u: Floats) -> tuple[float, float]:
    """From X, u, ∂u/∂X and the volume at the points of a rule far above the stiffness'."""
    table = solid.tabulate("points", u.ravel())
    table = table.reshape(len(table), len(solid.weights), 16)
    weight = table[..., 15] * solid.weights
    U, slope = exact(table[..., :3])
    strain = _green_lagrange(slope)
    misses = (table[..., 3:6] - U, _green_lagrange(table[..., 6:15].reshape(slope.shape)) - strain)
    whole = (_norm(U, weight), _norm(strain, weight))
    return _norm(misses[0], weight) / whole[0], _norm(misses[1], weight) / whole[1]


def _green_lagrange(slope: Floats) -> Floats:
    turned = np.swapaxes(slope, -1, -2)
    return np.asarray(0.5 * (slope + turned + turned @ slope))


def _norm(values: Floats, weight: Floats) -> float:
    squares = (values**2).reshape(*weight.shape, -1).sum(axis=-1)
    return float(np.sqrt((weight * squares).sum()))


def row(series: Series) -> dict[str, Any]:
    """A series for result.json; errors are relative, in the L2 norm."""
    rates = series.rates
    return {
        "law": series.case.name,
        "parameters": {name: np.asarray(v).tolist() for name, v in series.case.values.items()},
        "element": series.element,
        "cells_per_edge": list(series.cells),
        "u": {"error": series.u.tolist(), "rate": rates[0].tolist(), "theory": series.degree + 1},
        "E": {"error": series.strain.tolist(), "rate": rates[1].tolist(), "theory": series.degree},
        "passed": series.miss <= BAR,
    }


def line(series: Series) -> str:
    """A series for people: errors on the finest mesh, all rates."""
    u, strain = (" ".join(f"{rate:.2f}" for rate in rates) for rates in series.rates)
    head = f"{series.case.name} {series.element} 1/{series.cells[-1]}:"
    return f"{head} u {series.u[-1]:.1e} (rates {u}), E {series.strain[-1]:.1e} (rates {strain})"
