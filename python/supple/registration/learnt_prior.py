"""How bodies differ, learnt from bodies that were registered before."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from supple.errors import InputError
from supple.registration.body_prior import body_prior
from supple.registration.posture import Posture
from supple.registration.rig_settings import Priors
from supple.registration.template import Floats, Ints, Template

#: Bones whose turns are what somebody does, not how somebody is made.
_POSED = ("shoulder", "arm")


def learnt_prior(template: Template, postures: Sequence[Posture], assumed: float = 5.0) -> Priors:
    """Means and deviations of bones and shapes among ``postures``, for `RegisterSettings.priors`.

    Register bodies of a population with landmarks given, and further ones with what they teach.
    Each counts with its mirror image, so left and right are alike. Turns of shoulders and arms
    stay as `body_prior` has them.

    Args:
        postures: of ``template``, of bodies that were well registered.
        assumed: `body_prior`, with means of 0, counts as so many bodies.

    Raises:
        InputError: no postures, or those of another template; ``assumed`` not above 0.

    Source: Gelman et al. (2013), Bayesian Data Analysis, §3.6: mode of the mean and covariance
    under a normal-inverse-Wishart prior.
    """
    bones, shapes = len(template.bones), len(template.blendshape_names)
    if not postures or any(len(p.scales) != bones or len(p.blend) != shapes for p in postures):
        raise InputError(f"postures must be of bodies with {bones} bones and {shapes} shapes, one "
                         f"at least, got {len(postures)}; give those of {template!r}.")  # fmt: skip
    if not assumed > 0:
        raise InputError(f"assumed must be above 0 bodies, got {assumed}; 5 is the default.")
    start, other = body_prior(template), _other_side([bone.name for bone in template.bones])
    scales = np.array([_sizes(template, posture) for posture in postures])
    turns = np.array([_turns(template, posture) for posture in postures])
    blends = np.array([posture.blend for posture in postures])
    swapped = blends[:, _other_side(template.blendshape_names)]
    scale_mean, scale = _of_each(_joined(scales, scales[:, other]), start.scale, assumed)
    mirrored = turns[:, other] * (1.0, -1.0, -1.0)
    turn_mean, turn = _of_each(_joined(turns, mirrored), start.rotation, assumed)
    posed = [bone.name.startswith(_POSED) for bone in template.bones]
    turn_mean[posed], turn[posed] = 0.0, np.asarray(start.rotation)[posed, None]
    blend_mean, covariance = _updated(
        _joined(blends, swapped), np.asarray(start.blend_covariance), assumed)  # fmt: skip
    return Priors(scale=scale, scale_mean=scale_mean, rotation=turn, rotation_mean=turn_mean,
                  blend_mean=blend_mean, blend_covariance=covariance)  # fmt: skip


def _joined(bodies: Floats, mirrored: Floats) -> Floats:
    return np.concatenate([bodies, mirrored])


def _updated(found: Floats, covariance: Floats, assumed: float) -> tuple[Floats, Floats]:
    """Mean (p,) and covariance (p, p) after ``found`` (2m, p), two of which are one body."""
    count = len(found) / 2
    mean = found.sum(axis=0) / 2 / (count + assumed)
    square = assumed * covariance + found.T @ found / 2
    return mean, np.asarray(square / (count + assumed) - np.outer(mean, mean))


def _of_each(found: Floats, sd: object, assumed: float) -> tuple[Floats, Floats]:
    """Means (K, 3) and deviations (K, 3) of ``found`` (2m, K, 3), each by itself."""
    count = len(found) / 2
    mean = found.sum(axis=0) / 2 / (count + assumed)
    square = assumed * np.square(np.asarray(sd, dtype=np.float64))[:, None]
    square = square + (found**2).sum(axis=0) / 2
    return mean, np.sqrt(square / (count + assumed) - mean**2)


def _sizes(template: Template, posture: Posture) -> Floats:
    """(K, 3) scales against the parents', of the root against 1."""
    above = [posture.scales[p] if p >= 0 else np.ones(3) for p in template.parents]
    return np.asarray(posture.scales - np.array(above))


def _turns(template: Template, posture: Posture) -> Floats:
    """(K, 3) rad against the parents, along their axes; 0 of the root."""
    from scipy.spatial.transform import Rotation

    R = posture.rotations
    against = [R[p].T @ R[k] if p >= 0 else np.eye(3) for k, p in enumerate(template.parents)]
    return np.asarray(Rotation.from_matrix(np.array(against)).as_rotvec())


def _other_side(names: Sequence[str]) -> Ints:
    """Number of each name's partner: left of right, and itself where there is none."""
    number = {name: i for i, name in enumerate(names)}

    def partner(name: str) -> str:
        for one, two in (("_left", "_right"), ("_right", "_left")):
            if name.endswith(one):
                return name.removesuffix(one) + two
        return name

    return np.array([number.get(partner(name), i) for name, i in number.items()], dtype=np.int64)
