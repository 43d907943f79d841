"""The tumour of the synthetic patient, and where it must lie to move far enough."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from supple.breast.phantom_anatomy import Anatomy, Array
from supple.breast.phantom_mesh import Box
from supple.breast.phantom_patient import Patient
from supple.breast.phantom_skin import Skin, sample_skin

#: The tumour moves at least so far, m, from prone to supine after the best rigid alignment.
LEAST_MOTION = 20e-3
#: Kept in hand while the tumour's own stiffness is not yet in the solution, m.
_MARGIN = 1.5e-3
#: Least thickness of healthy tissue between tumour and skin, m.
_COVER = 5e-3


@dataclass(frozen=True)
class Tumour:
    """A ball at rest.

    Attributes:
        zeta: (3,) material coordinates of its centre.
        centre: (3,) m, the same at rest.
        radius: m, at rest.
    """

    zeta: Array
    centre: Array
    radius: float

    def depth(self, anatomy: Anatomy, zeta: Array) -> Array:
        """How deep, m at rest, material points (n, 3) lie inside; -radius far away."""
        depth = np.full(len(zeta), -self.radius)
        reach = 4.0 * self.radius
        aside = np.abs(zeta[:, 0] - self.zeta[0]) * anatomy.dome(self.zeta[0]).metre
        near = (aside < reach) & (np.abs(zeta[:, 1] - self.zeta[1]) < reach)
        distance = np.linalg.norm(anatomy.rest(zeta[near]) - self.centre, axis=1)
        depth[near] = np.maximum(self.radius - distance, -self.radius)
        return depth


@dataclass(frozen=True)
class Poses:
    """Node positions (n, 3) m of one mesh, in the thorax's frame, prone and supine."""

    box: Box
    prone: Array
    supine: Array

    def motion(self, zeta: Array) -> Array:
        """How far, m, material points (m, 3) move from prone to supine: the chest stands still."""
        moved = self.box.interpolate(self.supine - self.prone, zeta)
        return np.asarray(np.linalg.norm(moved, axis=1))

    def motion_after_alignment(self, zeta: Array) -> Array:
        """The same after the rigid motion that best carries the prone skin to the supine one.

        Least squares over corresponding points of the whole torso front, by prone area.
        """
        from scipy.spatial.transform import Rotation

        prone, supine = (sample_skin(self.box, pose, 2) for pose in (self.prone, self.supine))
        weights = _areas(prone)
        a, b = prone.points.reshape(-1, 3), supine.points.reshape(-1, 3)
        centre_a, centre_b = weights @ a, weights @ b
        turn, _ = Rotation.align_vectors(b - centre_b, a - centre_a, weights)
        start, end = (self.box.interpolate(pose, zeta) for pose in (self.prone, self.supine))
        aligned = turn.apply(start - centre_a) + centre_b
        return np.asarray(np.linalg.norm(end - aligned, axis=1))

    def depth(self, pose: Array, zeta: Array) -> Array:
        """Distance, m, of the material point (3,) to the skin with nodes at ``pose`` (n, 3) m."""
        from scipy.spatial import cKDTree

        skin = sample_skin(self.box, pose, 10)
        point = self.box.interpolate(pose, zeta[None])
        return np.asarray(cKDTree(skin.points.reshape(-1, 3)).query(point)[0][0])


def _areas(skin: Skin) -> Array:
    """Share of each sample in the skin's area, flat; the shares add up to 1."""
    across, along = np.gradient(skin.points, axis=0), np.gradient(skin.points, axis=1)
    areas = np.linalg.norm(np.cross(across, along), axis=-1).ravel()
    return np.asarray(areas / areas.sum())


def least_motion(poses: Poses, zeta: Array) -> Array:
    """The smaller of a material point's motions, m: chest as it is, or best aligned."""
    return np.minimum(poses.motion(zeta), poses.motion_after_alignment(zeta))


def place_tumour(patient: Patient, poses: Poses, rng: np.random.Generator) -> Tumour | None:
    """A random place in the patient's breast, under enough cover, that moves far enough.

    Returns:
        The first of 2,000 random places that will do, or None if there is none.
    """
    zeta = _candidates(patient, rng, 2000)
    centres = patient.anatomy.rest(zeta)
    fits = _cover(patient, poses.box, centres) > patient.tumour_radius + _COVER
    fits &= patient.anatomy.gland_depth(zeta) > -patient.tumour_radius
    fits &= least_motion(poses, zeta) > LEAST_MOTION + _MARGIN
    chosen = np.flatnonzero(fits)
    if chosen.size == 0:
        return None
    return Tumour(zeta[chosen[0]], centres[chosen[0]], patient.tumour_radius)


def _candidates(patient: Patient, rng: np.random.Generator, count: int) -> Array:
    """Material points (count, 3) in the inner part of the tumour's breast."""
    dome = patient.anatomy.dome(float(patient.tumour_side))
    angle, radius = rng.uniform(0.0, 2.0 * np.pi, count), 0.75 * np.sqrt(rng.uniform(size=count))
    azimuth = dome.azimuth + radius * np.cos(angle) * dome.across / dome.metre
    level = dome.level + radius * np.sin(angle) * dome.along
    return np.stack([azimuth, level, rng.uniform(0.3, 0.85, count)], axis=-1)


def _cover(patient: Patient, box: Box, centres: Array) -> Array:
    """Distance, m, of points at rest to the skin at rest."""
    from scipy.spatial import cKDTree

    skin = sample_skin(box, patient.anatomy.rest(box.zeta), 4)
    return np.asarray(cKDTree(skin.points.reshape(-1, 3)).query(centres)[0])
