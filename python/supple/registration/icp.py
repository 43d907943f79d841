"""Point-to-plane steps of a scan on the skin: the whole front first, then the still skin."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product

import numpy as np
from numpy.typing import NDArray

from supple.registration.still_skin import Body, Chest, Mask

Array = NDArray[np.float64]
Pose = tuple[Array, Array]


@dataclass(frozen=True)
class AlignSettings:
    """Lengths in m."""

    voxel: float = 5e-3  #: the scan is thinned to one point a voxel
    patch: float = 20e-3  #: residuals closer than this are one observation
    noise: float = 1e-3  #: least sd of a patch's mean residual
    prior: float = 8e-3  #: sd of the coarse pose, as movement at the edge of the region
    lever: float = 0.1  #: turns a rotation (rad) into a movement
    slide_limit: float = 5e-3  #: largest sd of the weakest motion that is still trusted
    rms_limit: float = 6e-3  #: largest weighted rms residual that is still trusted
    overlap_limit: float = 0.3  #: least share of the region that the scan must cover
    patches_limit: int = 12  #: least number of observed patches


@dataclass(frozen=True)
class Fit:
    """A pose, and how well the still skin determines it."""

    pose: Pose
    information: Array  # (6, 6) of (ω·lever, shift), 1/m²
    rms: float
    inliers: Mask
    overlap: float
    patches: int
    score: float  # mean distance of the calm scan to the skin, capped at 10 mm, m


class Search:
    """The scan, the skin and its tree; keeps the count of iterations."""

    def __init__(
        self, scan: Array, body: Body, still: Mask, chest: Chest | None, settings: AlignSettings
    ) -> None:
        self.scan, self.body, self.still, self.settings = scan, body, still, settings
        self.chest = chest
        self.centre = body.points[still].mean(axis=0)
        self.reach = max(2.0 * body.spacing, settings.voxel)
        self.smooth = _smooth_normals(body.points, body.normals, still)
        self.iterations = 0

    def coarse(self, start: Pose | None) -> list[Pose]:
        """Poses of the whole front, best first; at most three, 10 mm or more apart."""
        few = self.scan[:: max(1, len(self.scan) // 400)]
        starts = [start] if start is not None else self._starts()
        cuts = [60e-3, 40e-3, 25e-3, 15e-3]
        found = sorted(
            (self._descend(few, pose, cuts) for pose in starts), key=lambda item: item[0]
        )
        kept: list[Pose] = []
        for _, pose in found:
            if all(self.apart(pose, other) > 10e-3 for other in kept):
                kept.append(pose)
        return [self._descend(self.scan, pose, [15e-3, 10e-3], calm=True)[1] for pose in kept[:3]]

    def _starts(self) -> list[Pose]:
        """Centroids together, turned by small rotations, shifted along the body."""
        middle, front = self.scan.mean(axis=0), self.body.points[self.body.front].mean(axis=0)
        turns = [np.zeros(3)] + [np.array(v) * np.radians(13) for v in product((-1, 1), repeat=3)]
        turns += [sign * np.radians(25) * axis for axis in np.eye(3) for sign in (-1, 1)]
        poses = []
        for turn, dz in product(turns, (-0.06, 0.0, 0.06)):
            rotation = _rotation(turn)
            poses.append((rotation, front + np.array([0.0, 0.0, dz]) - rotation @ middle))
        return poses

    def _descend(
        self, points: Array, pose: Pose, cuts: list[float], calm: bool = False
    ) -> tuple[float, Pose]:
        """Shrink the cut-off; return the capped mean distance (m) and the pose."""
        allowed = np.ones(len(points), dtype=bool)
        for step, cut in enumerate(np.repeat(cuts, 5)):
            if calm and step % 5 == 0:
                allowed = self._calm(pose)
            rows, residual, matched = self._rows(points, pose, cut)
            matched &= allowed
            weight = _tukey(residual, cut) * matched
            matrix = (rows * weight[:, None]).T @ rows + 1e-3 * max(weight.sum(), 1e-9) * np.eye(6)
            pose = self._move(pose, np.linalg.solve(matrix, rows.T @ (weight * residual)))
            self.iterations += 1
        _, residual, matched = self._rows(points, pose, 20e-3)
        distance = np.where(matched, np.minimum(np.abs(residual), 20e-3), 20e-3)
        return float(distance.mean()), pose

    def fine(self, coarse: Pose) -> Fit:
        """Still skin only, Tukey at the noise, with a prior around the coarse pose."""
        keep = self.settings
        pose, prior = coarse, 1.0 / keep.prior**2
        for step in range(80):
            if step < 20 and step % 4 == 0:
                calm = self._calm(pose)
            rows, residual, used = self._rows(self.scan, pose, 25e-3, self.still)
            used &= calm
            sigma = _scale(residual[used], 0.5e-3)
            weight = _tukey(residual, max(4.685 * sigma, 25e-3 * 0.8**step)) * used
            data, _ = self._information(_place(self.scan, pose), rows, residual, weight)
            gain = float(np.trace(data) / max(np.einsum("n,nd,nd", weight, rows, rows), 1e-9))
            matrix = gain * (rows * weight[:, None]).T @ rows + prior * np.eye(6)
            push = gain * rows.T @ (weight * residual) - prior * self._difference(coarse, pose)
            motion = np.asarray(np.linalg.solve(matrix, push), dtype=np.float64)
            pose = self._move(pose, motion)
            self.iterations += 1
            if step > 15 and np.abs(motion).max() < 1e-6:
                break
        return self._fit(pose, calm)

    def _calm(self, pose: Pose) -> Mask:
        """Scan points that are not on a bulge of the scan itself."""
        if self.chest is None:
            return np.ones(len(self.scan), dtype=bool)
        smooth = thin(self.scan, 3 * self.settings.voxel)  # noise is no bulge
        return ~self.chest.bulges(_place(self.scan, pose), _place(smooth, pose))

    def _fit(self, pose: Pose, calm: Mask) -> Fit:
        keep = self.settings
        _, residual, used = self._rows(self.scan, pose, 25e-3, self.still)
        used &= calm
        weight = _tukey(residual, 4.685 * _scale(residual[used], 0.5e-3)) * used
        rms = float(np.sqrt(weight @ residual**2 / max(float(weight.sum()), 1e-12)))
        inliers = weight > 0.1
        placed = _place(self.scan, pose)
        seen = _cells(placed[inliers], keep.patch)
        region = _cells(self.body.points[self.still], keep.patch)
        shape, _, _ = self._rows(self.scan, pose, 25e-3, normals=self.smooth)
        information, patches = self._information(placed, shape, residual, weight)
        everywhere = self._rows(self.scan, pose, np.inf)
        distance = np.where(everywhere[2], np.minimum(np.abs(everywhere[1]), 10e-3), 10e-3)
        overlap = len(seen & region) / len(region)
        return Fit(pose, information, rms, inliers, overlap, patches, float(distance[calm].mean()))

    def _rows(
        self,
        points: Array,
        pose: Pose,
        limit: float,
        allowed: Mask | None = None,
        normals: Array | None = None,
    ) -> tuple[Array, Array, Mask]:
        """Point-to-plane rows (n, 6), residuals (n,) m, and which points found their partner."""
        placed = _place(points, pose)
        _, nearest = self.body.tree.query(placed)
        normal = (self.body.normals if normals is None else normals)[nearest]
        gap = self.body.points[nearest] - placed
        residual = np.einsum("nd,nd->n", normal, gap)
        aside = np.linalg.norm(gap - residual[:, None] * normal, axis=1)
        matched = (aside < self.reach + 0.3 * np.abs(residual)) & (np.abs(residual) < limit)
        if allowed is not None:
            matched &= allowed[nearest]
        turn = np.cross(placed - self.centre, normal) / self.settings.lever
        return np.hstack([turn, normal]), residual, matched

    def _information(
        self, placed: Array, rows: Array, residual: Array, weight: Array
    ) -> tuple[Array, int]:
        """What the patches of skin say of the six motions (6, 6), 1/m², and how many there are.

        A patch is one observation, because neighbours err together; its sd is what the patch
        means show.
        """
        use = weight > 0.05
        if use.sum() < 6:
            return np.zeros((6, 6)), 0
        foot = placed[use] + residual[use, None] * rows[use, 3:]
        key = np.floor(foot / self.settings.patch).astype(np.int64)
        patch = np.unique(key, axis=0, return_inverse=True)[1].ravel()
        total = np.bincount(patch, weight[use])
        columns = np.column_stack([rows[use], residual[use]])
        mean: Array = np.stack([np.bincount(patch, weight[use] * c) for c in columns.T], 1)
        share = np.minimum(total / (0.5 * np.median(total)), 1.0)
        mean = mean * (np.sqrt(share) / total)[:, None]
        free = max(float(share.sum()) - 6.0, 1.0)
        variance = max(float(mean[:, 6] @ mean[:, 6]) / free, self.settings.noise**2)
        return mean[:, :6].T @ mean[:, :6] / variance, len(total)

    def _move(self, pose: Pose, motion: Array) -> Pose:
        turn = _rotation(motion[:3] / self.settings.lever)
        return turn @ pose[0], turn @ (pose[1] - self.centre) + self.centre + motion[3:]

    def _difference(self, a: Pose, b: Pose) -> Array:
        """The motion (ω·lever, shift at the centre) that leads from pose a to pose b."""
        from scipy.spatial.transform import Rotation

        turn = b[0] @ a[0].T
        vector = Rotation.from_matrix(turn).as_rotvec()
        at = a[0].T @ (self.centre - a[1])
        shift = b[0] @ at + b[1] - self.centre
        return np.concatenate([vector * self.settings.lever, shift])

    def apart(self, a: Pose, b: Pose) -> float:
        """Movement (m) between two poses, at the centre and at the lever."""
        return float(np.linalg.norm(self._difference(a, b)))


def thin(points: Array, voxel: float) -> Array:
    """The mean point of each voxel that holds any."""
    _, at = np.unique(np.floor(points / voxel).astype(np.int64), axis=0, return_inverse=True)
    at = at.ravel()
    count = np.bincount(at)
    return np.stack([np.bincount(at, column) / count for column in points.T], axis=1)


def _smooth_normals(points: Array, normals: Array, still: Mask) -> Array:
    """Normals (v, 3) of the still skin as low polynomials of place.

    What they leave undetermined, only the roughness of the mesh determines: that is not shape.
    """
    p = (points - points[still].mean(axis=0)) / 0.1
    x, y, z = p.T
    basis = np.column_stack(
        [np.ones(len(p)), p, p**2, x * y, y * z, z * x, x**3, z**3, x**2 * z, x * z**2]
    )
    fit = np.linalg.lstsq(basis[still], normals[still], rcond=None)[0]
    smooth = normals.copy()
    smooth[still] = basis[still] @ fit
    return np.asarray(smooth / np.maximum(np.linalg.norm(smooth, axis=1, keepdims=True), 1e-9))


def _cells(points: Array, size: float) -> set[tuple[int, ...]]:
    """The cubes of edge ``size`` that hold a point."""
    return set(map(tuple, np.floor(points / size).astype(np.int64).tolist()))


def _place(points: Array, pose: Pose) -> Array:
    return points @ pose[0].T + pose[1]


def _rotation(vector: Array) -> Array:
    from scipy.spatial.transform import Rotation

    return np.asarray(Rotation.from_rotvec(vector).as_matrix())


def _tukey(residual: Array, cut: float) -> Array:
    """Tukey's biweight: 1 at zero, 0 from ``cut`` on."""
    inside = np.clip(1.0 - (residual / cut) ** 2, 0.0, None)
    return np.asarray(inside**2)


def _scale(residual: Array, least: float) -> float:
    """Robust sd by the median absolute value, not below ``least``."""
    return max(1.4826 * float(np.median(np.abs(residual))), least) if len(residual) else least
