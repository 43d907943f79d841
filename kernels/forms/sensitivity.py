"""Sensitivities: ∂R/∂(every field) and ∂R/∂X of the residual of any term, at fixed unknowns.

    d_<field>  (rows × its entries)  by a parameter, a direction, a load's value, a thickness
    d_points   (rows × 3m)           by the coordinates of the mesh's nodes (SpatialCoordinate)

A term under mean dilatation adds what the cell's pressure does: ∂R/∂a at fixed p + push ⊗ ∂p/∂a.
"""

from __future__ import annotations

from typing import Any

import ufl

from .common import Composite, Forms
from .mean_dilatation import DILATE, Model, call, model, outer, weighted

_BY_POINTS = """    ALIGNED double of_rest[{cols} * LANES] = {{0}};
    call_volume_by_points(slope, w, inner, x);
    call_rest_volume_by_points(of_rest, w, inner, x);
    for (int j = 0; j < {cols}; ++j)
        for (int l = 0; l < LANES; ++l)
            slope[j * LANES + l] = law[2 * LANES + l] / rest[l] *
                (slope[j * LANES + l] - inner[l] * of_rest[j * LANES + l]);"""


def of(forms: Forms) -> Forms:
    """Sensitivity kernels of a term whose residual is a form."""
    residual = forms.kernels["residual"]
    fields = {name: value for name, value in forms.fields.items() if name != "u"}
    kernels = {f"d_{name}": _by_field(residual, value) for name, value in fields.items()}
    kernels["d_points"] = _by_points(residual, forms.space)
    return Forms(forms.space, forms.fields, kernels, forms.degree, forms.scalars)


def of_mean_dilatation(law: Any, element: str, degree: int, inverse: bool) -> Forms:
    """Sensitivity kernels of a law under mean dilatation."""
    m = model(law, element, degree, inverse)
    composites = {f"d_{name}": _by_parameter(m, name, value) for name, value in m.values.items()}
    m.parts["isochoric_by_points"] = _by_points(m.residual, m.space)
    for part in ("volume", "rest_volume"):
        m.parts[f"{part}_by_points"] = _slope_by_points(m.parts[part], m.space)
    through_p = outer(m.dofs, m.dofs, _BY_POINTS.format(cols=m.dofs))
    body = DILATE + call("isochoric_by_points") + through_p
    composites["d_points"] = Composite(m.dofs, m.dofs, body)
    return m.forms({}, composites)


def _by_field(residual: Any, field: Any) -> Any:
    return ufl.derivative(residual, field, ufl.TrialFunction(field.ufl_function_space()))


def _by_points(residual: Any, space: Any) -> Any:
    return ufl.derivative(
        residual, ufl.SpatialCoordinate(space.mesh), ufl.TrialFunction(_coordinates(space.mesh))
    )


def _slope_by_points(volume: Any, space: Any) -> Any:
    return ufl.derivative(
        volume, ufl.SpatialCoordinate(space.mesh), ufl.TestFunction(_coordinates(space.mesh))
    )


def _coordinates(mesh: Any) -> Any:
    return ufl.FunctionSpace(mesh, mesh.ufl_coordinate_element())


def _by_parameter(m: Model, name: str, value: Any) -> Composite:
    """By a parameter of psi_dev at fixed p, by one of psi_vol through p, by one of both."""
    size = int(value.ufl_function_space().ufl_element().dim)
    body = DILATE
    if name in m.law.arguments("psi_dev", m.values):
        m.parts[f"isochoric_by_{name}"] = _by_field(m.residual, value)
        body += call(f"isochoric_by_{name}")
    if name in m.law.arguments("psi_vol", m.values):
        m.parts[f"pressure_by_{name}"] = m.at_theta(_pressure_by(m, name, value))
        body += outer(m.dofs, size, weighted(f"pressure_by_{name}", size, "1.0"))
    return Composite(m.dofs, size, body)


def _pressure_by(m: Model, name: str, value: Any) -> Any:
    theta, own = ufl.variable(m.inner["dilatation"]), ufl.variable(value)
    stored = m.law.psi_vol(theta, {**m.values, name: own}).U
    return ufl.diff(ufl.diff(stored, theta), own)
