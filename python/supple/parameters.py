"""Values of a law's parameters, per cell, checked against type and bounds."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from .errors import InputError, MaterialError

if TYPE_CHECKING:
    from .kernels.reader import Law, Parameter

Floats = npt.NDArray[np.float64]


def defaults(law: Law, count: int, skin: bool = False) -> dict[str, Floats]:
    """Each parameter's default as (count, size) rows; a skin keeps its volume: poisson is 0.5.

    Raises:
        MaterialError: a skin's energy for a solid, or a law with directions for a skin.
    """
    directed = [p.name for p in law.parameters if p.kind.size > 1]
    if skin and directed:
        raise MaterialError(
            f"{law.name} has a direction, {directed[0]}, and cannot make a skin, which knows no "
            "directions in its plane, at rest or loaded; use an isotropic law, such as fung_skin."
        )
    if not skin and not law.solid:
        raise MaterialError(
            f"{law.name} is a skin's energy (psi_surface alone) and cannot make a solid; "
            "give it to body.skin, or define psi(k, ...) in its file."
        )
    values: dict[str, Floats] = {}
    for p in law.parameters:
        default = 0.5 if skin and p.name == "poisson" else p.default
        values[p.name] = rows(p, default, count, skin)
    return values


def given(law: Law, values: Mapping[str, Any], count: int, skin: bool = False) -> dict[str, Floats]:
    """The given values as (count, size) rows.

    Raises:
        MaterialError: an unknown name (the nearest is named) or a value outside its bounds.
    """
    from .kernels.reader import nearest

    known = {p.name: p for p in law.parameters}
    for name in values:
        if name not in known:
            raise MaterialError(f"{law.name} has no parameter {name}; {nearest(name, known)}")
    return {name: rows(known[name], value, count, skin) for name, value in values.items()}


def rows(parameter: Parameter, value: Any, count: int, skin: bool = False) -> Floats:
    """One value for all cells, or one for each, as (count, size) rows; directions at length 1."""
    name, size = parameter.name, parameter.kind.size
    kind = parameter.kind
    if skin and name == "poisson":  # the membrane keeps its volume, so 0.5 is its natural value
        kind = replace(kind, open=False)
    array = per_cell(name, value, count, size)
    if size > 1:
        return _unit_vectors(name, array)
    if not kind.admits(array):
        raise MaterialError(
            f"{name} must lie in {kind.range()}{_unit(kind)}, got {_worst(kind, array):g}; "
            f"its law's own default is {parameter.default}."
        )
    return array


def _unit_vectors(name: str, array: Floats) -> Floats:
    """Rows at length 1, scaled by their largest entry first so that nothing over- or underflows."""
    largest = np.abs(array).max(axis=1, keepdims=True)
    wrong = ~(np.isfinite(largest) & (largest > 0)).ravel()
    if wrong.any():
        row = array[wrong][0].tolist()
        raise MaterialError(
            f"{name} must be a direction other than zero, got {row}; give three finite numbers."
        )
    scaled = array / largest
    return np.asarray(scaled / np.linalg.norm(scaled, axis=1, keepdims=True))


def per_cell(name: str, value: Any, count: int, size: int = 1) -> Floats:
    """A scalar (or one row) for all cells, or one for each, as (count, size) float64.

    Raises:
        InputError: another shape, or not numbers.
    """
    try:
        array = np.asarray(value, dtype=np.float64)
    except (TypeError, ValueError):
        raise InputError(f"{name} must be a number or an array of them, got {value!r}.") from None
    single = () if size == 1 else (size,)
    every = (count, *single)
    if array.shape not in (single, every):
        raise InputError(f"{name} must have shape {single} or {every}, got {array.shape}.")
    return np.ascontiguousarray(np.broadcast_to(array, every).reshape(count, size))


def _unit(kind: Any) -> str:
    return "" if kind.unit == "1" else f" {kind.unit}"


def _worst(kind: Any, array: Floats) -> float:
    return next(float(v) for v in array.ravel() if not kind.admits(v))
