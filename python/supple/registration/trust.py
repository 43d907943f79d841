"""Whether a registration is to be trusted, and if not, why."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from supple.registration.initial_pose import Candidate
from supple.registration.rig import Rig, RigFit
from supple.registration.template import Floats


@dataclass(frozen=True)
class Doubts:
    """Limits beyond which a fit is not trusted; lengths in m."""

    residual: float = 6e-3  #: robust sd of scan to skin
    on_skin: float = 0.5  #: least share of the scan that is the body's
    seen: float = 0.35  #: least share of the skin of the breasts, and of the front, that is seen
    sd: float = 12e-3  #: largest mean standard deviation of the breasts' vertices
    rival: float = 1.1  #: another pose must be worse than the best by this factor
    turned: float = 0.6  #: rad; poses that differ by less are one
    at_bounds: float = 0.2  #: largest share of the blend's coefficients at their bounds


def doubts(
    rig: Rig, fit: RigFit, tried: list[RigFit], starts: list[Candidate], covariance: Floats,
    limits: Doubts,
) -> list[str]:  # fmt: skip
    """One sentence a reason not to trust ``fit``."""
    template = rig.template
    breasts = template.regions["breast_left"] | template.regions["breast_right"]
    used = float((fit.used > 0.1).mean())
    seen = fit.vertex_used > 0.05
    sd = float(rig.vertex_sd(fit.posture, covariance, breasts).mean())
    bounds = _at_bounds(fit, template.blendshape_bounds)
    share = {side: float(seen[template.regions[f"breast_{side}"]].mean())
             for side in ("left", "right")}  # fmt: skip
    rival = _rival(fit, tried, starts, limits)
    found = {
        f"The scan lies {1e3 * fit.residual_sd:.1f} mm (sd) from the skin, more than "
        f"{1e3 * limits.residual:.0f} mm; check that it shows a bare torso, in metres.": (
            fit.residual_sd > limits.residual
        ),
        f"Only {used:.0%} of the scan are this body's skin, less than {limits.on_skin:.0%}; "
        "cut away what is not the torso.": used < limits.on_skin,
        f"The standard deviation of the breasts is {1e3 * sd:.0f} mm, more than "
        f"{1e3 * limits.sd:.0f} mm; scan more of the front.": sd > limits.sd,
        f"{bounds:.0%} of the shapes are at their bounds, more than {limits.at_bounds:.0%}; "
        "the body is unlike any that the template can be.": bounds > limits.at_bounds,
        "Another pose fits nearly as well; give three landmarks, or scan more of the body.": rival,
    }
    for side, part in share.items():
        found[f"The scan shows {part:.0%} of the {side} breast, less than {limits.seen:.0%}; "
              "scan the front."] = part < limits.seen  # fmt: skip
    return [text for text, holds in found.items() if holds]


def _at_bounds(fit: RigFit, bounds: Floats) -> float:
    blend = fit.posture.blend
    if not len(blend):
        return 0.0
    margin = 1e-3 * np.ptp(bounds, axis=1)
    at = (blend <= bounds[:, 0] + margin) | (blend >= bounds[:, 1] - margin)
    return float((at & (np.abs(blend) > 1e-6)).mean())


def _rival(fit: RigFit, tried: list[RigFit], starts: list[Candidate], limits: Doubts) -> bool:
    """Whether a pose that is turned by more than ``limits.turned`` is nearly as good."""
    if not tried or not starts[0].score:
        return False
    for one in starts[1:]:
        turned = one.posture.rotations[0] @ fit.posture.rotations[0].T
        angle = float(np.arccos(np.clip((np.trace(turned) - 1) / 2, -1, 1)))
        if angle > limits.turned and one.score < limits.rival * starts[0].score:
            return True
    return False
