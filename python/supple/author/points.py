"""A law at points: its own compiled kernels, each point a tetrahedron that shares no node.

On a P1 cell F is the same everywhere, so the kernels' energy, residual and tangent over the volume
are ψ, P and ∂P/∂F to rounding: what is drawn and fitted is what a body is solved with.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from .. import parameters
from ..core import core
from ..errors import InputError
from ..laws import compiled

if TYPE_CHECKING:
    from ..kernels.law import Law

Floats = npt.NDArray[np.float64]

_CELL = np.vstack([np.zeros(3), np.eye(3)])
_VOLUME = 1.0 / 6.0


class PointLaw:
    """ψ, P and ∂P/∂F of a law for many deformation gradients at once.

    Where ψ does not exist (a logarithm of a negative number) all three are NaN: the derivatives'
    own formulas may go on beyond, as Gent's do.

    Args:
        law: the energy as read from its file; compiled here at first use.
        **values: its parameters in SI, each one number, or one a point where all calls have as
            many points.

    Raises:
        MaterialError: unknown name, value out of bounds, wrong energy file.
    """

    def __init__(self, law: Law, **values: Any) -> None:
        from ..kernels.unit import Unit

        self.law = law
        count = _common_length(law, values)
        self._rows = parameters.defaults(law, 1) | parameters.given(law, values, count)
        self._library = compiled(Unit("direct", "P1", law.path))
        self._terms: dict[int, Any] = {}

    @property
    def values(self) -> dict[str, Any]:
        """Name → number or direction (3,), where it is the same at all points, else rows."""
        return {n: _plain(rows) for n, rows in self._rows.items()}

    def set(self, **values: float) -> None:
        """New numbers, the same at all points, without a look at bounds: differences cross them."""
        self._rows |= {name: np.array([[value]]) for name, value in values.items()}

    def energy(self, F: Floats) -> Floats:
        """ψ (n,) Pa of F (n, 3, 3)."""
        return self._tabulate("energy", F)[:, 0] / _VOLUME

    def stress(self, F: Floats) -> Floats:
        """P (n, 3, 3) Pa, first Piola–Kirchhoff; P[:, i, j] = ∂ψ/∂F_ij."""
        nodal = self._where_energy("residual", F).reshape(-1, 4, 3)
        return np.swapaxes(nodal[:, 1:], 1, 2) / _VOLUME

    def tangent(self, F: Floats) -> Floats:
        """A (n, 3, 3, 3, 3) Pa; A[:, i, j, k, l] = ∂P_ij/∂F_kl."""
        nodal = self._where_energy("tangent", F).reshape(-1, 4, 3, 4, 3)
        return nodal[:, 1:, :, 1:, :].transpose(0, 2, 1, 4, 3) / _VOLUME

    def _where_energy(self, kernel: str, F: Floats) -> Floats:
        exists = np.isfinite(self.energy(F))[:, None]
        return np.where(exists, self._tabulate(kernel, F), np.nan)

    def _tabulate(self, kernel: str, F: Floats) -> Floats:
        F = np.asarray(F, dtype=float)
        if F.ndim != 3 or F.shape[1:] != (3, 3):
            raise InputError(f"F must have shape (n, 3, 3), got {F.shape}.")
        if len(F) == 0:
            return np.zeros((0, {"energy": 1, "residual": 12, "tangent": 144}[kernel]))
        term = self._term(len(F))
        displacement = _CELL @ np.swapaxes(F - np.eye(3), 1, 2)
        table: Floats = term.tabulate(kernel, displacement.ravel())
        return table

    def _term(self, count: int) -> Any:
        if count not in self._terms:
            points = np.tile(_CELL, (count, 1)).ravel()
            cells = np.arange(4 * count, dtype=np.int32).reshape(count, 4)
            system = core().System(points, [])
            self._terms[count] = core().KernelTerm(self._library, system, cells)
        term = self._terms[count]
        for name, rows in self._rows.items():
            term.set_field(name, np.broadcast_to(rows, (count, rows.shape[1])).ravel())
        return term


def _plain(rows: Floats) -> Any:
    if len(rows) > 1:
        return rows
    return float(rows[0, 0]) if rows.shape[1] == 1 else tuple(rows[0].tolist())


def _common_length(law: Law, values: dict[str, Any]) -> int:
    """How many points the values are for: the length of the first that is one a point, or 1."""
    plain = {p.name: np.ndim(p.default) for p in law.parameters}
    long = [len(v) for name, v in values.items() if np.ndim(v) > plain.get(name, 0)]
    return long[0] if long else 1
