"""The feature that a scan shows near where a landmark is known to be, as after a fit."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import numpy.typing as npt

from supple.registration.auto_landmarks import Proposal
from supple.surface import Surface

Floats = npt.NDArray[np.float64]

#: m: how far a landmark may be from its guess, what is looked at around it, and the width of a
#: nipple's tip.
_REACH, _AROUND, _TIP = 0.018, 0.035, 4e-3
#: A tip stands out at least this far, m, and this many times its standard error.
_LEAST, _TIMES = 1.0e-3, 6.0
#: The confidence of a landmark that shows nothing of its own, at most.
ON_SKIN = 0.5


def refine(scan: Surface, guesses: Mapping[str, npt.ArrayLike]) -> dict[str, Proposal]:
    """Move landmarks to what shows on the scan near them.

    A nipple goes to the tip that stands out of the breast's round, if one does; each other
    landmark, and a nipple that shows no tip, to the skin next to its guess, with a confidence of
    at most 0.5. What has no skin within 20 mm is missing.

    Args:
        scan: a surface or a cloud, m.
        guesses: name → (3,) m, in the scan's frame.
    """
    from scipy.spatial import cKDTree

    found = {}
    points = scan.points
    for name, guess in guesses.items():
        centre = np.asarray(guess, dtype=np.float64)
        near = _box(points, centre)
        if len(near) < 30:
            continue
        distance = float(cKDTree(near).query(centre)[0])
        if distance > 0.02:
            continue
        tip = _tip(near, centre) if name.startswith("nipple") else None
        found[name] = tip or _on_skin(near, centre, distance)
    return found


def _box(points: Floats, centre: Floats) -> Floats:
    """Points of ``points`` (n, 3) m that are around ``centre`` (3,) m, axis by axis: it is fast."""
    for axis in range(3):
        points = points[np.abs(points[:, axis] - centre[axis]) < _AROUND]
    return points


def _on_skin(near: Floats, guess: Floats, distance: float) -> Proposal:
    """The foot of the guess on a plane through the skin around it."""
    size = np.linalg.norm(near - guess, axis=1)
    close = near[size <= max(0.008, float(np.partition(size, min(11, len(size) - 1))[11]))]
    middle = close.mean(axis=0)
    normal = np.linalg.svd(close - middle)[2][2]
    point = guess - ((guess - middle) @ normal) * normal
    return Proposal(point, ON_SKIN * float(np.exp(-distance / 0.008)), "the skin next to the guess")


def _tip(near: Floats, guess: Floats) -> Proposal | None:
    """The place that stands out most of a quadratic through the breast, if it surely does."""
    middle = near.mean(axis=0)
    axes = np.linalg.svd(near - middle, full_matrices=False)[2]
    u, v, high = axes @ (near - guess).T
    inside = u**2 + v**2 < _AROUND**2
    u, v, high = u[inside], v[inside], high[inside]
    basis = np.stack([np.ones_like(u), u, v, u * u, u * v, v * v], axis=1)
    ring = u**2 + v**2 > (_REACH / 2) ** 2
    if ring.sum() < 60:
        return None
    fit = np.linalg.lstsq(basis[ring], high[ring], rcond=None)[0]
    if fit[3] + fit[5] > 0:  # seen from inside: turn, so that the breast is a dome
        high, fit, axes = -high, -fit, axes * np.array([[1.0], [1.0], [-1.0]])
    rest = high - basis @ fit
    noise = 1.4826 * float(np.median(np.abs(rest[ring])))
    grid = np.arange(-_REACH, _REACH + 1e-9, 1.5e-3)
    a, b = (g.ravel() for g in np.meshgrid(grid, grid))
    across, up = (np.exp(-((x - grid[:, None]) ** 2) / (2 * _TIP**2)) for x in (u, v))
    total = (up @ across.T).ravel()  # of a Gaussian about each place, the product of two
    mean = (up @ (across * rest).T).ravel() / np.maximum(total, 1e-9)
    error = noise * np.sqrt((up**2 @ (across**2).T).ravel()) / np.maximum(total, 1e-9)
    k = int(np.argmax(np.where(total > 5, mean, -np.inf)))
    times = float(mean[k] / max(error[k], 1e-5))
    if mean[k] < _LEAST or times < _TIMES or np.hypot(a[k], b[k]) > _REACH:
        return None
    at = np.array([1.0, a[k], b[k], a[k] ** 2, a[k] * b[k], b[k] ** 2])
    point = guess + np.array([a[k], b[k], float(at @ fit + mean[k])]) @ axes
    return Proposal(point, 1 - float(np.exp(-times / 6)), "tip that stands out of the breast")
