"""Basix elements of DESIGN §5 and the pinned quadrature of §4, as UFL meshes to write forms on."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from typing import Any

import basix
import basix.ufl
import numpy as np
import ufl

from . import cells
from .degree import scheme_of

#: Every element by name: cells and facets.
TABLES = cells.ELEMENTS | cells.FACETS
#: Degree of the stiffness' quadrature (points: 1, 4, 8, 27, 27, 6, 18 and 1, 3, 4, 9, 9).
STIFFNESS_DEGREE = {
    "P1": 1, "P2": 2, "Q1": 2, "Q2": 4, "Q2L": 4, "Pr1": 2, "Pr2": 4,
    "T1": 1, "T2": 2, "S1": 2, "S2": 4, "S2L": 4,
}  # fmt: skip
#: Degree of a mixed form's quadrature (points: 14 and 27), by its displacement's element.
MIXED_DEGREE = {"P2": 4, "Q2L": 4}
#: Degree of the loads' quadrature: twice the element's degree.
LOAD_DEGREE = {name: 2 * table.degree for name, table in TABLES.items()}


@dataclass(frozen=True)
class Space:
    """An element with its isoparametric mesh and the arguments of its forms."""

    name: str
    mesh: Any
    displacement: Any
    test: Any
    trial: Any

    def field(self, size: int) -> Any:
        """A new per-cell coefficient: a scalar, or a vector of ``size`` entries."""
        shape = () if size == 1 else (size,)
        cell = self.mesh.ufl_cell().cellname
        element = basix.ufl.element("DG", cell, 0, shape=shape)
        return ufl.Coefficient(ufl.FunctionSpace(self.mesh, element))


@dataclass(frozen=True)
class MixedSpace(Space):
    """The same with a continuous pressure of one degree less; ``trial`` is that of all unknowns."""

    unknown: Any  # displacement, then the pressures of the corners
    pressure: Any
    pressure_test: Any
    pressures: int  # of a cell


@cache
def scalar_element(name: str) -> Any:
    """The scalar Basix element of a name in TABLES; nodal in every case."""
    table = TABLES[name]
    if name in ("Q2", "S2"):
        return _nodal_serendipity(table.cell.name)
    return basix.ufl.element("P", table.cell.name, table.degree)


def space(name: str) -> Space:
    """Vector displacement on the isoparametric element ``name``, embedded in 3-D."""
    element = basix.ufl.blocked_element(scalar_element(name), shape=(3,))
    mesh = ufl.Mesh(element)
    V = ufl.FunctionSpace(mesh, element)
    return Space(name, mesh, ufl.Coefficient(V), ufl.TestFunction(V), ufl.TrialFunction(V))


def mixed_space(name: str) -> MixedSpace:
    """Taylor and Hood's pair on the element ``name``."""
    element = basix.ufl.blocked_element(scalar_element(name), shape=(3,))
    mesh = ufl.Mesh(element)
    pressure = basix.ufl.element("P", TABLES[name].cell.name, 1)
    V = ufl.FunctionSpace(mesh, basix.ufl.mixed_element([element, pressure]))
    unknown, test = ufl.Coefficient(V), ufl.TestFunction(V)
    (u, p), (v, q) = ufl.split(unknown), ufl.split(test)
    return MixedSpace(name, mesh, u, v, ufl.TrialFunction(V), unknown, p, q, pressure.dim)


@cache
def gradients(name: str, degree: int) -> tuple[np.ndarray, np.ndarray]:
    """Gradients of the shape functions at the points (q, nodes, tdim), and weights (q,)."""
    points, weights = quadrature(name, degree)
    values = np.moveaxis(scalar_element(name).tabulate(1, points)[1:], 0, -1)
    near = np.rint(values)
    return np.where(abs(values - near) < 1e-14, near, values), weights


@cache
def quadrature(name: str, degree: int) -> tuple[np.ndarray, np.ndarray]:
    """Points (q, tdim) and weights (q,) on the reference cell; ``degree`` may name its scheme.

    A prism takes the product of a triangle's rule and Gauss': Basix' own prism rules are collapsed.
    Where Basix' default has negative weights (tetrahedra, degrees 3, 7 and 8), that of Xiao and
    Gimbutas (2010, Comput. Math. Appl. 59) of the same degree stands in.
    """
    cell, scheme = TABLES[name].cell.name, scheme_of(degree)
    if cell != "prism":
        return _rule(cell, degree, scheme)
    flat, flat_weights = _rule("triangle", degree, scheme)
    high, high_weights = _rule("interval", degree, "default")
    points = [[*xy, z] for z in high[:, 0] for xy in flat]
    return np.array(points), np.outer(high_weights, flat_weights).ravel()


def _rule(cell: str, degree: int, scheme: str) -> tuple[np.ndarray, np.ndarray]:
    kind, rule = basix.CellType[cell], basix.QuadratureType[scheme]
    points, weights = basix.make_quadrature(kind, int(degree), rule)
    if scheme == "default" and np.min(weights) < 0:
        return _rule(cell, degree, "xiao_gimbutas")
    return np.asarray(points), np.asarray(weights)


def _nodal_serendipity(cell: str) -> Any:
    """The quadratic serendipity space with point values at vertices and edge midpoints.

    Basix' own serendipity element has edge moments for degrees of freedom: only its span is used.
    """
    kind = basix.CellType[cell]
    own = basix.create_element(
        basix.ElementFamily.serendipity, kind, 2,
        lagrange_variant=basix.LagrangeVariant.legendre, dpc_variant=basix.DPCVariant.legendre,
    )  # fmt: skip
    geometry, topology = basix.geometry(kind), basix.topology(kind)
    tdim = geometry.shape[1]
    x: list[list[np.ndarray]] = [[] for _ in range(4)]
    M: list[list[np.ndarray]] = [[] for _ in range(4)]
    for d in range(tdim + 1):
        for vertices in topology[d]:
            points = (
                geometry[vertices].mean(axis=0, keepdims=True) if d < 2 else np.zeros((0, tdim))
            )
            x[d].append(points)
            M[d].append(np.ones((1, 1, 1, 1)) if d < 2 else np.zeros((0, 1, 0, 1)))
    return basix.ufl.custom_element(
        kind, (), np.asarray(own.wcoeffs), x, M, 0, basix.MapType.identity,
        basix.SobolevSpace.H1, False, 1, 2, basix.PolysetType.standard,
    )  # fmt: skip
