"""Solids: equilibrium on the reference (direct) and on the loaded shape (inverse).

direct   ∫ P:∇0η dV              u = x - X on the reference mesh           Mazier 2022, eq. 19
inverse  ∫ σ:∇η dv, F = (I+∇u')⁻¹  u' = X - x on the mesh of the loaded shape  eqs. 32–35

Geometry is isoparametric and the points are the same in the reference cell, so the two are the
same discrete equations read both ways.
"""

from __future__ import annotations

from typing import Any

import ufl
from ufl.algorithms.analysis import extract_type

from ..elements import space as make_space
from ..kinematics import Kinematics
from ..reader import Law
from .common import Forms, PointLaw, at_points, measure, volume_scale


def direct(law: Law, element: str, degree: int) -> Forms:
    """Kernels energy, residual, tangent, volume_ratio and points of a law on the reference."""
    space, values = _prepare(law, element)
    F = ufl.variable(ufl.Identity(3) + ufl.grad(space.displacement))
    psi = law.psi(Kinematics(F, ufl.Jacobian(space.mesh)), values)
    P = ufl.diff(psi, F)
    dx = measure(space, degree)
    residual = ufl.inner(P, ufl.grad(space.test)) * dx
    kernels = {
        "energy": psi * dx,
        "residual": residual,
        "tangent": ufl.derivative(residual, space.displacement, space.trial),
        "volume_ratio": at_points(space, degree, ufl.det(F)),
        "points": at_points(space, degree, F, P, psi, volume_scale(space)),
    }
    fields = {"u": space.displacement, **values}
    return Forms(space, fields, kernels, degree)


def inverse(law: Law, element: str, degree: int) -> Forms:
    """Kernels residual, tangent, volume_ratio and points of a law on its loaded shape."""
    space, values = _prepare(law, element)
    to_rest = ufl.Identity(3) + ufl.grad(space.displacement)
    ratio = ufl.det(to_rest)  # 1 / J
    F = ufl.variable(ufl.inv(to_rest))
    psi = law.psi(Kinematics(F, to_rest * ufl.Jacobian(space.mesh)), values)
    P = ufl.diff(psi, F)
    cauchy = ratio * P * F.T
    dx = measure(space, degree)
    residual = ufl.inner(cauchy, ufl.grad(space.test)) * dx
    rest_volume = ratio * volume_scale(space)
    kernels = {
        "residual": residual,
        "tangent": ufl.derivative(residual, space.displacement, space.trial),
        "volume_ratio": at_points(space, degree, ratio),
        "points": at_points(space, degree, F, P, psi, rest_volume),
    }
    fields = {"u": space.displacement, **values}
    return Forms(space, fields, kernels, degree, law=_alone(law, space, psi, values))


def _alone(law: Law, space: Any, psi: Any, values: dict[str, Any]) -> PointLaw | None:
    """The law as a function of F, unless it looks at the cell's edges too."""
    if extract_type(psi, ufl.classes.Jacobian):
        return None
    entries = space.field(9)
    F = ufl.variable(ufl.as_matrix([[entries[3 * i + j] for j in range(3)] for i in range(3)]))
    P = ufl.diff(law.psi(Kinematics(F), values), F)
    A = ufl.diff(P, F)
    stress = [P[p // 3, p % 3] for p in range(9)]
    moduli = [A[p // 3, p % 3, q // 3, q % 3] for p in range(9) for q in range(p + 1)]
    return PointLaw(entries, ufl.as_vector([*stress, *moduli]))


def _prepare(law: Law, element: str) -> tuple[Any, dict[str, Any]]:
    space = make_space(element)
    return space, {p.name: space.field(p.kind.size) for p in law.parameters}
