"""How bodies differ: standard deviations of bones and shapes that a fit assumes."""

from __future__ import annotations

import numpy as np

from supple.registration.posture import Posture
from supple.registration.rig import Priors, Rig
from supple.registration.template import Floats, Template

#: rad, of a bone's turn against its parent. Arms go anywhere; a breast hardly turns.
TURN = {"abdomen": 0.3, "chest": 0.25, "neck": 0.3, "shoulder": 0.35, "arm": 0.9, "breast": 0.07}
#: Of a bone's scale along an axis against its parent's.
SCALE = {"abdomen": 0.1, "chest": 0.05, "neck": 0.07, "shoulder": 0.05, "arm": 0.06, "breast": 0.06}
#: Of a breast where no back is seen, so that the body may lie on it: how far it falls to its side
#: (rad: mean, sd), and its scales against the chest's. Between lying and standing, wide enough
#: for both.
FALLEN = (0.14, 0.10)
FLAT = ((0.05, -0.12, 0.05), (0.07, 0.10, 0.06))
#: m from the middle of the back, m to the scan, and the share that is nearer where it is seen.
_MIDDLE, _NEAR, _SEEN = 0.08, 0.04, 0.25
#: Of a coefficient, in that of its shape, and how alike the two sides of a body are.
SHAPE, ALIKE = 1.0, 0.9


def body_prior(
    template: Template, shape: float = SHAPE, alike: float = ALIKE, back: bool = True
) -> Priors:
    """Priors of `Rig.fit` by the names of the template's bones and shapes.

    Skin lets a fit slide: on a smooth breast, a nipple may be anywhere as far as distances can
    tell. What bodies do not do (turn one breast by 40°, be fuller on one side only) tells.

    Args:
        back: False: none is seen, and the body may lie on it; breasts fall to their sides then.
    """
    kinds = [bone.name.split("_")[0] for bone in template.bones]
    covariance = paired(template.blendshape_names, shape, alike)
    turn = np.array([TURN.get(kind, 0.5) for kind in kinds])
    scale = np.array([SCALE.get(kind, 0.1) for kind in kinds])
    if back:
        return Priors(rotation=turn, scale=scale, blend_covariance=covariance)
    turns, scales = np.repeat(turn[:, None], 3, axis=1), np.repeat(scale[:, None], 3, axis=1)
    turn_mean, scale_mean = np.zeros_like(turns), np.zeros_like(scales)
    for k, bone in enumerate(template.bones):
        if kinds[k] == "breast":
            side = 1.0 if bone.name.endswith("left") else -1.0
            turn_mean[k, 2], turns[k, 2] = side * FALLEN[0], FALLEN[1]
            scale_mean[k], scales[k] = FLAT
    return Priors(rotation=turns, rotation_mean=turn_mean, scale=scales, scale_mean=scale_mean,
                  blend_covariance=covariance)  # fmt: skip


def prior_seen(rig: Rig, posture: Posture) -> Priors:
    """`body_prior` by whether the rig's scan shows the back of a body about in ``posture``."""
    return body_prior(rig.template, back=back_seen(rig, posture))


def back_seen(rig: Rig, posture: Posture) -> bool:
    """Whether the rig's scan shows the middle of the back of a body about in ``posture``.

    Few points tell. What faces to the front there is what the body lies on.
    """
    template, cloud = rig.template, rig.cloud
    names = [bone.name for bone in template.bones]
    if "chest" not in names:
        return True
    chest = names.index("chest")
    own = np.flatnonzero(template.weights[:, chest] > 0.5)
    if not len(own):
        return True
    at = template.points[own] - template.joints[chest]
    middle = own[(np.abs(at[:, 0]) < _MIDDLE) & (at[:, 1] > np.median(at[:, 1]))]
    points, normals = cloud.points[::8], cloud.normals[::8]
    if cloud.oriented:
        points = points[normals @ posture.rotations[chest][:, 1] > 0]
    if not (len(middle) and len(points)):
        return not len(middle)
    some = rig.vertices(posture)[middle[:: -(-len(middle) // 20)]]
    near = [((points - one) ** 2).sum(axis=1).min() < _NEAR**2 for one in some]
    return float(np.mean(near)) > _SEEN


def paired(names: tuple[str, ...], sd: float, alike: float) -> Floats:
    """Covariance (A, A): ``sd``² each, and ``alike`` of it between left and right of a pair."""
    number = {name: i for i, name in enumerate(names)}
    covariance = sd**2 * np.eye(len(names))
    for name, i in number.items():
        other = number.get(f"{name.removesuffix('_left')}_right")
        if name.endswith("_left") and other is not None:
            covariance[i, other] = covariance[other, i] = alike * sd**2
    return covariance
