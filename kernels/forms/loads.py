"""Loads, as residuals (internal minus external force, so with a minus).

body_force       -∫ b·η on the mesh itself, b in N/m³: ρ0 g on the rest shape, ρ g on the loaded one
body_force_rest  -∫ (1/J) b·η on the loaded mesh, b per rest volume; u' = X - x       eq. 32
traction         -∫ t·η on the mesh's own facets, t in Pa
traction_moved   the same, t per area of the facets moved by u: Nanson's ‖Fᵀn‖/J in an inverse solve
pressure         +∫ p n·η on the mesh's own facets: pushes against the outward normal n
pressure_moved   the same on the facets moved by u: a follower load
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import ufl

from ..elements import LOAD_DEGREE, Space
from ..elements import space as make_space
from .common import Forms, measure


def body_force(element: str) -> Forms:
    return _load(element, lambda s, b: -ufl.inner(b, s.test), moved=False)


def body_force_rest(element: str) -> Forms:
    def integrand(s: Space, b: Any) -> Any:
        return -ufl.det(ufl.Identity(3) + ufl.grad(s.displacement)) * ufl.inner(b, s.test)

    return _load(element, integrand, moved=True)


def traction(facet: str) -> Forms:
    return _load(facet, lambda s, t: -ufl.inner(t, s.test), moved=False)


def traction_moved(facet: str) -> Forms:
    def integrand(s: Space, t: Any) -> Any:
        area = ufl.sqrt(ufl.inner(_area_vector(s, True), _area_vector(s, True)))
        return -area / _own_area(s) * ufl.inner(t, s.test)

    return _load(facet, integrand, moved=True)


def pressure(facet: str) -> Forms:
    def integrand(s: Space, p: Any) -> Any:
        return p * ufl.inner(_area_vector(s, False), s.test) / _own_area(s)

    return _load(facet, integrand, moved=False, size=1)


def pressure_moved(facet: str) -> Forms:
    def integrand(s: Space, p: Any) -> Any:
        return p * ufl.inner(_area_vector(s, True), s.test) / _own_area(s)

    return _load(facet, integrand, moved=True, size=1)


LOADS = {
    f.__name__: f
    for f in (body_force, body_force_rest, traction, traction_moved, pressure, pressure_moved)
}


def _load(name: str, integrand: Callable[[Space, Any], Any], moved: bool, size: int = 3) -> Forms:
    space, degree = make_space(name), LOAD_DEGREE[name]
    value = space.field(size)
    residual = integrand(space, value) * measure(space, degree)
    kernels = {"residual": residual}
    if moved:
        kernels["tangent"] = ufl.derivative(residual, space.displacement, space.trial)
    return Forms(space, {"u": space.displacement, "value": value}, kernels, degree)


def _area_vector(space: Space, moved: bool) -> Any:
    """Normal times area per reference area of the facet, of its own shape or moved by u."""
    tangents = ufl.Jacobian(space.mesh)
    if moved:
        tangents = tangents + ufl.grad(space.displacement) * tangents
    return ufl.cross(tangents[:, 0], tangents[:, 1])


def _own_area(space: Space) -> Any:
    own = _area_vector(space, False)
    return ufl.sqrt(ufl.inner(own, own))
