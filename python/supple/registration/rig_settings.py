"""Settings of a rig's fit: its stages from coarse to fine, and what is known beforehand."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache
from typing import Any, Literal

import numpy as np
import numpy.typing as npt

from supple.core import core
from supple.errors import InputError
from supple.registration.template import Template
from supple.registration.weights import Weights

Moves = Literal["rigid", "bones", "scales", "all"]
_MOVES = ("rigid", "bones", "scales", "all")


@dataclass(frozen=True)
class Stage:
    """One step of the way from coarse to fine."""

    moves: Moves = "all"  #: one body; bones; their scales too; the blend too
    iterations: int = 10  #: at most
    tolerance: float = 5e-5  #: m: it ends when no vertex moves further
    reach: float = 30e-3  #: m: pairs further apart are none
    loss: float = 8e-3  #: m: the residual that counts a quarter (Geman–McClure)
    angle: float = 60.0  #: degrees between normals of a pair, at most
    template_share: float = 0.3  #: of the data that looks from the template to the scan
    point_share: float = 0.0  #: of point-to-point in that
    every_vertex: int = 1  #: uses every so many vertices
    every_point: int = 1  #: uses every so many points of the thinned scan
    flat: float = 5e-3  #: it ends, too, when the energy falls by less than this share of it


#: From a pose that is a few cm and 20° off.
COLD = (
    Stage("rigid", 5, 2e-3, 0.12, 0.06, 75.0, 0.5, 0.05, 4, 8, 0.02),
    Stage("bones", 4, 2e-3, 0.10, 0.04, 75.0, 0.5, 0.03, 4, 6, 0.02),
    Stage("all", 4, 1e-3, 0.08, 0.03, 70.0, 0.5, 0.02, 3, 4, 0.02),
    Stage("all", 6, 5e-4, 0.05, 0.015, 60.0, 0.4, 0.01, 2, 2, 0.02),
    Stage("all", 5, 1e-4, 0.03, 0.008, 60.0, 0.3, 0.0, 1, 1, 0.01),
)
#: The next frame of a moving scan.
WARM = (
    Stage("all", 2, 1e-3, 0.05, 0.02, 60.0, 0.5, 0.01, 3, 4, 0.02),
    Stage("all", 2, 2e-4, 0.03, 0.008, 60.0, 0.3, 0.0, 2, 2, 0.02),
)


@dataclass(frozen=True, eq=False)
class Priors:
    """Standard deviations that make the energy's terms dimensionless; None: its default.

    Attributes:
        noise: m, of the mean residual of a patch: scan noise that thinning leaves, and the shape
            that the template lacks.
        patch: m; data within patch × patch count as one observation however dense they are, as
            neighbours' residuals share their cause.
        scale: (K,) or (K, 3) of s_k − s_parent, and of s − 1 for the root; 0.1.
        scale_mean: (K, 3) of the same; 0.
        joint: (K,) m of T_k(j_k) − T_parent(j_k); 1 mm: a joint is tight, and cheap to hold.
        rotation: (K,) or (K, 3) rad, of a bone against its parent, along the parent's axes; 0.5:
            only bones that see no data stay.
        rotation_mean: (K, 3) of the same; 0.
        blend_mean, blend_covariance: (A,), (A, A) of a statistical prior; 0 and I: shapes are made
            so that a coefficient of 1 is one standard deviation.
        stiff_joints: joints hold exactly, by Lagrange multipliers.
        convex: Σ α = 1 and α ≥ 0, as in the thesis, whose shapes are whole bodies. Ours are
            offsets from the template, of both signs, and 0 of all is a body: off.
        bounded: the blend stays within the template's bounds.
        scale_bounds: of all scales.
    """

    noise: float = 2e-3
    patch: float = 15e-3
    scale: npt.ArrayLike | None = None
    scale_mean: npt.ArrayLike | None = None
    joint: npt.ArrayLike | None = None
    rotation: npt.ArrayLike | None = None
    rotation_mean: npt.ArrayLike | None = None
    blend_mean: npt.ArrayLike | None = None
    blend_covariance: npt.ArrayLike | None = None
    stiff_joints: bool = False
    convex: bool = False
    bounded: bool = True
    scale_bounds: tuple[float, float] = (0.5, 2.0)


def stage_in_core(stage: Stage) -> Any:
    made = core().RigStage()
    for name, value in vars(stage).items():
        setattr(made, name, _MOVES.index(value) if name == "moves" else value)
    return made


def weights_in_core(weights: Weights) -> Any:
    made = core().RigWeights()
    for name, value in vars(weights).items():
        setattr(made, name, value)
    return made


def priors_in_core(priors: Priors, template: Template) -> Any:
    made = core().RigPriors()
    for name in ("noise", "patch", "stiff_joints", "convex"):
        setattr(made, name, getattr(priors, name))
    for name in ("scale", "scale_mean", "joint", "rotation", "rotation_mean", "blend_mean"):
        if getattr(priors, name) is not None:
            setattr(made, name, np.asarray(getattr(priors, name), dtype=np.float64).ravel())
    if priors.blend_covariance is not None:
        covariance = np.ascontiguousarray(priors.blend_covariance, dtype=np.float64)
        made.blend_precision = _inverse(covariance.tobytes())
    if priors.bounded:
        made.blend_lower, made.blend_upper = template.blendshape_bounds.T
    made.scale_lower, made.scale_upper = priors.scale_bounds
    return made


@lru_cache(maxsize=4)
def _inverse(covariance: bytes) -> npt.NDArray[np.float64]:
    """Of a square matrix of doubles, once for all fits of a registration.

    By the core: a BLAS' threads would wait, busy, in the way of the fit's own.
    """
    matrix = np.frombuffer(covariance)
    if not matrix.size:
        return matrix.reshape(0, 0)
    matrix = matrix.reshape(math.isqrt(matrix.size), -1)
    inverse = core().inverse_sum(matrix, np.zeros_like(matrix))
    if not len(inverse):
        raise InputError("blend_covariance must be positive definite; give a larger variance.")
    return np.asarray(inverse)
