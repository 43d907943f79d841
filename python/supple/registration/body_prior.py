"""How bodies differ: standard deviations of bones and shapes that a fit assumes."""

from __future__ import annotations

import numpy as np

from supple.registration.rig import Priors
from supple.registration.template import Floats, Template

#: rad, of a bone's turn against its parent. Arms go anywhere; a breast hardly turns.
TURN = {"abdomen": 0.3, "chest": 0.25, "neck": 0.3, "shoulder": 0.35, "arm": 0.9, "breast": 0.07}
#: Of a bone's scale along an axis against its parent's.
SCALE = {"abdomen": 0.1, "chest": 0.05, "neck": 0.07, "shoulder": 0.05, "arm": 0.06, "breast": 0.06}
#: Of a coefficient, in that of its shape, and how alike the two sides of a body are.
SHAPE, ALIKE = 1.0, 0.9


def body_prior(template: Template, shape: float = SHAPE, alike: float = ALIKE) -> Priors:
    """Priors of `Rig.fit` by the names of the template's bones and shapes.

    Skin lets a fit slide: on a smooth breast, a nipple may be anywhere as far as distances can
    tell. What bodies do not do (turn one breast by 40°, be fuller on one side only) tells.
    """
    kinds = [bone.name.split("_")[0] for bone in template.bones]
    return Priors(
        rotation=np.array([TURN.get(kind, 0.5) for kind in kinds]),
        scale=np.array([SCALE.get(kind, 0.1) for kind in kinds]),
        blend_covariance=paired(template.blendshape_names, shape, alike),
    )


def paired(names: tuple[str, ...], sd: float, alike: float) -> Floats:
    """Covariance (A, A): ``sd``² each, and ``alike`` of it between left and right of a pair."""
    number = {name: i for i, name in enumerate(names)}
    covariance = sd**2 * np.eye(len(names))
    for name, i in number.items():
        other = number.get(f"{name.removesuffix('_left')}_right")
        if name.endswith("_left") and other is not None:
            covariance[i, other] = covariance[other, i] = alike * sd**2
    return covariance
