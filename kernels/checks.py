"""What every energy must be, tried on numbers before compiling: scalar, objective, stress free.

The numbers come from the energy file run on numeric tensors, so nothing of UFL is involved.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from .kinematics import Kinematics
from .membrane_kinematics import SurfaceKinematics
from .reader import EnergyFileError, Law, blamed
from .tensors import Tensor

_EDGES = np.array([[1.0, 0.2, 0.1], [0.1, 0.9, 0.3], [0.0, 0.2, 1.1]])


def energy_at(law: Law, F: np.ndarray, values: dict[str, Any], edges: Any = _EDGES) -> float:
    """ψ, Pa, of the deformation gradient ``F`` (3, 3) and parameters name → value."""
    k = Kinematics(np.asarray(F, float).view(Tensor), np.asarray(edges).view(Tensor))
    with blamed(law), np.errstate(all="ignore"):  # NaN is refused by its caller
        psi = law.psi(k, _tensors(values))
    return _scalar(law, psi)


def skin_energy_at(law: Law, stretches: tuple[float, float], values: dict[str, Any]) -> float:
    """ψ, Pa, of a skin with two principal stretches in its plane."""
    k = SurfaceKinematics(np.diag(np.square(stretches)).view(Tensor))
    with blamed(law), np.errstate(all="ignore"):
        psi = law.psi_incompressible(k, _tensors(values))
    return _scalar(law, psi)


def _tensors(values: dict[str, Any]) -> dict[str, Any]:
    return {n: np.asarray(v, float).view(Tensor) if np.ndim(v) else v for n, v in values.items()}


def _scalar(law: Law, psi: Any) -> float:
    if np.ndim(psi) != 0 or callable(psi):
        raise EnergyFileError(
            f"{law.path}:{law.line}: the energy is not a scalar but has shape {np.shape(psi)}; "
            "contract it, for example with tr() or inner()."
        )
    return float(psi)


def stress_at(law: Law, F: np.ndarray, values: dict[str, Any], step: float = 1e-5) -> np.ndarray:
    """P (3, 3), Pa, by central differences of ψ."""
    stress = np.zeros((3, 3))
    for i, j in np.ndindex(3, 3):
        d = np.zeros((3, 3))
        d[i, j] = step
        difference = energy_at(law, F + d, values) - energy_at(law, F - d, values)
        stress[i, j] = difference / (2 * step)
    return stress


def rest_stress(law: Law, values: dict[str, Any]) -> np.ndarray:
    """P (3, 3), Pa, at F = I.

    Extrapolated from two steps, since fibres that only pull make the energy's curvature jump there
    and central differences then err at first order.
    """
    wide, narrow = (stress_at(law, np.eye(3), values, step) for step in (1e-5, 5e-6))
    return np.asarray(2 * narrow - wide)


def stiffness_scale(law: Law, values: dict[str, Any]) -> float:
    """Largest second difference of ψ at F = I, Pa: beside it a stress counts as zero or not."""
    step, eye = 1e-3, np.eye(3)
    zero = energy_at(law, eye, values)
    second = 0.0
    for i, j in np.ndindex(3, 3):
        d = np.zeros((3, 3))
        d[i, j] = step
        psi = energy_at(law, eye + d, values) + energy_at(law, eye - d, values) - 2 * zero
        second = max(second, abs(psi) / step**2)
    return second


def random_rotation(rng: np.random.Generator) -> np.ndarray:
    """A rotation (3, 3), uniformly distributed."""
    q, r = np.linalg.qr(rng.standard_normal((3, 3)))
    q = q * np.sign(np.diag(r))
    return np.asarray(q if np.linalg.det(q) > 0 else -q)


def require_sound(law: Law) -> None:
    """Refuse an energy that is not scalar, finite, zero and stress free at rest, and objective.

    Raises:
        EnergyFileError: one sentence with the figure found; declared exceptions are let pass.
    """
    values = {p.name: p.default for p in law.parameters}
    if law.solid:
        _require_solid(law, values)
    if law.surface:
        _require_skin(law, values)


def _require_solid(law: Law, values: dict[str, Any]) -> None:
    scale = stiffness_scale(law, values)
    if not np.isfinite(scale) or scale == 0.0:
        raise EnergyFileError(
            f"{law.path}:{law.line}: the energy has no finite stiffness at F = I; check it."
        )
    if "stress_free" not in law.exceptions:
        _require_stress_free(law, values, scale)
    if "objective" not in law.exceptions:
        _require_objective(law, values, scale)


def _require_stress_free(law: Law, values: dict[str, Any], scale: float) -> None:
    declare = 'subtract its value at F = I, or declare exceptions = {"stress_free"}.'
    psi = energy_at(law, np.eye(3), values)
    if abs(psi) > 1e-10 * scale:
        raise EnergyFileError(
            f"{law.path}:{law.line}: psi at F = I is {psi:.6g} Pa, not 0; {declare}"
        )
    stress = np.abs(rest_stress(law, values)).max()
    if stress > 1e-6 * scale:
        raise EnergyFileError(
            f"{law.path}:{law.line}: the stress at F = I is {stress:.6g} Pa, not 0; {declare}"
        )


def _require_objective(law: Law, values: dict[str, Any], scale: float) -> None:
    rng = np.random.default_rng(0)
    for _ in range(8):
        F = np.eye(3) + 0.2 * rng.standard_normal((3, 3))
        if np.linalg.det(F) < 0.3:
            continue
        psi, turned = (energy_at(law, Q @ F, values) for Q in (np.eye(3), random_rotation(rng)))
        if abs(psi - turned) > 1e-9 * max(scale, abs(psi)):
            raise EnergyFileError(
                f"{law.path}:{law.line}: is not objective: a rotation changes psi from "
                f"{psi:.6g} to {turned:.6g} Pa; write it in C, its invariants or E, or declare "
                'exceptions = {"objective"}.'
            )


def _require_skin(law: Law, values: dict[str, Any]) -> None:
    """ψ_surface(I) = 0, and no lateral tension at the width 1/√λ, where the skin folds."""

    def energy(*stretches: float) -> float:
        return skin_energy_at(law, stretches, values)  # type: ignore[arg-type]

    h = 1e-3
    scale = (energy(1 + h, 1 + h) + energy(1 - h, 1 - h) - 2 * energy(1.0, 1.0)) / h**2
    if not np.isfinite(scale) or scale <= 0.0:
        raise EnergyFileError(
            f"{law.path}:{law.line}: psi_surface has no finite stiffness at rest; check it."
        )
    if abs(energy(1.0, 1.0)) > 1e-10 * scale:
        raise EnergyFileError(
            f"{law.path}:{law.line}: psi_surface at rest is {energy(1.0, 1.0):.6g} Pa, not 0; "
            "subtract its value there."
        )
    for stretch in (1.0, 1.1):
        width, h = stretch**-0.5, 1e-5
        lateral = (energy(stretch, width + h) - energy(stretch, width - h)) / (2 * h)
        if abs(lateral) > 1e-6 * scale:
            raise EnergyFileError(
                f"{law.path}:{law.line}: psi_surface has a lateral tension of {lateral:.6g} Pa at "
                f"the stretches {stretch:g} and {width:.4g}, where a skin that keeps its volume "
                "has none; write it in k.I1_s + 1/k.J_s**2."
            )
