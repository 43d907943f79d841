"""How a template stands: rotation, translation and scale of each bone, and the blend of shapes."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from supple.registration.template import Template

Floats = npt.NDArray[np.float64]


@dataclass(frozen=True, eq=False, repr=False)
class Posture:
    """The unknowns of a fit; thesis eqs. 23–25.

    Bone k takes x to ``R_k diag(s_k) (x - j_k) + j_k + t_k``, where j_k is its joint on the
    template. Bones are not chained: what ties a bone to its parent is an energy at the joint.

    Attributes:
        rotations: (K, 3, 3).
        translations: (K, 3) m.
        scales: (K, 3), along the template's axes.
        blend: (A,) coefficients of the blendshapes.
    """

    rotations: Floats
    translations: Floats
    scales: Floats
    blend: Floats

    @classmethod
    def rest(cls, template: Template) -> Posture:
        """That of the template itself."""
        bones, shapes = len(template.bones), len(template.blendshapes)
        return cls(np.tile(np.eye(3), (bones, 1, 1)), np.zeros((bones, 3)), np.ones((bones, 3)),
                   np.zeros(shapes))  # fmt: skip

    def moved(self, R: Floats, t: Floats, joints: Floats) -> Posture:
        """All of it turned by ``R`` (3, 3) about the origin, then shifted by ``t`` (3,) m."""
        translations = (joints + self.translations) @ R.T + t - joints
        return Posture(R @ self.rotations, translations, self.scales, self.blend)

    def stepped(self, step: npt.ArrayLike) -> Posture:
        """After a step (9 K + A,): of each bone ω (rad; exp(ω) R), shift (m), scale; then blend.

        This is the order of the columns of every Jacobian, and of covariances.
        """
        from scipy.spatial.transform import Rotation

        bones = len(self.scales)
        whole = np.asarray(step, dtype=np.float64)
        parts = whole[: 9 * bones].reshape(bones, 3, 3)
        turns = Rotation.from_rotvec(parts[:, 0]).as_matrix()
        return Posture(turns @ self.rotations, self.translations + parts[:, 1],
                       self.scales + parts[:, 2], self.blend + whole[9 * bones :])  # fmt: skip


def posed(template: Template, posture: Posture) -> Floats:
    """Vertices (n, 3) m by linear blend skinning of the blended shape; thesis eqs. 23–25."""
    shape = template.points + np.tensordot(posture.blend, template.blendshapes, axes=1)
    affine = posture.rotations * posture.scales[:, None, :]
    offsets = template.joints + posture.translations
    offsets = offsets - np.einsum("kij,kj->ki", affine, template.joints)
    of_vertices = np.tensordot(template.weights, affine, axes=1)
    return np.asarray(np.einsum("nij,nj->ni", of_vertices, shape) + template.weights @ offsets)


def attached(template: Template, rotations: Floats, scales: Floats, blend: Floats) -> Posture:
    """The posture whose shifts carry each joint to where its parent carries it; the root rests."""
    shifts, joints = np.zeros_like(scales), template.joints
    for k, parent in enumerate(template.parents):
        if parent >= 0:
            arm = scales[parent] * (joints[k] - joints[parent])
            shifts[k] = rotations[parent] @ arm + joints[parent] + shifts[parent] - joints[k]
    return Posture(rotations, shifts, scales, blend)
