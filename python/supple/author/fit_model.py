"""What a law predicts for measured tests, and how that changes with its parameters."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from . import modes
from .curves import reading, true_stress
from .data import Series
from .points import PointLaw

Floats = npt.NDArray[np.float64]

_STEP = 1e-5  # of a parameter's size, in central differences


class Model:
    """Predicted stress of all series as a function of the free parameters.

    Args:
        law: its other parameters stay as they are.
        series: the measurements.
        names: the free parameters.
        room: for each, how far it may be changed either way without leaving open bounds.
    """

    def __init__(self, law: PointLaw, series: list[Series], names: list[str]) -> None:
        self.law, self.series, self.names = law, series, names
        self.states: list[Floats | None] = [None] * len(series)  # F where the last solve ended

    def predict(self, theta: Floats) -> Floats:
        """Stresses (n,) Pa in the order of the series; NaN where the law has no state."""
        self._set(theta)
        parts = []
        for index, series in enumerate(self.series):
            F = self._state(series, self.states[index])
            if np.isfinite(F).all():
                self.states[index] = F
            parts.append(measured(self.law, series, F))
        return np.concatenate(parts)

    def jacobian(self, theta: Floats, room: Floats) -> Floats:
        """∂stress/∂theta (n, p): total, the free stretches moving along with the parameters.

        With equilibrium P_free(F, θ) = 0: dF_free/dθ = -A_free⁻¹ ∂P_free/∂θ, then the measured
        stress is differenced along (dF, dθ).

        Args:
            theta: (p,) values.
            room: (p,) distance of each to the nearest open bound; a step stays within a tenth.
        """
        self.predict(theta)
        columns = [self._column(theta, k, float(room[k])) for k in range(len(theta))]
        return np.column_stack(columns)

    def _column(self, theta: Floats, k: int, room: float) -> Floats:
        h = min(_STEP * max(abs(theta[k]), 1e-3), 0.1 * room)
        ahead, behind = theta.copy(), theta.copy()
        ahead[k] += h
        behind[k] -= h
        parts = []
        for series, F in zip(self.series, self.states, strict=True):
            assert F is not None  # predict() was finite here
            dF = self._free_rate(series, F, theta, ahead, behind, h)
            self._set(ahead)
            up = measured(self.law, series, F + h * dF)
            self._set(behind)
            parts.append((up - measured(self.law, series, F - h * dF)) / (2 * h))
        self._set(theta)
        return np.concatenate(parts)

    def _free_rate(
        self, series: Series, F: Floats, theta: Floats, ahead: Floats, behind: Floats, h: float
    ) -> Floats:
        """dF/dθ (n, 3, 3) that keeps the free faces free of stress."""
        rate = np.zeros_like(F)
        if not series.mode.free:
            return rate
        rows, columns = np.array(series.mode.free).T
        self._set(ahead)
        up = self.law.stress(F)[:, rows, columns]
        self._set(behind)
        change = (up - self.law.stress(F)[:, rows, columns]) / (2 * h)
        self._set(theta)
        A = self.law.tangent(F)[:, rows, columns][:, :, rows, columns]
        rate[:, rows, columns] = -np.linalg.solve(A, change[:, :, None])[:, :, 0]
        return rate

    def _state(self, series: Series, near: Floats | None) -> Floats:
        if near is not None:
            F = modes.equilibrium(self.law, series.mode, series.values, start=near)
            if np.isfinite(F).all():
                return F
        return modes.equilibrium(self.law, series.mode, series.values)

    def _set(self, theta: Floats) -> None:
        self.law.set(**dict(zip(self.names, theta.tolist(), strict=True)))


def measured(law: PointLaw, series: Series, F: Floats) -> Floats:
    """The stress (n,) Pa that the test of a series reads at F (n, 3, 3)."""
    P = law.stress(F)
    tensor = P if series.kind == "nominal" else true_stress(P, F)
    return reading(series.mode, tensor)
