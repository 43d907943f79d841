"""Whether a registration is to be trusted, and if not, why."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from supple.registration.rig import Rig, RigFit
from supple.registration.template import Floats

if TYPE_CHECKING:
    from supple.registration.rivals import Rival


#: m, of a scan without noise: what smooth skin between patches leaves.
_QUIET = 0.5e-3


@dataclass(frozen=True)
class Doubts:
    """Limits beyond which a fit is not trusted; lengths in m."""

    residual: float = 6e-3  #: robust sd of scan to skin
    on_skin: float = 0.5  #: least share of the scan that is the body's
    seen: float = 0.35  #: least share of the skin of the breasts, and of the front, that is seen
    sd: float = 10e-3  #: largest mean standard deviation of the breasts' vertices
    rival: float = 1.2  #: more must speak against the next facing than the best, by this factor
    offset: float = 1.5e-3  #: largest rms by which seen skin leaves what bones and shapes can do
    unlike: float = 0.36  #: and the same in sds of the scan's noise: skin that left it also slid
    shape: float = 13.0  #: largest distance of all shapes together, in standard deviations
    sizes: float = 1.2  #: largest rms of the bones' scales, in standard deviations
    turns: float = 1.0  #: largest rms of the bones' turns against their parents, likewise
    astray: float = 20e-3  #: a nipple further than this from one that surely shows
    sure: float = 0.55  #: the confidence of that
    at_bounds: float = 0.2  #: largest share of the blend's coefficients at their bounds


def doubts(
    rig: Rig, fit: RigFit, offset: Floats, rivals: Sequence[Rival], covariance: Floats,
    limits: Doubts, astray: float = 0.0, held: bool = False,
) -> list[str]:  # fmt: skip
    """One sentence a reason not to trust ``fit``.

    Args:
        offset: (n, 3) m by which the skin left what bones and shapes can do.
        rivals: facings that were compared, the chosen one first; none where a start was given.
        astray: m from a nipple of the fit to where the scan shows one.
        held: whether all landmarks were given, so that the skin could not slide.

    ``limits.unlike`` parts fits of one template to bodies of another, most of which have a landmark
    off by more than 20 mm, from those to its own: shapes 1000 to 1011 in 4 poses, 192 fits.
    """
    template = rig.template
    breasts = template.regions["breast_left"] | template.regions["breast_right"]
    used = float((fit.used > 0.1).mean())
    seen = fit.vertex_used > 0.05
    sd = float(rig.vertex_sd(fit.posture, covariance, breasts).mean())
    bounds = _at_bounds(fit, template.blendshape_bounds)
    share = {side: float(seen[template.regions[f"breast_{side}"]].mean())
             for side in ("left", "right")}  # fmt: skip
    ratio = _rival(rivals)
    away = _away(fit, offset)
    left = unlike(fit, offset)
    shape = _deviations(fit.energy["blendshape"], 1)
    sizes = _deviations(fit.energy["scale"], 3 * len(template.bones))
    turns = _deviations(fit.energy["rotation"], 3 * len(template.bones))
    found = {
        f"The scan lies {1e3 * fit.residual_sd:.1f} mm (sd) from the skin, more than "
        f"{1e3 * limits.residual:.0f} mm; check that it shows a bare torso, in metres.": (
            fit.residual_sd > limits.residual
        ),
        f"Only {below(used)} of the scan are this body's skin, less than "
        f"{limits.on_skin:.0%}; cut away what is not the torso.": used < limits.on_skin,
        f"The standard deviation of the breasts is {1e3 * sd:.0f} mm, more than "
        f"{1e3 * limits.sd:.0f} mm; scan more of the front, or give landmarks.": sd > limits.sd,
        f"{bounds:.0%} of the shapes are at their bounds, more than {limits.at_bounds:.0%}; "
        "the body is unlike any that the template can be.": bounds > limits.at_bounds,
        f"A body that faces another way is nearly as plausible ({ratio:.2f} times the energy, less "
        f"than {limits.rival:g}); give three landmarks, or scan more of the body.": (
            ratio < limits.rival
        ),
        f"The skin had to leave what the template can become by {1e3 * away:.1f} mm (rms), more "
        f"than {1e3 * limits.offset:.1f} mm; check where the landmarks are.": away > limits.offset,
        f"The skin had to leave what the template can become by {left:.2f} of the scan's noise, "
        f"more than {limits.unlike:g}; the body is unlike the template's, so that landmarks may "
        "have slid: give all of them.": left > limits.unlike and away <= limits.offset and not held,
        f"The scan shows a nipple {1e3 * astray:.0f} mm from where the fit has it, more than "
        f"{1e3 * limits.astray:.0f} mm; give landmarks.": astray > limits.astray,
        f"The bones' sizes are {sizes:.1f} standard deviations (rms) from a body's, more than "
        f"{limits.sizes:g}; check that the scan is a torso, in metres.": sizes > limits.sizes,
        f"The shapes are {shape:.1f} standard deviations from the template's, more than "
        f"{limits.shape:g}; check that the drawing is on the breasts.": shape > limits.shape,
        f"The bones are turned by {turns:.1f} standard deviations (rms), more than "
        f"{limits.turns:g}; check that the scan is one body, the right way round.": (
            turns > limits.turns
        ),
    }
    few = len(fit.used) < len(template.points)
    finely = f", or give more than these {len(fit.used)} points of it" if few else ""
    for side, part in share.items():
        found[f"The scan shows {below(part)} of the {side} breast, less than {limits.seen:.0%}; "
              f"scan the front{finely}."] = part < limits.seen  # fmt: skip
    return [text for text, holds in found.items() if holds]


def unlike(fit: RigFit, offset: Floats) -> float:
    """How far seen skin leaves what bones and shapes can do, in standard deviations of the scan.

    Args:
        offset: (n, 3) m.
    """
    return _away(fit, offset) / max(fit.residual_sd, _QUIET)


def _away(fit: RigFit, offset: Floats) -> float:
    """Root mean square, m, of ``offset`` (n, 3) m where skin is seen."""
    seen = fit.vertex_used > 0.05
    return float(np.sqrt((offset[seen] ** 2).sum(axis=1).mean())) if seen.any() else 0.0


def below(share: float) -> str:
    """Per cent, rounded down: one that is just less than a limit must not read as the limit."""
    return f"{np.floor(100 * share):.0f}%"


def _at_bounds(fit: RigFit, bounds: Floats) -> float:
    blend = fit.posture.blend
    if not len(blend):
        return 0.0
    margin = 1e-3 * np.ptp(bounds, axis=1)
    at = (blend <= bounds[:, 0] + margin) | (blend >= bounds[:, 1] - margin)
    return float((at & (np.abs(blend) > 1e-6)).mean())


def _rival(rivals: Sequence[Rival]) -> float:
    """How much more speaks against the next facing than against the chosen."""
    if len(rivals) < 2:
        return float("inf")
    return float(rivals[1].against / max(rivals[0].against, 1e-9))


def _deviations(energy: float, count: int) -> float:
    """Root mean square, in standard deviations, of ``count`` unknowns with ½ Σ z² = ``energy``."""
    return float(np.sqrt(2 * energy / max(count, 1)))
