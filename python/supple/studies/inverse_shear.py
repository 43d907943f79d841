"""Simple and generalised shear undone: from the sheared shape and its loads to the unit cube.

    closed form of σ(γ) → tractions and body force on the sheared shape → rest shape → errors, rates

x = X + γ Y e1, and x = X + k Y² e1 whose shear is γ = 2 k Y (Mazier 2022, §3.6). Neither changes a
volume or Y, so with F = I + γ e1⊗e2 and B = F Fᵀ all of the loads is known on the sheared shape:

    σ = μ (B - I)                                        neo-Hookean
    σ = F (λ tr(E) I + 2 μ E) Fᵀ, E = (FᵀF - I)/2         Saint Venant–Kirchhoff
    σ = 2 c1 dev(B) - 2 c2 dev(B⁻¹)                      Mooney–Rivlin, uncoupled
    t = σ n,   b = -div σ = -(∂σ/∂γ) e2 γ'(y)            γ' = 0 in simple shear

Held are the faces X = 0, X = 1 and Y = 0, in generalised shear those of Z too; the others carry t.
Where the field is in the element's space the cube comes back to rounding, where it is not (Y² on
P1, Q1) errors fall at the rates of theory.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from ..body import Body
from ..kernels.elements import quadrature
from ..mesh import Mesh
from ..mesh_jacobian import jacobians
from ..state import Rest

Values = npt.NDArray[Any]

YOUNG, POISSON, C1, C2, BULK = 3e3, 0.3, 400.0, 100.0, 1e4
MU = YOUNG / (2 * (1 + POISSON))
LAMBDA = YOUNG * POISSON / ((1 + POISSON) * (1 - 2 * POISSON))
#: Degree of the rules of body force and stiffness, at which these stresses are exact.
DEGREE = 6
RTOL = 1e-14


def _neo_hookean(F: Values) -> Values:
    return np.asarray(MU * (F @ _turned(F) - np.eye(3)))


def _saint_venant_kirchhoff(F: Values) -> Values:
    E = 0.5 * (_turned(F) @ F - np.eye(3))
    trace = np.trace(E, axis1=-2, axis2=-1)[..., None, None]
    return np.asarray(F @ (LAMBDA * trace * np.eye(3) + 2 * MU * E) @ _turned(F))


def _mooney_rivlin(F: Values) -> Values:
    B = F @ _turned(F)
    return np.asarray(2 * C1 * _deviator(B) - 2 * C2 * _deviator(np.linalg.inv(B)))


def _turned(F: Values) -> Values:
    return np.swapaxes(F, -1, -2)


def _deviator(A: Values) -> Values:
    return np.asarray(A - np.trace(A, axis1=-2, axis2=-1)[..., None, None] / 3 * np.eye(3))


@dataclass(frozen=True)
class Law:
    """A shipped energy's parameters, SI, and σ (..., 3, 3), Pa, of F (..., 3, 3) with det F = 1."""

    values: Mapping[str, Any]
    stress: Callable[[Values], Values]


LAWS = {
    "neo_hookean": Law({"young": YOUNG, "poisson": POISSON}, _neo_hookean),
    "saint_venant_kirchhoff": Law({"young": YOUNG, "poisson": POISSON}, _saint_venant_kirchhoff),
    "mooney_rivlin": Law({"c1": C1, "c2": C2, "bulk": BULK}, _mooney_rivlin),
}


@dataclass(frozen=True)
class Case:
    """A shear, "simple" by γ = ``amount`` or "generalised" by k = ``amount`` /m; a law; a mesh."""

    kind: str
    amount: float
    law: str
    element: str
    cells: int  # along an edge

    @property
    def power(self) -> int:
        """Of Y in the displacement."""
        return 1 if self.kind == "simple" else 2

    @property
    def is_in_space(self) -> bool:
        """Whether the element holds the field."""
        return self.power == 1 or self.element not in ("P1", "Q1")

    def displacement(self, points: Values) -> Values:
        """From rest to loaded (n, 3), m, at points of either: Y is the same."""
        return np.asarray(self.amount * points[:, 1, None] ** self.power * [1.0, 0.0, 0.0])

    def stress(self, y: Values) -> Values:
        """σ (..., 3, 3), Pa, at heights y (...), m."""
        return self._stress(self.amount * self.power * np.asarray(y) ** (self.power - 1))

    def body_force(self, y: Values) -> Values:
        """b (..., 3), N/m³: -∂σ/∂γ by a complex step, which is exact, times γ'."""
        if self.kind == "simple":
            return np.zeros((*np.shape(y), 3))
        h, bend = 1e-30, 2 * self.amount
        return np.asarray(-bend * self._stress(bend * y + 1j * h).imag[..., 1] / h)

    def _stress(self, gamma: Values) -> Values:
        F = np.eye(3) + gamma[..., None, None] * np.outer([1, 0, 0], [0, 1, 0])
        return LAWS[self.law].stress(F)


@dataclass(frozen=True)
class Outcome:
    """Errors of a case, each relative to the largest exact value.

    Attributes:
        place: largest distance of a node of the rest shape to the cube's, by the largest |u|.
        stress: of σ in the L2 norm.
        iterations: Newton iterations.
    """

    case: Case
    place: float
    stress: float
    iterations: int


def run(case: Case) -> Outcome:
    """The rest shape of the sheared cube, and how far it is from the cube."""
    cube = Mesh.box((case.cells,) * 3, (1.0, 1.0, 1.0), case.element)
    u = case.displacement(cube.points)
    rest = loaded_body(case, cube, cube.moved(cube.points + u)).rest_shape(rtol=RTOL)
    far = np.linalg.norm(rest.points - cube.points, axis=1).max()
    place = float(far / np.linalg.norm(u, axis=1).max())
    return Outcome(case, place, _stress_error(case, rest), rest.iterations)


def loaded_body(case: Case, cube: Mesh, sheared: Mesh) -> Body:
    """The sheared shape with all that is known of it: supports, tractions, body force."""
    law = LAWS[case.law]
    body = Body(sheared, case.law, quadrature=DEGREE, **law.values)
    X, u = cube.points, case.displacement(cube.points)
    held = np.isin(X[:, 0], [0, 1]) | (X[:, 1] == 0)
    free = [(1, 1.0)]
    if case.kind == "simple":
        free += [(2, 0.0), (2, 1.0)]
    else:
        held |= np.isin(X[:, 2], [0, 1])
    body.prescribe(np.flatnonzero(held), u[held])
    for axis, end in free:
        face = np.flatnonzero(X[:, axis] == end)
        sigma = case.stress(np.ones(()))  # on the top y = 1, and the same everywhere elsewhere
        body.traction(face, sigma[:, axis] * (1.0 if end else -1.0), per="loaded")
    return body.force(np.arange(len(X)), nodal_forces(case, sheared))


def nodal_forces(case: Case, mesh: Mesh) -> Values:
    """∫ b(y) N dv over the loaded shape (n, 3), N."""
    forces, table = np.zeros_like(mesh.points), mesh.table
    places, weights = quadrature(case.element, DEGREE)
    for place, weight in zip(places, weights, strict=True):
        shape = table.values(place[None])[0]
        volume = weight * np.abs(np.linalg.det(jacobians(mesh.points, mesh.cells, table, place)))
        b = case.body_force(mesh.points[mesh.cells, 1] @ shape)
        np.add.at(forces, mesh.cells, np.einsum("c,ci,a->cai", volume, b, shape))
    return forces


def _stress_error(case: Case, rest: Rest) -> float:
    at, loaded = rest._values, rest.loaded
    y = loaded.points[loaded.cells, 1] @ loaded.table.values(at.places).T
    exact = case.stress(y)
    off = ((rest.cauchy(at="quadrature") - exact) ** 2).sum(axis=(2, 3))
    return float(np.sqrt((at.volume * off).sum() / (at.volume * (exact**2).sum(axis=(2, 3))).sum()))
