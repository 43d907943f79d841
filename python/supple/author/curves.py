"""Stress against deformation in the five tests that a material is known by."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from ..errors import InputError
from ..laws import read_law
from . import modes
from .modes import MODES, Mode, mode_of
from .points import PointLaw

Floats = npt.NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Curve:
    """A test on a cube of material; row i is the state at ``values[i]``, NaN where there is none.

    Attributes:
        mode: the test.
        values: (n,) stretch, amount of shear, or volume ratio J.
        deformation: (n, 3, 3) F in the test's frame: first axis along the load.
        nominal: (n, 3, 3) P, Pa, first Piola–Kirchhoff: force per rest area.
        energy: (n,) ψ, Pa.
        axes: the material's axes that the test's first, second and third lie along.
    """

    mode: Mode
    values: Floats
    deformation: Floats
    nominal: Floats
    energy: Floats
    axes: tuple[int, int, int] = (0, 1, 2)

    @property
    def cauchy(self) -> Floats:
        """σ = P Fᵀ / J (n, 3, 3), Pa."""
        return true_stress(self.nominal, self.deformation)

    @property
    def stress(self) -> Floats:
        """What the test measures (n,), Pa: nominal stress along the load, or the pressure."""
        return reading(self.mode, self.nominal if self.mode.measured else self.cauchy)

    @property
    def exists(self) -> npt.NDArray[np.bool_]:
        """(n,) whether the law has a state with finite stress there."""
        return _finite(self.nominal)


def true_stress(P: Floats, F: Floats) -> Floats:
    """σ = P Fᵀ / J (n, 3, 3), Pa, of P and F (n, 3, 3); NaN where there is no state."""
    with np.errstate(invalid="ignore"):
        J = np.linalg.det(F)[:, None, None]
    sigma: Floats = P @ np.swapaxes(F, 1, 2) / J
    return sigma


def reading(mode: Mode, stress: Floats) -> Floats:
    """What a test measures of ``stress`` (n, 3, 3), P or σ: its entry, or the pressure of σ."""
    if mode.measured is None:
        pressure: Floats = -np.trace(stress, axis1=1, axis2=2) / 3
        return pressure
    i, j = mode.measured
    entry: Floats = stress[:, i, j]
    return entry


def _finite(P: Floats) -> npt.NDArray[np.bool_]:
    finite: npt.NDArray[np.bool_] = np.logical_and.reduce(np.isfinite(P).reshape(len(P), 9), axis=1)
    return finite


def curves(
    material: str | Path,
    mode: str,
    values: npt.ArrayLike,
    axes: Sequence[int] = (0, 1, 2),
    **parameters: Any,
) -> Curve:
    """A law's answer to one test, from its own compiled kernels.

    The faces that the test does not grip carry no stress: their stretches, and shears that a fibre
    across the axes causes, are solved for.

    Args:
        material: name of a shipped energy, or path of an energy file.
        mode: "uniaxial" (F11 = stretch), "equibiaxial" (F11 = F22), "planar" (F22 = 1),
            "simple_shear" (F12 = shear) or "volumetric" (F = J^(1/3) I).
        values: (n,) stretches, shears or volume ratios J.
        axes: the material's axes that the test's first, second and third lie along.
        **parameters: the law's, in SI; its defaults where left out.

    Raises:
        MaterialError: unknown law or parameter, value out of bounds, wrong energy file.
        InputError: unknown mode, a stretch or volume ratio of 0 or less, wrong axes.
    """
    return along(PointLaw(read_law(material), **parameters), mode_of(mode), values, axes)


def along(
    law: PointLaw, mode: Mode, values: npt.ArrayLike, axes: Sequence[int] = (0, 1, 2),
    start: Floats | None = None,
) -> Curve:  # fmt: skip
    """The curve of a law at points; ``start`` (n, 3, 3) as in `modes.equilibrium`."""
    values = np.atleast_1d(np.asarray(values, dtype=float))
    _check(mode, values, axes)
    F = modes.equilibrium(law, mode, values, axes, start)
    P, psi = modes.stress(law, F, axes), modes.energy(law, F, axes)
    F = np.where(_finite(P)[:, None, None], F, np.nan)
    a, b, c = axes
    return Curve(mode, values, F, P, psi, (a, b, c))


def _check(mode: Mode, values: Floats, axes: Sequence[int]) -> None:
    if values.ndim != 1 or not np.isfinite(values).all():
        raise InputError(f"values must be numbers of shape (n,), got shape {values.shape}.")
    if mode.control != "shear" and (values <= 0).any():
        raise InputError(f"each {mode.control} must be above 0, got {values.min():g}.")
    if sorted(axes) != [0, 1, 2]:
        raise InputError(f"axes must be 0, 1 and 2 in some order, got {tuple(axes)}.")


__all__ = ["MODES", "Curve", "along", "curves"]
