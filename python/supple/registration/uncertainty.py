"""How sure a fit is: the covariance of its unknowns, and what that means at each vertex.

The fit counts each patch of the scan as one observation with a standard deviation assumed
beforehand. What its residuals really were, and over what distance neighbours share them, is
measured afterwards and corrects that: `inflation`. The prior is left as it is, so that skin which
the scan lacks is as uncertain as bodies differ. A body unlike any that the template can become is
fitted by a skin that slid, which no residual tells: `slid`.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from supple.core import core
from supple.errors import InputError
from supple.registration.posture import Posture
from supple.registration.template import Floats, OnSurface, Template

if TYPE_CHECKING:
    from supple.registration.rig import RigFit

#: Residuals are compared over distances up to this, m, in rings as wide as that.
_FAR, _RING = 0.12, 0.01
#: Points whose residuals are compared, with so many others.
_ANCHORS, _OTHERS = 200, 4000
#: How far skin leaves what bones and shapes can do, in the scan's noise: below the first the body
#: is like the template's, above the second not; and what variances are multiplied by there. So
#: that bands hold 19 of 20 points on fits to bodies of the same and of another template (shapes
#: 1000 to 1009 and 1020 to 1029, all poses). Random bodies differ less than the prior has it.
_LIKE, _UNLIKE, _SURE, _SLIDES = 0.22, 0.36, 0.75, 9.0
#: Robust weight below which a point was left out.
_USED = 0.05


@dataclass(frozen=True, eq=False, repr=False)
class Bands:
    """How far points may be from where the fit puts them.

    Attributes:
        covariances: (n, 3, 3) m² of each point.
        sd: (n,) m, root mean square over the three axes.
        radius95: (n,) m, of the ball about each point that holds it in 95 of 100 cases.
    """

    covariances: Floats
    sd: Floats
    radius95: Floats


def of_fit(found: RigFit, template: Template, patch: float = 15e-3) -> Floats:
    """Covariance (9K+A, 9K+A) of the unknowns of a fit, with its own residuals as the noise."""
    used = found.used > _USED
    corners = found.points[template.triangles[found.triangle[used]]]
    landing = np.einsum("kc,kcd->kd", found.barycentric[used], corners)
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normal /= np.linalg.norm(normal, axis=1, keepdims=True) + 1e-300
    points = found.scan_points[used]
    residuals = np.einsum("kd,kd->k", points - landing, normal)
    inverse = _inverse(found.data_matrix, found.prior_matrix)
    spent = len(inverse) - float((inverse * found.prior_matrix).sum())  # tr(H⁻¹ D)
    free = 1 - spent / max(found.observations, 1.0)
    noise = inflation(points, residuals, patch, found.noise, free)
    return np.asarray(core().inflated(inverse, found.prior_matrix, noise))


def slid(left: float) -> float:
    """What the covariance of a fit is to be multiplied by, as its skin may have slid.

    Args:
        left: how far skin leaves what bones and shapes can do, in the scan's noise (`unlike`).
    """
    return float(np.interp(left, (_LIKE, _UNLIKE), (_SURE, _SLIDES)))


def covariance(data_matrix: Floats, prior_matrix: Floats, inflation: float = 1.0) -> Floats:
    """Of the unknowns (p, p) that minimise the energy: H⁻¹ (f D + P) H⁻¹ with H = D + P.

    The fit weighed data D against prior P by an assumed variance of the data; that it was f times
    as large does not change where the minimum is, but how far that is from the truth. With f = 1
    this is H⁻¹.

    Args:
        data_matrix: D (p, p), in units of the assumed variance.
        prior_matrix: P (p, p) of all other terms.
        inflation: f.

    Raises:
        InputError: the matrices differ in size, or neither data nor prior bounds an unknown.

    Source: White (1982), Econometrica 50(1), theorem 3.2, the prior counted as data.
    """
    if data_matrix.shape != prior_matrix.shape:
        raise InputError(
            f"data_matrix and prior_matrix must be of one size, got {data_matrix.shape} and "
            f"{prior_matrix.shape}."
        )
    inverse = _inverse(data_matrix, prior_matrix)
    return np.asarray(core().inflated(inverse, prior_matrix, inflation))


def _inverse(data_matrix: Floats, prior_matrix: Floats) -> Floats:
    inverse: Floats = core().inverse_sum(data_matrix, prior_matrix)
    if not len(inverse):
        raise InputError("the data and the prior leave an unknown free; give the posture a prior.")
    return inverse


def inflation(points: Floats, residuals: Floats, patch: float, assumed: float,
              share_free: float = 1.0) -> float:  # fmt: skip
    """What a patch's variance is, in units of the assumed one.

    A smooth movement of the skin is known from an area A to S / A, where S = ∫ C(|d|) dd² and C is
    the covariance of residuals at a distance. The fit took it to be assumed² patch² / A.

    Args:
        points: (c, 3) m where the scan was used.
        residuals: (c,) m signed distances from the registered skin there.
        patch: m, side of a patch, one observation.
        assumed: m, standard deviation that the fit gave to it.
        share_free: of the observations that the unknowns leave free, by which residuals of a fit
            are too small: 1 − tr(H⁻¹ H_data) / observations.

    Source: Vanmarcke (1983), Random Fields, ch. 5, scale of fluctuation, here in the plane.
    """
    if len(points) < 10:
        return 1.0
    found = correlated(points, residuals)
    whole = float(found.areas @ found.covariance) + found.own_area * found.variance
    return max(whole, 1e-12) / (patch**2 * assumed**2) / max(share_free, 0.05)


@dataclass(frozen=True)
class Correlogram:
    """Covariance of residuals by distance: (k,) m, (k,) m², area of each ring (k,) m²."""

    distance: Floats
    covariance: Floats
    areas: Floats
    variance: float
    own_area: float  #: m² that a point stands for


def correlated(points: Floats, residuals: Floats) -> Correlogram:
    """Up to the first ring in which residuals no longer agree, at most 12 cm."""
    every = -(-len(points) // _OTHERS)
    points, residuals = points[::every], residuals[::every]
    anchors = np.unique(np.linspace(0, len(points) - 1, _ANCHORS).astype(np.int64))
    rings = round(_FAR / _RING)
    near = core().residual_rings(points, residuals, anchors.astype(np.int32), _RING, rings)
    count = near.count
    mean: Floats = near.sum / np.maximum(count, 1)
    edges = _RING * np.arange(rings + 1)
    areas: Floats = np.pi * np.diff(edges**2)
    per_area = count[1:6].sum() / len(anchors) / areas[1:6].sum()  # points a m² of skin
    own = 1 / max(every * per_area, 1.0)
    areas[0] = max(areas[0] - own, 0.0)
    until = int(np.argmax(np.append(mean, -1.0) <= 0))
    middles: Floats = _RING * (0.5 + np.arange(until, dtype=np.float64))
    return Correlogram(middles, mean[:until], areas[:until],
                       float(np.mean(residuals**2)), own)  # fmt: skip


def vertex_uncertainty(template: Template, posture: Posture, covariance: Floats) -> Bands:
    """Bands of the vertices (n,), to first order in the unknowns' ``covariance`` (9K+A, 9K+A)."""
    return _bands(jacobian(template, posture), covariance)


def uncertainty_at(
    template: Template, posture: Posture, covariance: Floats, part: OnSurface
) -> Bands:
    """Bands of points on the skin: landmarks, curves."""
    corners = template.triangles[part.triangle]
    rows = jacobian(template, posture, np.unique(corners))
    place = np.searchsorted(np.unique(corners), corners)
    return _bands(np.einsum("kc,kcdp->kdp", part.barycentric, rows[place]), covariance)


def jacobian(
    template: Template, posture: Posture, of: npt.NDArray[np.int64] | None = None
) -> Floats:
    """Derivative (n, 3, 9K+A) of vertices by the unknowns of `Posture.stepped`, eqs. 23–25."""
    rows = np.arange(len(template.points)) if of is None else of
    weights, shapes = template.weights[rows], template.blendshapes[:, rows]
    shape = template.points[rows] + np.tensordot(posture.blend, shapes, axes=1)
    affine = posture.rotations * posture.scales[:, None, :]
    local = shape[:, None] - template.joints
    moved = np.einsum("kij,nkj->nki", affine, local)
    by_bone = np.zeros((len(rows), 3, len(template.bones), 9))
    for axis in range(3):
        unit = np.eye(3)[axis]
        by_bone[..., axis] = np.swapaxes(np.cross(unit, moved) * weights[..., None], 1, 2)
        by_bone[:, axis, :, 3 + axis] = weights
        turned = posture.rotations[:, :, axis]
        by_bone[..., 6 + axis] = np.einsum("ki,nk,nk->nik", turned, local[..., axis], weights)
    of_vertices = np.tensordot(weights, affine, axes=1)
    by_shape = np.einsum("nij,anj->nia", of_vertices, shapes, optimize=True)
    return np.concatenate([by_bone.reshape(len(rows), 3, -1), by_shape], axis=2)


def _bands(rows: Floats, covariance: Floats) -> Bands:
    """Bands of points whose derivatives are ``rows`` (n, 3, p)."""
    spread = (rows.reshape(-1, rows.shape[2]) @ covariance).reshape(rows.shape)
    matrices = np.matmul(spread, np.swapaxes(rows, 1, 2))
    variances = np.maximum(np.linalg.eigvalsh(matrices), 0.0)
    return Bands(matrices, np.sqrt(variances.mean(axis=1)), radius(variances, 0.95))


def radius(variances: Floats, share: float) -> Floats:
    """Radius (n,) of the ball that holds a normal point of ``variances`` (n, 3) in ``share``.

    Σ λ_i z_i² is taken as a multiple of χ² with the same mean and variance: within 2 % at 95 %.
    Source: Satterthwaite (1946), Biometrics Bulletin 2(6).
    """
    from scipy.special import gammaincinv

    total, squares = variances.sum(axis=1), (variances**2).sum(axis=1)
    freedom = np.divide(total**2, squares, out=np.full_like(total, 3.0), where=squares > 0)
    return np.asarray(np.sqrt(2 * gammaincinv(freedom / 2, share) * total / freedom))
