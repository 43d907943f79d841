"""What bones and blendshapes cannot reach: a smooth displacement of the skin along its normals.

h (n,) m minimises Σ w (n·(x + h n − p))² + hᵀ Q h. Q is the precision of a smooth random field on
the skin with a standard deviation and a length of correlation, so where no scan is, h returns to 0
and its uncertainty to the prior's.

Source: Lindgren, Rue, Lindström (2011), J. R. Statist. Soc. B 73, eqs. 2–10 (Matérn, ν = 1).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from supple.registration.rig import Rig, RigFit
from supple.registration.template import Floats, Ints


@dataclass(frozen=True)
class OffsetSettings:
    """Lengths in m."""

    length: float = 0.08  #: over which the displacement is correlated (to about 0.14)
    least: float = 3e-4  #: its standard deviation, at least
    most: float = 6e-3  #: and at most; between them, what the fit leaves on patches of skin
    noise: float = 1.5e-3  #: of a patch
    patch: float = 15e-3  #: its side
    rounds: int = 2  #: of new partners
    reach: float = 25e-3  #: partners further away are none


@dataclass(frozen=True, eq=False)
class Offset:
    """Displacement (n, 3) m, its precision (n, n) sparse, 1/m², and its prior sd, m."""

    vectors: Floats
    precision: Any
    prior: float


def offset(rig: Rig, fit: RigFit, settings: OffsetSettings) -> Offset:
    """The displacement that brings the fitted skin to the scan that ``rig`` holds."""
    prior = float(np.clip(fit.patch_sd, settings.least, settings.most))
    seen = float((fit.vertex_used > 0).mean()) / max(int((fit.used > 0.1).sum()), 1)
    found = rig.offset(fit.points, prior=prior, length=settings.length,
                       per_area=seen / (settings.patch * settings.noise) ** 2,
                       reach=settings.reach, rounds=settings.rounds)  # fmt: skip
    return Offset(found.height[:, None] * found.along, _sparse(found), prior)


def _sparse(found: Any) -> Any:
    from scipy.sparse import csc_array

    n = len(found.height)
    return csc_array((found.values, found.row, found.start), (n, n))


def matern(points: Floats, triangles: Ints, sd: float, length: float) -> Any:
    """Precision (n, n), 1/m², of a field on a surface of ``sd`` m, correlated over ``length`` m.

    Q = τ² (κ² M + G) M⁻¹ (κ² M + G), M the lumped mass, G the stiffness, κ = √8 / length,
    τ² = 1 / (4π κ² sd²).
    """
    from scipy.sparse import csr_array, dia_array

    n, kappa = len(points), np.sqrt(8.0) / length
    corner = points[triangles]
    edge = corner[:, [2, 0, 1]] - corner[:, [1, 2, 0]]  # opposite to each corner
    twice = np.linalg.norm(np.cross(edge[:, 0], edge[:, 1]), axis=1)
    dots = np.einsum("tid,tjd->tij", edge, edge) / (2 * np.maximum(twice, 1e-12))[:, None, None]
    rows, columns = np.repeat(triangles, 3, axis=1).ravel(), np.tile(triangles, (1, 3)).ravel()
    G = csr_array((dots.ravel(), (rows, columns)), (n, n))
    mass = np.bincount(triangles.ravel(), np.repeat(twice / 6, 3), n)
    mass = np.maximum(mass, 1e-3 * mass.mean())
    M, inverse = (dia_array((m[None], [0]), (n, n)) for m in (mass, 1 / mass))
    K = (kappa**2 * M + G).tocsr()
    return K @ inverse @ K / (4 * np.pi * kappa**2 * sd**2)
