"""What a law must be, each as a figure beside a limit; the figures' scale is its stiffness at rest.

The file, run on numbers, gives ψ; its compiled kernels give ψ, P and ∂P/∂F. Derivatives are tried
by central differences extrapolated once (Richardson), so their own error is of order h⁴.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from .points import PointLaw
from .samples import rotations

if TYPE_CHECKING:
    from ..kernels.law import Law

Floats = npt.NDArray[np.float64]

#: A point may lie so near a kink that the longest step straddles it; then a shorter one does not.
_STEPS = (1e-3, 1e-4, 1e-5)


@dataclass(frozen=True)
class Property:
    """One line of the table.

    Attributes:
        name: what is claimed.
        passed: None where there is nothing to pass: information.
        figure: the largest violation found, or words.
        limit: what the figure may be at most; None for words.
        note: where it fails, or why it may.
        declared: the exception that the file declares for it, or "".
    """

    name: str
    passed: bool | None
    figure: float | str
    limit: float | None = None
    note: str = ""
    declared: str = ""


def bounded(name: str, figure: float, limit: float, note: str = "") -> Property:
    """A property that holds where ``figure`` is at most ``limit``; NaN fails."""
    return Property(name, bool(figure <= limit), figure, limit, note)


def excused(law: Law, exception: str, tried: list[Property]) -> list[Property]:
    """Properties of which a declared exception must break one, and which pass then."""
    if exception not in law.exceptions:
        return tried
    broken = any(not p.passed for p in tried)
    note = "" if broken else f"it holds: take {exception} from the file's exceptions"
    return [Property(p.name, broken, p.figure, p.limit, note, exception) for p in tried]


def at_rest(law: Law, values: dict[str, Any], scale: float) -> list[Property]:
    """ψ(I) and σ(I), from the file on numbers."""
    from ..kernels import checks

    # Fibres that only pull make the curvature jump at rest, where a difference errs by O(h).
    wide, narrow = (checks.stress_at(law, np.eye(3), values, h) for h in (1e-5, 5e-6))
    psi = abs(checks.energy_at(law, np.eye(3), values)) / scale
    sigma = float(np.abs(2 * narrow - wide).max()) / scale
    tried = [bounded("psi(I) = 0", psi, 1e-10), bounded("sigma(I) = 0", sigma, 1e-6)]
    return excused(law, "stress_free", tried)


def objective(law: Law, values: dict[str, Any], F: Floats, scale: float, seed: int) -> Property:
    """ψ(QF) = ψ(F) for a random rotation Q of each F (n, 3, 3), from the file on numbers."""
    turned = rotations(np.random.default_rng(seed), len(F)) @ F
    change = _changes(on_numbers(law, values, F), on_numbers(law, values, turned), scale)
    return excused(law, "objective", [bounded("objective: psi(QF) = psi(F)", change, 1e-9)])[0]


def isotropic(point: PointLaw, F: Floats, scale: float, seed: int) -> Property:
    """ψ(QFQᵀ) = ψ(F) for a random rotation Q of each F (n, 3, 3).

    Of an objective law that is ψ(FQᵀ) = ψ(F); it has a meaning for small strains as well.
    """
    Q = rotations(np.random.default_rng(seed), len(F))
    turned = Q @ F @ np.swapaxes(Q, 1, 2)
    change = _changes(point.energy(F), point.energy(turned), scale)
    tried = [bounded("isotropic: psi(QFQᵀ) = psi(F)", change, 1e-9)]
    return excused(point.law, "isotropic", tried)[0]


def compiled_as_written(point: PointLaw, F: Floats, scale: float) -> Property:
    """The kernel's ψ is the file's."""
    change = _changes(point.energy(F), on_numbers(point.law, point.values, F), scale)
    return bounded("kernel's psi is the file's", change, 1e-9)


def derivatives(point: PointLaw, F: Floats, scale: float, seed: int) -> list[Property]:
    """P = ∂ψ/∂F, ∂P/∂F = A, A_ijkl = A_klij; ψ from the file, P and A from the kernels."""
    D = np.random.default_rng(seed).standard_normal(F.shape)
    D /= np.linalg.norm(D, axis=(1, 2), keepdims=True)
    P, A = point.stress(F), point.tangent(F)
    slope = np.einsum("nij,nij->n", P, D)
    curve = np.einsum("nijkl,nkl->nij", A, D)
    law, values = point.law, point.values
    stress_error = _mismatch(lambda G: on_numbers(law, values, G), slope, F, D, scale)
    tangent_error = _mismatch(point.stress, curve, F, D, scale)
    skew = np.abs(A - A.transpose(0, 3, 4, 1, 2)).max(axis=(1, 2, 3, 4))
    asymmetry = _largest(skew / (scale + np.abs(A).max(axis=(1, 2, 3, 4))))
    return [
        bounded("P is the derivative of psi", stress_error, 1e-6),
        bounded("tangent is the derivative of P", tangent_error, 1e-6),
        bounded("tangent is symmetric", asymmetry, 1e-11),
    ]


def barrier(point: PointLaw, scale: float) -> Property:
    """ψ grows without bound as J → 0: it still rises by half from J = 1e-8 to 1e-16."""
    sizes = np.cbrt([1e-8, 1e-16])
    psi = point.energy(sizes[:, None, None] * np.eye(3)) / scale
    growth = float(psi[0] / psi[1]) if np.isfinite(psi).all() and psi[1] > 0 else 1.0
    if np.isposinf(psi[1]):
        growth = 0.0
    tried = [bounded("barrier: psi → ∞ as J → 0", growth, 2 / 3)]
    return excused(point.law, "barrier", tried)[0]


def on_numbers(law: Law, values: dict[str, Any], F: Floats) -> Floats:
    """ψ (n,) Pa from the file itself, without its kernels."""
    from ..kernels import checks

    return np.array([checks.energy_at(law, f, values, np.eye(3)) for f in F])


def _mismatch(
    f: Callable[[Floats], Floats], slope: Floats, F: Floats, D: Floats, scale: float
) -> float:
    """Largest distance of ``slope`` from an extrapolated difference of f along D, over its size.

    Of several steps the best counts: a wrong slope is far from all of them. Points where f does not
    exist are left out.
    """
    each = tuple(range(1, slope.ndim))
    size = scale + np.abs(slope).max(axis=each, initial=0.0)
    errors = []
    for step in _STEPS:
        wide, narrow = ((f(F + h * D) - f(F - h * D)) / (2 * h) for h in (step, step / 2))
        extrapolated = (4 * narrow - wide) / 3
        errors.append(np.abs(extrapolated - slope).max(axis=each, initial=0.0) / size)
    return _largest(np.minimum.reduce(errors))


def _changes(a: Floats, b: Floats, scale: float) -> float:
    return _largest(np.abs(a - b) / np.maximum(scale, np.abs(a)))


def _largest(errors: Floats) -> float:
    finite = errors[np.isfinite(errors)]
    return float(finite.max()) if finite.size else float("nan")
