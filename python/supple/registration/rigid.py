"""Rigid alignment of a partial surface scan with the skin that does not move between two poses.

A strip of skin over the sternum is nearly flat: alone it can slide. So the whole front is aligned
first, robustly and from many starts; then only the still skin (no bulges) decides, and what it
cannot see keeps the coarse value within a prior. The answer says how far it may still slide.

1. thin the scan                      one point a voxel, so that density is no weight
2. starts                             centroids, small rotations, shifts along the body
3. coarse point-to-plane, all skin    Tukey weights, cut-off shrinking from 60 to 15 mm
4. fine point-to-plane, still skin    Tukey weights at the noise, prior around the coarse pose
5. judge                              overlap, conditioning, rival poses
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from supple.errors import InputError
from supple.registration.icp import AlignSettings, Array, Fit, Pose, Search, thin
from supple.registration.still_skin import Body, Mask, still_skin

MOTIONS = (
    "turn about the right-left axis",
    "turn about the front-back axis",
    "turn about the head-feet axis",
    "shift right-left",
    "shift front-back",
    "shift head-feet",
)


@dataclass(frozen=True)
class Alignment:
    """Where the scan lies: model point ≈ R @ scan point + t."""

    R: Array  #: (3, 3) rotation
    t: Array  #: (3,) shift, m
    rms_mm: float  #: weighted rms distance of the used scan points to the still skin
    inliers: int  #: thinned scan points that were used
    iterations: int
    trustworthy: bool
    warnings: list[str]  #: why not trustworthy, one sentence each
    slide_mm: float  #: sd of the worst-observed motion, as movement at 0.1 m

    def apply(self, points: ArrayLike) -> Array:
        """(n, 3) scan points, m, in the model's frame."""
        return np.asarray(points, dtype=float) @ self.R.T + self.t


def fit_rigid(source: ArrayLike, target: ArrayLike) -> Pose:
    """Rotation and shift that best carry ``source`` onto ``target`` in least squares.

    Args:
        source: (n, 3) points, m; row i is the partner of row i of ``target``.
        target: (n, 3) points, m; n >= 3, not on one line.

    Returns:
        R (3, 3) with det R = +1 and t (3,) m, so that target ≈ source @ R.T + t.

    Raises:
        InputError: the arrays are not both (n, 3), or their points lie on one line, so R is not
            unique.

    Source: Umeyama (1991), IEEE TPAMI 13(4), scale = 1.
    """
    a, b = _points(source, "source"), _points(target, "target")
    if a.shape != b.shape:
        raise InputError(f"target must have the shape of source {a.shape}, got {b.shape}.")
    a0, b0 = a.mean(axis=0), b.mean(axis=0)
    u, s, vt = np.linalg.svd((b - b0).T @ (a - a0))
    if s[1] <= 1e-12 * max(s[0], np.finfo(float).tiny):
        raise InputError(
            "source and target must not lie on one line, got points that do; "
            "add a partner point off the line."
        )
    sign = np.array([1.0, 1.0, np.sign(np.linalg.det(u @ vt))])
    rotation = (u * sign) @ vt
    return rotation, b0 - rotation @ a0


def align(
    scan_points: ArrayLike,
    target_points: ArrayLike,
    target_triangles: ArrayLike,
    *,
    region: ArrayLike | None = None,
    start: Pose | None = None,
    settings: AlignSettings | None = None,
) -> Alignment:
    """Align a supine surface scan with the torso skin of the model.

    Args:
        scan_points: (n, 3) m; any part of the front of the torso, roughly LPS (within about 30°).
        target_points: (v, 3) m, LPS; skin of the torso, breasts included.
        target_triangles: (t, 3) rows of ``target_points``, all outward or all inward.
        region: (v,) mask of the skin that does not move; automatic by default (the strip
            between the breasts and the skin above them).
        start: (R, t) to start from in place of the many starts.
        settings: tolerances; ``AlignSettings()`` by default.

    Returns:
        The pose. Read ``trustworthy`` and ``warnings`` before using it: a flat or small overlap
        gives a pose that may slide.

    Raises:
        InputError: arrays of wrong shape, NaN, an empty region, or lengths that are not metres.

    Source: point-to-plane, Chen & Medioni (1992); conditioning, Gelfand et al. (2003), 3DIM.
    """
    settings = settings or AlignSettings()
    scan = thin(_metres(scan_points, "scan_points"), settings.voxel)
    body = Body.build(_metres(target_points, "target_points"), target_triangles)
    still, chest = still_skin(body)
    if region is not None:
        still = _mask(region, len(body.points))
    if not still.any():
        raise InputError("region must name skin that does not move, got none; give a larger one.")
    search = Search(scan, body, still, chest, settings)
    finals = [
        search.fine(pose) for pose in search.coarse(None if start is None else _checked_pose(start))
    ]
    best = min(finals, key=lambda fit: fit.score)
    return _judge(search, best, finals)


def _judge(search: Search, best: Fit, finals: list[Fit]) -> Alignment:
    """Say whether the pose can be trusted, and if not why."""
    keep = search.settings
    values, vectors = np.linalg.eigh(best.information)
    slide = float(1.0 / np.sqrt(max(values[0], 1e-6)))
    motion = MOTIONS[int(np.abs(vectors[:, 0]).argmax())]
    rivals = [fit for fit in finals if search.apart(fit.pose, best.pose) > 10e-3]
    rival = min((fit.score for fit in rivals), default=np.inf)
    doubts = {
        f"The scan covers {best.overlap:.0%} of the skin that stays still, "
        f"at least {keep.overlap_limit:.0%} is needed; scan the sternum and the upper chest.": (
            best.overlap < keep.overlap_limit or best.patches < keep.patches_limit
        ),
        f"The shape seen leaves a {motion} open by ±{1e3 * min(slide, 1.0):.0f} mm "
        f"(limit {1e3 * keep.slide_limit:.0f} mm); scan more of the upper chest.": (
            slide > keep.slide_limit
        ),
        f"The scan lies {1e3 * best.rms:.1f} mm rms from the still skin "
        f"(limit {1e3 * keep.rms_limit:.0f} mm); check that both are the same patient.": (
            best.rms > keep.rms_limit
        ),
        "Another pose, 10 mm or more away, fits as well; scan more of the upper chest.": (
            rival < 1.03 * best.score
        ),
    }
    warnings = [text for text, holds in doubts.items() if holds]
    count = int(best.inliers.sum())
    return Alignment(
        *best.pose, 1e3 * best.rms, count, search.iterations, not warnings, warnings, 1e3 * slide
    )


def _points(values: ArrayLike, name: str) -> Array:
    points = np.asarray(values, dtype=float)
    if points.ndim != 2 or points.shape[1] != 3 or len(points) < 3:
        raise InputError(f"{name} must be (n, 3) points in m, n >= 3, got shape {points.shape}.")
    if not np.isfinite(points).all():
        raise InputError(f"{name} must be finite, got NaN or infinity; remove those points.")
    return points


def _metres(values: ArrayLike, name: str) -> Array:
    """Points whose extent is that of a body in metres."""
    points = _points(values, name)
    size = float(np.linalg.norm(np.ptp(points, axis=0)))
    if not 0.02 < size < 5.0:
        raise InputError(
            f"{name} must be in metres and 0.02 to 5 m across, got {size:.3g}; "
            "read the file with the unit that it was written in."
        )
    return points


def _mask(region: ArrayLike, count: int) -> Mask:
    mask = np.asarray(region)
    if mask.shape != (count,) or mask.dtype != np.bool_:
        raise InputError(
            f"region must be a mask ({count},), one bool a target point, "
            f"got {mask.dtype} {mask.shape}."
        )
    return mask


def _checked_pose(start: Pose) -> Pose:
    rotation, shift = (np.asarray(part, dtype=float) for part in start)
    orthogonal = rotation.shape == (3, 3) and np.allclose(rotation @ rotation.T, np.eye(3))
    if not orthogonal or np.linalg.det(rotation) < 0 or shift.shape != (3,):
        raise InputError("start must be (R, t) with R (3, 3) a rotation and t (3,) m, got another.")
    return rotation, shift
