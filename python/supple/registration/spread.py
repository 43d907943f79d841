"""Standard deviations of what follows from a fit: from its posture, and from its offset."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import numpy.typing as npt

from supple.errors import InputError
from supple.registration.posture import Posture
from supple.registration.skin import vertex_normals
from supple.registration.template import Template

Floats = npt.NDArray[np.float64]
Ints = npt.NDArray[np.int64]

#: Postures at a time: their vertices stay in the cache.
_BATCH = 32
#: Offsets drawn.
_DRAWN = 256
#: An axis with less than this share of the largest variance is left out: rounding.
_RANK = 1e-12


def deviations(
    ask: Callable[[Floats, Floats], Floats], template: Template, posture: Posture,
    covariance: Floats,
) -> Floats:  # fmt: skip
    """Standard deviations (k,) of ``ask(vertices (s, n, 3), rotations (s, K, 3, 3))`` (s, k).

    Central differences along the axes of the covariance, a step of one sd each way; exact where
    ``ask`` is quadratic in the posture.

    Args:
        covariance: (9 K + A, 9 K + A) in the order of ``Posture.stepped``.

    Raises:
        InputError: another shape, NaN, or a negative variance.
    """
    steps = axes(covariance, 9 * len(template.bones) + len(template.blendshapes))
    variance: Floats | float = 0.0
    for first in range(0, len(steps), _BATCH):
        part = steps[first : first + _BATCH]
        there, back = (ask(*posed_many(template, [posture.stepped(s * step) for step in part]))
                       for s in (1, -1))  # fmt: skip
        variance = variance + (((there - back) / 2) ** 2).sum(axis=0)
    return np.sqrt(variance)


def offset_deviations(
    ask: Callable[[Floats], Floats], points: Floats, triangles: Ints, precision: Any, seed: int = 0
) -> Floats:
    """Standard deviations (k,) of ``ask(vertices (s, n, 3))`` (s, k) by offsets along the normals.

    From ``_DRAWN`` offsets drawn at random, so within 5 % or so.

    Args:
        precision: (n, n) sparse, 1/m², symmetric, positive definite.
        seed: of the draws.

    Raises:
        InputError: the precision is not positive definite.
    """
    try:
        root = np.linalg.cholesky(precision.toarray())
    except np.linalg.LinAlgError:
        raise InputError(
            "offset_precision must be positive definite; give the fit's own."
        ) from None
    from scipy.linalg import solve_triangular

    drawn = np.random.default_rng(seed).normal(size=(len(points), _DRAWN))
    along = solve_triangular(root, drawn, lower=True, trans="T").T
    normals = vertex_normals(points, triangles)
    variance: Floats | float = 0.0
    for first in range(0, _DRAWN, _BATCH):
        off = along[first : first + _BATCH, :, None] * normals
        variance = variance + (((ask(points + off) - ask(points - off)) / 2) ** 2).sum(axis=0)
    return np.sqrt(variance / _DRAWN)


def axes(covariance: Floats, unknowns: int) -> Floats:
    """Steps (r, unknowns) whose outer products sum to the covariance: its axes, one sd long."""
    if covariance.shape != (unknowns, unknowns) or not np.isfinite(covariance).all():
        raise InputError(
            f"covariance must be finite ({unknowns}, {unknowns}), got {covariance.shape}; give "
            "that of the registration."
        )
    unit = np.sqrt(np.abs(np.diag(covariance)))  # rad, m and shares: compared by their own sd
    safe = np.where(unit > 0, unit, 1.0)
    value, vector = np.linalg.eigh(covariance / np.outer(safe, safe))
    if value.min(initial=0.0) < -1e-6 * value.max(initial=1.0):
        raise InputError("covariance must have no negative variance; give the registration's own.")
    kept = value > _RANK * value.max(initial=0.0)
    return np.asarray((safe[:, None] * vector[:, kept] * np.sqrt(value[kept])).T)


def posed_many(template: Template, postures: list[Posture]) -> tuple[Floats, Floats]:
    """Vertices (s, n, 3) m of postures, each as ``posed`` has it, and rotations (s, K, 3, 3)."""
    n = len(template.points)
    blend = np.array([p.blend for p in postures])
    flat = template.blendshapes.reshape(len(template.blendshapes), 3 * n)
    shape = template.points + (blend @ flat).reshape(-1, n, 3)
    rotations = np.array([p.rotations for p in postures])
    affine = rotations * np.array([p.scales for p in postures])[:, :, None, :]
    offsets = template.joints + np.array([p.translations for p in postures])
    offsets = offsets - np.einsum("skij,kj->ski", affine, template.joints)
    vertices = np.zeros_like(shape)
    for k, weight in enumerate(template.weights.T):
        moved = np.flatnonzero(weight)
        there = shape[:, moved] @ affine[:, k].transpose(0, 2, 1) + offsets[:, k, None]
        vertices[:, moved] += weight[moved, None] * there
    return vertices, rotations
