"""Weights of the terms of a fit's energy, named as in the thesis."""

from __future__ import annotations

import math
from dataclasses import dataclass, fields

from supple.errors import InputError


@dataclass(frozen=True)
class Weights:
    """E = λ_d E_data + λ_s E_scale + λ_b E_blendshape + λ_j E_joint + λ_l E_landmark.

    Each term is ½ Σ (residual / sd)² with the standard deviations of `rig.Priors`, so E is a
    negative log-likelihood and nothing needs to be tuned: 1 of all is the default. Source:
    Mazier (2022), eqs. 26–31, where they are absolute and set by hand.

    Raises:
        InputError: a weight that is negative or no number; data = 0.
    """

    data: float = 1.0  #: closest points, both ways
    scale: float = 1.0  #: λ_s: a bone's scale against its parent's
    blendshape: float = 1.0  #: λ_b: coefficients against their prior
    joint: float = 1.0  #: λ_j: bones hold together, and turn little against their parents
    landmark: float = 1.0  #: λ_l: named points

    def __post_init__(self) -> None:
        for name in (item.name for item in fields(self)):
            value = getattr(self, name)
            if not (math.isfinite(value) and value >= 0):
                raise InputError(f"weight {name!r} must be ≥ 0, got {value}; 1 is the default.")
        if self.data == 0:
            raise InputError("weight 'data' must be above 0: without it nothing is fitted.")
