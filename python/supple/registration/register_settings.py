"""Settings of a registration: its stages, limits and priors."""

from __future__ import annotations

from dataclasses import dataclass, field

from supple.registration.initial_pose import SearchSettings
from supple.registration.offset import OffsetSettings
from supple.registration.rig_settings import Priors, Stage
from supple.registration.trust import Doubts
from supple.registration.weights import Weights

#: From a start that is a few cm off, but turned and sized as well as one body can be.
COARSE = (
    Stage("bones", 8, 2e-3, 0.10, 0.04, 75.0, 0.3, 0.03, 4, 8),
    Stage("scales", 6, 1e-3, 0.08, 0.025, 70.0, 0.3, 0.02, 3, 6),
)  # fmt: skip
#: All shapes, as far as it takes to tell one facing from another.
FACE = (Stage("all", 4, 1e-3, 0.05, 0.015, 60.0, 0.3, 0.01, 4, 6),)
#: An arm that was set elsewhere, in a body whose shapes are known.
ARMS = (Stage("bones", 8, 2e-3, 0.08, 0.02, 70.0, 0.3, 0.03, 4, 8),)
#: All shapes, down to the noise.
FINE = (
    Stage("all", 8, 5e-4, 0.05, 0.015, 60.0, 0.3, 0.01, 3, 5),
    Stage("all", 8, 1e-4, 0.03, 0.008, 60.0, 0.3, 0.0, 1, 1),
)
#: The next frame of a moving scan: after a step of less than a frame's motion, another brings
#: landmarks no nearer (24 bodies; and with thrice the motion).
WARM = (
    Stage("all", 3, 15e-3, 0.05, 0.02, 60.0, 0.3, 0.01, 6, 10),
    Stage("all", 3, 10e-3, 0.03, 0.008, 60.0, 0.3, 0.0, 2, 3),
)


@dataclass(frozen=True)
class RegisterSettings:
    """How a scan is registered; lengths in m."""

    weights: Weights = field(default_factory=Weights)
    priors: Priors | None = None  #: how bodies differ; `body_prior` of the template
    coarse: tuple[Stage, ...] = COARSE
    face: tuple[Stage, ...] = FACE
    arms: tuple[Stage, ...] = ARMS  #: (): arms stay where they went
    fine: tuple[Stage, ...] = FINE
    warm: tuple[Stage, ...] = WARM
    search: SearchSettings = field(default_factory=SearchSettings)
    voxel: float = 10e-3  #: the scan is thinned to one point a voxel
    landmark_sd: float = 5e-3  #: of landmarks that are given
    unlike: float = 8e-3  #: noise of a patch for a body unlike any that the template can become
    follows: float = 1.5e-3  #: patches' sd after a loose fit, below which the body is like that
    sure: float | None = None  #: landmarks found with less confidence are not used; None: none are
    found_sd: float = 8e-3  #: of a landmark that is found for certain
    found_reach: float = 50e-3  #: a landmark found further from the coarse fit is not used
    told: int = 1  #: rounds in which the body's own shape tells where its landmarks are
    like: float = 0.45  #: of the noise, by which skin leaves a body that the template can become
    slid: float = 15e-3  #: m; less than this is not worth another round
    starts: int = 3  #: rival starts that are tried, at most
    rival: float = 1.15  #: a start whose score is within this factor of the best is a rival
    facing: float = 1.4  #: and one that faces otherwise within this; its coarse fit goes on if
    faced: float = 2.0  #: what speaks against it is within this factor
    turned: float = 0.9  #: rad between two facings
    doubts: Doubts = field(default_factory=Doubts)
    #: None: bones and shapes alone
    offset: OffsetSettings | None = field(default_factory=OffsetSettings)
