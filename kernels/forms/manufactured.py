"""Loads under which a body takes a displacement chosen beforehand, symbolically from ψ itself.

manufactured_force     -∫ b·η on the rest shape, b = -Div P(F(X))
manufactured_traction  -∫ t·η on the rest shape's facets, t = P(F(X)) N

F = I + ∂U/∂X with U = amplitude · X₂ (e^X₀, e^X₁, e^X₂), X in m (Mazier 2022, eq. 64): U = 0 on
the face X₂ = 0, and every entry of ∂U/∂X that is not zero is positive where X₂ > 0, so fibres in
the positive octant are in tension. X is differentiated as a variable, not through the mesh: the
loads are exact on any cell and on facets.
"""

from __future__ import annotations

from typing import Any

import ufl

from ..elements import Space
from ..elements import space as make_space
from ..kinematics import Kinematics
from ..reader import Law
from .common import Forms, at_points, measure, volume_scale


def force(law: Law, element: str, degree: int) -> Forms:
    """Kernel residual; kernel points: rows X, u, ∂u/∂X of the discrete field, and the volume."""
    space, fields, values = _prepare(law, element)
    X, P = _exact_stress(space, law, fields["amplitude"], values)
    slopes = ufl.diff(P, X)
    force = -ufl.as_vector([sum(slopes[i, j, j] for j in range(3)) for i in range(3)])
    place, u = ufl.SpatialCoordinate(space.mesh), space.displacement
    kernels = {
        "residual": -ufl.inner(force, space.test) * measure(space, degree),
        "points": at_points(
            space, degree, ufl.as_matrix([list(place), list(u)]), ufl.grad(u), volume_scale(space)
        ),
    }
    return Forms(space, fields, kernels, degree)


def traction(law: Law, facet: str, degree: int) -> Forms:
    """Kernel residual."""
    space, fields, values = _prepare(law, facet)
    _, P = _exact_stress(space, law, fields["amplitude"], values)
    tangents = ufl.Jacobian(space.mesh)
    area = ufl.cross(tangents[:, 0], tangents[:, 1])
    load = P * area / ufl.sqrt(ufl.inner(area, area))
    kernels = {"residual": -ufl.inner(load, space.test) * measure(space, degree)}
    return Forms(space, fields, kernels, degree)


FORMS = {"manufactured_force": force, "manufactured_traction": traction}


def _prepare(law: Law, element: str) -> tuple[Space, dict[str, Any], dict[str, Any]]:
    space = make_space(element)
    values = {p.name: space.field(p.kind.size) for p in law.parameters}
    fields = {"u": space.displacement, "amplitude": space.field(1), **values}
    return space, fields, values


def _exact_stress(space: Space, law: Law, amplitude: Any, values: dict[str, Any]) -> Any:
    """The place X, as a variable, and P (3, 3) of the chosen field there, Pa."""
    X = ufl.variable(ufl.SpatialCoordinate(space.mesh))
    field = amplitude * X[2] * ufl.as_vector([ufl.exp(X[i]) for i in range(3)])
    F = ufl.variable(ufl.Identity(3) + ufl.diff(field, X))
    return X, ufl.diff(law.psi(Kinematics(F), values), F)
