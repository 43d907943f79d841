"""Arguments of a body, checked before anything is made of them."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from .errors import InputError, MaterialError

if TYPE_CHECKING:
    from .kernels.law import Law
    from .mesh import Mesh

Floats = npt.NDArray[np.float64]


def require_offered(formulation: str, element: str) -> None:
    from .kernels.unit import OFFERED

    if formulation not in OFFERED:
        raise InputError(f"formulation must be one of {tuple(OFFERED)}, got {formulation!r}.")
    if element not in OFFERED[formulation]:
        raise InputError(
            f"formulation {formulation!r} wants a mesh of {' or '.join(OFFERED[formulation])}, "
            f"got {element}; use another mesh (elevated() gives P2, Q2L) or another formulation."
        )


def require_split(law: Law, formulation: str) -> None:
    if formulation != "displacement" and not law.is_split:
        raise MaterialError(
            f"formulation {formulation!r} needs a law with psi_dev and psi_vol, and {law.name} "
            'gives psi as a whole; use formulation "displacement" or another law.'
        )


def degree(mesh: Mesh, quadrature: int | tuple[int, str] | None) -> int | None:
    """The rule that was asked for, checked before anything is compiled."""
    from .kernels.degree import checked

    if quadrature is None:
        return None
    try:
        return checked(quadrature, mesh.table.cell.name)
    except ValueError as problem:
        raise InputError(str(problem)) from None


def vector(name: str, value: npt.ArrayLike) -> Floats:
    vector = np.asarray(value, dtype=float)
    if vector.shape != (3,) or not np.isfinite(vector).all():
        raise InputError(f"{name} must be three numbers, got {value!r}.")
    return vector


def rows(name: str, value: npt.ArrayLike, count: int) -> Floats:
    rows = np.asarray(value, dtype=float)
    if rows.shape != (count, 3) or not np.isfinite(rows).all():
        raise InputError(f"{name} must be finite with shape ({count}, 3), got {rows.shape}.")
    return rows
