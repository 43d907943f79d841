"""Skin: a membrane of the body's own surface nodes that carries tension only.

    direct   Π = ∫ h ψ(C_s) dA on the rest surface, h its thickness at rest
    inverse  the same virtual work with the surface's loaded shape as the mesh

C_s is the in-plane Cauchy–Green tensor in an orthonormal frame of the rest surface, from the
covariant base vectors G (rest) and g (loaded). The skin keeps its volume, λ3 = 1/J_s. Compression
is relaxed (Pipkin 1986, IMA J. Appl. Math. 36): taut, wrinkled or slack by the principal stretches;
a residual 1e-3 of the unrelaxed energy keeps slack skin from being without stiffness.
"""

from __future__ import annotations

from typing import Any

import ufl

from ..elements import space as make_space
from ..membrane_kinematics import SurfaceKinematics
from ..reader import EnergyFileError, Law
from .common import Forms, at_points, measure

#: Share of the unrelaxed energy that remains in compression.
RESIDUAL = 1e-3


def direct(law: Law, facet: str, degree: int) -> Forms:
    """Kernels energy, residual, tangent and points on the rest surface."""
    space, fields, values = _prepare(law, facet)
    rest = ufl.Jacobian(space.mesh)
    moved = ufl.variable(rest + ufl.grad(space.displacement) * rest)
    psi = fields["thickness"] * relaxed(law, in_plane_tensor(rest, moved), values)
    dx = measure(space, degree)
    residual = _work(psi, moved, rest, space) * dx
    kernels = {
        "energy": psi * dx,
        "residual": residual,
        "tangent": ufl.derivative(residual, space.displacement, space.trial),
        "points": at_points(space, degree, in_plane_tensor(rest, moved), psi, _area(rest)),
    }
    return Forms(space, fields, kernels, degree)


def inverse(law: Law, facet: str, degree: int) -> Forms:
    """Kernels residual, tangent and points on the loaded surface; u' = X - x."""
    space, fields, values = _prepare(law, facet)
    own = ufl.Jacobian(space.mesh)
    rest = own + ufl.grad(space.displacement) * own
    loaded = ufl.variable(own)
    psi = fields["thickness"] * relaxed(law, in_plane_tensor(rest, loaded), values)
    dx = measure(space, degree)
    residual = _area(rest) / _area(own) * _work(psi, loaded, own, space) * dx
    kernels = {
        "residual": residual,
        "tangent": ufl.derivative(residual, space.displacement, space.trial),
        "points": at_points(space, degree, in_plane_tensor(rest, loaded), psi, _area(rest)),
    }
    return Forms(space, fields, kernels, degree)


def relaxed(law: Law, in_plane: Any, values: dict[str, Any]) -> Any:
    """Tension-field energy of the in-plane tensor (2, 2), Pa, plus its residual in compression."""
    taut = law.psi_incompressible(SurfaceKinematics(in_plane), values)
    first, second = _principal(in_plane)
    narrow = 1 / ufl.sqrt(first)  # square of the width that tension along `first` leaves
    stretched = ufl.as_matrix([[first, 0], [0, narrow]])
    wrinkled = law.psi_incompressible(SurfaceKinematics(stretched), values)
    in_tension = ufl.conditional(ufl.gt(first, 1.0), wrinkled, 0.0)
    is_taut = ufl.And(ufl.gt(first, 1.0), ufl.gt(second, narrow))
    return ufl.conditional(is_taut, taut, (1 - RESIDUAL) * in_tension + RESIDUAL * taut)


def in_plane_tensor(rest: Any, moved: Any) -> Any:
    """C_s (2, 2) in the orthonormal frame of the rest base vectors ``rest`` (3, 2)."""
    metric = rest.T * rest
    l00 = ufl.sqrt(metric[0, 0])
    l10 = metric[0, 1] / l00
    l11 = ufl.sqrt(metric[1, 1] - l10**2)
    upper_inverse = ufl.as_matrix([[1 / l00, -l10 / (l00 * l11)], [0, 1 / l11]])
    return upper_inverse.T * (moved.T * moved) * upper_inverse


def _principal(c: Any) -> tuple[Any, Any]:
    """Squares of the larger and the smaller principal stretch.

    The root is cut off just above zero: where the stretches coincide the skin is taut or slack,
    and neither uses the derivative of this.
    """
    mean, half = 0.5 * (c[0, 0] + c[1, 1]), 0.5 * (c[0, 0] - c[1, 1])
    radius = ufl.sqrt(ufl.max_value(half**2 + c[0, 1] ** 2, 1e-30))
    return mean + radius, mean - radius


def _work(psi: Any, base: Any, own: Any, space: Any) -> Any:
    """∂ψ/∂(loaded base vectors) : ∂η/∂ξ."""
    return ufl.inner(ufl.diff(psi, base), ufl.grad(space.test) * own)


def _area(base: Any) -> Any:
    normal = ufl.cross(base[:, 0], base[:, 1])
    return ufl.sqrt(ufl.inner(normal, normal))


def _prepare(law: Law, facet: str) -> tuple[Any, dict[str, Any], dict[str, Any]]:
    if "isotropic" in law.exceptions:
        raise EnergyFileError(f"{law.path}: {law.name} is not isotropic and cannot make a skin.")
    space = make_space(facet)
    values = {p.name: space.field(p.kind.size) for p in law.parameters}
    fields = {"u": space.displacement, "thickness": space.field(1), **values}
    return space, fields, values
