"""Tests on a cube of material: which entries of F a machine drives and which ones it leaves free.

F is upper triangular, which takes rotation away; its free entries make ψ stationary, so P vanishes
in them and with it, P Fᵀ being symmetric, every traction on the free faces and every shear force.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from ..errors import InputError
from .points import PointLaw

Floats = npt.NDArray[np.float64]
Bools = npt.NDArray[np.bool_]

_AXES = (0, 1, 2)
_LONGEST_STEP = 0.2  # of the driven stretch, from one equilibrium to the next
_MOST_ITERATIONS, _MOST_HALVINGS = 40, 30
_SMALL = 1e-9  # a Newton step of F below which the next one would be rounding
_FLAT = 1e-4  # a lateral stretch below which the cube has collapsed


@dataclass(frozen=True)
class Mode:
    """One test.

    Attributes:
        name: such as "uniaxial".
        title: in words, for figures.
        control: what is driven: "stretch", "shear" or "volume ratio".
        rest: its value at rest.
        driven: entries of F that the machine holds at the value.
        free: entries of F found from equilibrium.
        measured: entry of P that the machine measures; None for the pressure.
    """

    name: str
    title: str
    control: str
    rest: float
    driven: tuple[tuple[int, int], ...]
    free: tuple[tuple[int, int], ...]
    measured: tuple[int, int] | None

    def start(self, values: Floats) -> Floats:
        """F (n, 3, 3) with the driven entries set and every other entry as at rest."""
        F = np.tile(np.eye(3), (len(values), 1, 1))
        if self.measured is None:
            return F * np.cbrt(values)[:, None, None]
        for i, j in self.driven:
            F[:, i, j] = values
        return F


_THICKNESS = ((2, 2), (0, 2), (1, 2))
MODES = {
    mode.name: mode
    for mode in (
        Mode("uniaxial", "uniaxial", "stretch", 1.0, ((0, 0),), ((1, 1), (0, 1), *_THICKNESS),
             (0, 0)),
        Mode("equibiaxial", "equibiaxial", "stretch", 1.0, ((0, 0), (1, 1)), _THICKNESS, (0, 0)),
        Mode("planar", "planar (pure shear)", "stretch", 1.0, ((0, 0),), _THICKNESS, (0, 0)),
        Mode("simple_shear", "simple shear", "shear", 0.0, ((0, 1),), (), (0, 1)),
        Mode("volumetric", "volumetric", "volume ratio", 1.0, (), (), None),
    )
}  # fmt: skip


def mode_of(name: str) -> Mode:
    """The mode of that name.

    Raises:
        InputError: there is none.
    """
    if name not in MODES:
        raise InputError(f"mode must be one of {', '.join(MODES)}, got {name!r}.")
    return MODES[name]


def equilibrium(
    law: PointLaw,
    mode: Mode,
    values: Floats,
    axes: Sequence[int] = _AXES,
    start: Floats | None = None,
) -> Floats:
    """F (n, 3, 3) of the test at each of ``values`` (n,), in the frame of the test.

    From rest in small steps, all points side by side, so each is on the branch that leaves rest;
    or at once from ``start`` (n, 3, 3), solutions nearby. NaN where the law has no equilibrium.

    Args:
        axes: the material's axes that the test's first, second and third lie along.
    """
    values = np.asarray(values, dtype=float)
    if not mode.free:
        return mode.start(values)
    if start is not None:
        F = start.copy()
        for i, j in mode.driven:
            F[:, i, j] = values
        return _relaxed(law, mode, F, axes)
    reach = np.abs(values - mode.rest).max(initial=0.0)
    count = max(1, int(np.ceil(reach / _LONGEST_STEP)))
    F = mode.start(np.full_like(values, mode.rest))
    for share in np.arange(1, count + 1) / count:
        for i, j in mode.driven:
            F[:, i, j] = mode.rest + share * (values - mode.rest)
        F = _relaxed(law, mode, F, axes)
    return F


def _relaxed(law: PointLaw, mode: Mode, F: Floats, axes: Sequence[int]) -> Floats:
    """F with ψ at a minimum over its free entries, by Newton with back-tracking on ψ."""
    rows, columns = np.array(mode.free).T
    F, done = F.copy(), np.zeros(len(F), dtype=bool)
    for _ in range(_MOST_ITERATIONS):
        step = _newton_step(law, F, rows, columns, axes)
        size = np.abs(step).max(axis=1)
        done = np.isfinite(size) & (size < _SMALL)
        F = _backtracked(law, F, step, (rows, columns), axes, done)
        if (done | ~np.isfinite(size)).all():
            break
    F[~done | (np.diagonal(F, axis1=1, axis2=2) < _FLAT).any(axis=1)] = np.nan
    return F


def _newton_step(
    law: PointLaw, F: Floats, rows: npt.NDArray[np.int64], columns: npt.NDArray[np.int64],
    axes: Sequence[int],
) -> Floats:  # fmt: skip
    """The step (n, free) downhill: negative curvatures count by their size."""
    gradient = stress(law, F, axes)[:, rows, columns]
    hessian = tangent(law, F, axes)[:, rows, columns][:, :, rows, columns]
    step = np.full_like(gradient, np.nan)
    good = np.isfinite(gradient).all(axis=1) & np.isfinite(hessian).all(axis=(1, 2))
    curvature, vectors = np.linalg.eigh(hessian[good])
    floor = 1e-12 * np.abs(curvature).max(axis=1, keepdims=True, initial=0.0)
    along = np.einsum("nij,ni->nj", vectors, gradient[good])
    along /= np.maximum(np.abs(curvature), np.maximum(floor, np.finfo(float).tiny))
    step[good] = -np.einsum("nij,nj->ni", vectors, along)
    return step


def _backtracked(
    law: PointLaw, F: Floats, step: Floats, entries: tuple[npt.NDArray[np.int64], ...],
    axes: Sequence[int], accept: Bools,
) -> Floats:  # fmt: skip
    """F + step, halved until F stays right-handed and ψ does not rise; ``accept`` skips the test.

    NaN where no such step is found. ψ of a nearly incompressible law is large, so the last steps
    lower it by less than rounding.
    """
    rows, columns = entries
    before = energy(law, F, axes)
    waiting = np.isfinite(step).all(axis=1)
    out, scale = F.copy(), np.ones(len(F))
    for _ in range(_MOST_HALVINGS):
        trial = F.copy()
        trial[:, rows, columns] += scale[:, None] * step
        psi = energy(law, trial, axes)
        upright = (np.diagonal(trial, axis1=1, axis2=2) > 0).all(axis=1)
        slack = 1e-12 * np.abs(before) + np.finfo(float).tiny
        tiny = np.abs(scale[:, None] * step).max(axis=1) < 1e-6
        good = waiting & upright & np.isfinite(psi) & ((psi <= before + slack) | tiny | accept)
        out[good] = trial[good]
        waiting &= ~good
        if not waiting.any():
            break
        scale[waiting] /= 2
    out[waiting] = np.nan
    return out


def energy(law: PointLaw, F: Floats, axes: Sequence[int] = _AXES) -> Floats:
    """ψ (n,) Pa at F (n, 3, 3) of the test's frame."""
    return law.energy(_turned(F, axes))


def stress(law: PointLaw, F: Floats, axes: Sequence[int] = _AXES) -> Floats:
    """P (n, 3, 3) Pa in the test's frame."""
    P = law.stress(_turned(F, axes))
    return P[:, axes][:, :, axes]


def tangent(law: PointLaw, F: Floats, axes: Sequence[int] = _AXES) -> Floats:
    """∂P/∂F (n, 3, 3, 3, 3) Pa in the test's frame."""
    A = law.tangent(_turned(F, axes))
    return A[:, axes][:, :, axes][:, :, :, axes][:, :, :, :, axes]


def _turned(F: Floats, axes: Sequence[int]) -> Floats:
    """F of the test's frame in the material's: its axes are renamed."""
    out = np.empty_like(F)
    index = np.asarray(axes)
    out[:, index[:, None], index[None, :]] = F
    return out
