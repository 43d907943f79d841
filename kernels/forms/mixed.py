"""Displacement and pressure: the saddle of ∫ psi_dev + p g(J) - U*(p), Mazier 2022, eqs. 36–45.

direct   R_u = ∫ P:∇0η dV,  R_p = ∫ (g(J) - U*'(p)) q dV
inverse  R_u = ∫ σ:∇η dv,   R_p = ∫ (g(J) - U*'(p)) q / J dv,  F = (I + ∇u')⁻¹

The pressure is continuous, of one degree less than the displacement (Taylor and Hood 1973). It is
the multiplier of the constraint, so σ_vol = p g'(J). "u" holds the displacement, then the pressures
of the cell's corners.
"""

from __future__ import annotations

from typing import Any

import ufl

from ..elements import MixedSpace, mixed_space
from ..kinematics import Kinematics
from ..law import Law
from .common import Forms, at_points, measure, volume_scale


def direct(law: Law, element: str, degree: int) -> Forms:
    """Kernels energy (of the saddle), residual, tangent, volume_ratio and points."""
    space, values = _prepare(law, element)
    F, p = (
        ufl.variable(ufl.Identity(3) + ufl.grad(space.displacement)),
        ufl.variable(space.pressure),
    )
    psi = law.psi_mixed(Kinematics(F, ufl.Jacobian(space.mesh)), p, values)
    P, gap = ufl.diff(psi, F), ufl.diff(psi, p)
    dx = measure(space, degree)
    residual = (ufl.inner(P, ufl.grad(space.test)) + gap * space.pressure_test) * dx
    kernels = {
        "energy": psi * dx,
        "residual": residual,
        "tangent": ufl.derivative(residual, space.unknown, space.trial),
        "volume_ratio": at_points(space, degree, ufl.det(F)),
        "points": at_points(space, degree, F, P, psi, volume_scale(space)),
    }
    return Forms(space, {"u": space.unknown, **values}, kernels, degree, space.pressures)


def inverse(law: Law, element: str, degree: int) -> Forms:
    """Kernels residual, tangent, volume_ratio and points of a law on its loaded shape."""
    space, values = _prepare(law, element)
    to_rest = ufl.Identity(3) + ufl.grad(space.displacement)
    ratio = ufl.det(to_rest)  # 1 / J
    F, p = ufl.variable(ufl.inv(to_rest)), ufl.variable(space.pressure)
    psi = law.psi_mixed(Kinematics(F, to_rest * ufl.Jacobian(space.mesh)), p, values)
    P, gap = ufl.diff(psi, F), ufl.diff(psi, p)
    work = ratio * ufl.inner(P * F.T, ufl.grad(space.test))
    dx = measure(space, degree)
    residual = (work + ratio * gap * space.pressure_test) * dx
    kernels = {
        "residual": residual,
        "tangent": ufl.derivative(residual, space.unknown, space.trial),
        "volume_ratio": at_points(space, degree, ratio),
        "points": at_points(space, degree, F, P, psi, ratio * volume_scale(space)),
    }
    return Forms(space, {"u": space.unknown, **values}, kernels, degree, space.pressures)


def _prepare(law: Law, element: str) -> tuple[MixedSpace, dict[str, Any]]:
    space = mixed_space(element)
    return space, {p.name: space.field(p.kind.size) for p in law.parameters}
