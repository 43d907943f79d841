"""Mean dilatation: the volumetric part sees one volume ratio a cell, θ = V / V0.

    Π = ∫ psi_dev dV + V0 U(θ),  V = ∫ J dV,  p = U'(θ)

so R = ∫ (P_dev + p ∂J/∂F):∇η dV and K = its derivative at fixed p, plus U''(θ)/V0 b bᵀ, b = ∂V/∂u.
No extra unknowns; FEBio's hexahedron. Nagtegaal, Parks and Rice (1974), CMAME 4; Simo, Taylor and
Pister (1985), CMAME 51, with θ and p constant in the cell.

inverse: the mesh is the loaded shape, so V is its own volume and V0 = ∫ 1/J dv moves with u'.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np
import ufl

from ..elements import Space
from ..elements import space as make_space
from ..kinematics import Kinematics
from ..law import Law
from .common import Composite, Forms, at_points, measure, volume_scale

#: θ, p = U'(θ) and U(θ) as the parts see them, in the order of the C array `inner`.
INNER = ("dilatation", "pressure", "stored")

#: What every composite begins with; law holds U, U', U'' at θ.
DILATE = """
    ALIGNED double inner[3 * LANES] = {0}, law[3 * LANES] = {0};
    ALIGNED double rest[LANES] = {0}, now[LANES] = {0};
    call_rest_volume(rest, w, inner, x);
    call_volume(now, w, inner, x);
    for (int l = 0; l < LANES; ++l) inner[l] = now[l] / rest[l];
    call_volumetric(law, w, inner, x);
    for (int l = 0; l < LANES; ++l) {
        inner[LANES + l] = law[LANES + l];
        inner[2 * LANES + l] = law[l];
    }
"""
_ENERGY = """
    call_isochoric_energy(A, w, inner, x);
    for (int l = 0; l < LANES; ++l) A[l] += rest[l] * inner[2 * LANES + l];
"""
#: A += push ⊗ slope: what a pressure pushes with, times the pressure's own derivative.
_OUTER = """
    ALIGNED double push[{rows} * LANES] = {{0}}, slope[{cols} * LANES] = {{0}};
    call_push(push, w, inner, x);
{slope}
    for (int i = 0; i < {rows}; ++i)
        for (int j = 0; j < {end}; ++j)
            for (int l = 0; l < LANES; ++l)
                A[(i * {cols} + j) * LANES + l] += push[i * LANES + l] * slope[j * LANES + l];
"""
_WEIGHTED = """    call_{part}(slope, w, inner, x);
    for (int j = 0; j < {cols}; ++j)
        for (int l = 0; l < LANES; ++l) slope[j * LANES + l] *= {weight};"""


@dataclass
class Model:
    """The UFL pieces of one law on one element, direct or inverse."""

    law: Law
    space: Space
    values: dict[str, Any]
    inner: dict[str, Any]
    degree: int
    inverse: bool
    residual: Any  # at fixed p
    volume_ratio: Any
    parts: dict[str, Any] = field(default_factory=dict)

    @property
    def dofs(self) -> int:
        """Of a cell."""
        return int(self.space.displacement.ufl_function_space().ufl_element().dim)

    def forms(self, kernels: dict[str, Any], composites: dict[str, Composite]) -> Forms:
        """The kernels with those parts that they call."""
        called = {n: p for n, p in self.parts.items()
                  if any(f"call_{n}(" in c.body for c in composites.values())}  # fmt: skip
        fields = {"u": self.space.displacement, **self.values}
        return Forms(self.space, fields, kernels, self.degree, inner=self.inner, parts=called,
                     composites=composites)  # fmt: skip

    def at_theta(self, *values: Any) -> Any:
        """Scalars of θ and the parameters, as a part."""
        middle = np.full((1, self.space.mesh.topological_dimension), 0.25)
        return ufl.as_vector(values), middle


def direct(law: Law, element: str, degree: int) -> Forms:
    """Kernels energy, residual, tangent, volume_ratio and points of a law on the reference."""
    m = model(law, element, degree, inverse=False)
    slope = weighted("push", m.dofs, "law[2 * LANES + l] / rest[l]")
    energy = {"energy": Composite(1, 1, DILATE + _ENERGY)}
    return m.forms({"volume_ratio": m.volume_ratio}, {**energy, **_solver_kernels(m, slope)})


def inverse(law: Law, element: str, degree: int) -> Forms:
    """Kernels residual, tangent, volume_ratio and points of a law on its loaded shape."""
    m = model(law, element, degree, inverse=True)
    m.parts["rest_slope"] = ufl.derivative(
        m.parts["rest_volume"], m.space.displacement, m.space.test
    )
    slope = weighted("rest_slope", m.dofs, "-law[2 * LANES + l] * inner[l] / rest[l]")
    return m.forms({"volume_ratio": m.volume_ratio}, _solver_kernels(m, slope))


def model(law: Law, element: str, degree: int, inverse: bool) -> Model:
    """The pieces and the parts that every composite calls."""
    space = make_space(element)
    values = {p.name: space.field(p.kind.size) for p in law.parameters}
    inner = {name: space.field(1) for name in INNER}
    own, moved = ufl.Jacobian(space.mesh), ufl.Identity(3) + ufl.grad(space.displacement)
    F = ufl.variable(ufl.inv(moved) if inverse else moved)
    isochoric = law.psi_dev(Kinematics(F, moved * own if inverse else own), values)
    P = ufl.diff(isochoric, F) + inner["pressure"] * ufl.diff(ufl.det(F), F)
    rest = ufl.det(moved) if inverse else ufl.as_ufl(1.0)  # rest volume per volume of the mesh
    dx, gradient = measure(space, degree), ufl.grad(space.test)
    residual = ufl.inner(rest * P * F.T if inverse else P, gradient) * dx
    push = ufl.tr(gradient) if inverse else ufl.inner(ufl.diff(ufl.det(F), F), gradient)
    theta = ufl.variable(inner["dilatation"])
    stored = law.psi_vol(theta, values).U
    pressure = ufl.diff(stored, theta)
    m = Model(law, space, values, inner, degree, inverse, residual,
              at_points(space, degree, ufl.det(moved)))  # fmt: skip
    psi = isochoric + inner["stored"]
    m.parts |= {
        "rest_volume": rest * dx,
        "volume": (ufl.as_ufl(1.0) if inverse else ufl.det(F)) * dx,
        "volumetric": m.at_theta(stored, pressure, ufl.diff(pressure, theta)),
        "push": push * dx,
        "isochoric_energy": isochoric * dx,
        "isochoric_residual": residual,
        "isochoric_points": at_points(space, degree, F, P, psi, rest * volume_scale(space)),
    }
    return m


def outer(rows: int, cols: int, slope: str, symmetric: bool = False) -> str:
    """Statements that add push ⊗ slope to A; ``slope`` are those that fill slope."""
    end = f"(LOWER ? i + 1 : {cols})" if symmetric else str(cols)
    return _OUTER.format(rows=rows, cols=cols, slope=slope, end=end)


def weighted(part: str, cols: int, weight: str) -> str:
    """Statements that fill slope with a part times a weight of lane l."""
    return _WEIGHTED.format(part=part, cols=cols, weight=weight)


def call(part: str) -> str:
    """The statement that adds a part to A."""
    return f"    call_{part}(A, w, inner, x);\n"


def _solver_kernels(m: Model, slope: str) -> dict[str, Composite]:
    m.parts["isochoric_tangent"] = ufl.derivative(m.residual, m.space.displacement, m.space.trial)
    volumetric = outer(m.dofs, m.dofs, slope, symmetric=not m.inverse)
    expression, places = m.parts["isochoric_points"]
    rows = len(places) * int(expression.ufl_shape[0])
    return {
        "residual": Composite(m.dofs, 1, DILATE + call("isochoric_residual")),
        "tangent": Composite(m.dofs, m.dofs, DILATE + call("isochoric_tangent") + volumetric),
        "points": Composite(rows, 1, DILATE + call("isochoric_points")),
    }
