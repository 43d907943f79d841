"""What a prior learnt from registered bodies is worth to bodies that were not.

bodies with their true landmarks given → `learnt_prior` → other bodies, without landmarks → rows
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from ..registration.learnt_prior import learnt_prior
from ..registration.register import RegisterSettings, register
from ..registration.rig import Priors
from ..registration.synthetic import POSES
from ..registration.template import Template
from . import torso_cases
from .torso_cases import Case
from .torso_score import score

#: m; a landmark that is given is where the body has it.
GIVEN = 1e-3
#: Shapes that teach, and shapes that judge: none of those of the acceptance, which begin at 0.
TAUGHT, JUDGED = range(1000, 1004), range(2000, 2003)


def taught(
    scanned: str, fitted: str, known: Mapping[str, Template], shapes: Iterable[int] = TAUGHT
) -> Priors:
    """Of template ``fitted``, from noise-free bodies of ``scanned`` in every pose."""
    postures = []
    for case in (Case(scanned, fitted, pose, shape, 0.0) for shape in shapes for pose in POSES):
        scan = torso_cases.scan_of(case, known)
        settings = RegisterSettings(landmark_sd=GIVEN)
        found = register(scan.surface, known[fitted], dict(scan.truth.landmarks), settings)
        postures.append(found.posture)
    return learnt_prior(known[fitted], postures)


def rows(
    scanned: str, fitted: str, known: Mapping[str, Template],
    shapes: Iterable[int] = JUDGED, teachers: Iterable[int] = TAUGHT,
) -> Iterator[dict[str, Any]]:  # fmt: skip
    """One a body and prior: errors, mm, and the share of landmarks inside their 95 % band."""
    priors = {"assumed": None, "learnt": taught(scanned, fitted, known, teachers)}
    for shape in shapes:
        noise = torso_cases.NOISE[shape % len(torso_cases.NOISE)]
        for case in (Case(scanned, fitted, pose, shape, noise) for pose in POSES):
            scan = torso_cases.scan_of(case, known)
            for name, prior in priors.items():
                settings = replace(RegisterSettings(), priors=prior)
                found = register(scan.surface, known[fitted], settings=settings)
                result = score(found, scan, known[scanned])
                yield {"case": case.key, "prior": name, "surface_mm": result.surface,
                       "landmark_mm": result.landmark, "covered": result.covered,
                       "worst_landmark_mm": result.worst_landmark[1], "failed": result.failed,
                       "trustworthy": found.trustworthy}  # fmt: skip


def summary(found: Iterable[Mapping[str, Any]]) -> dict[str, dict[str, float]]:
    """Means over the bodies, by prior."""
    every = list(found)
    names = [key for key, value in every[0].items() if not isinstance(value, str)]
    return {
        prior: {name: float(np.mean([row[name] for row in every if row["prior"] == prior]))
                for name in names}
        for prior in dict.fromkeys(row["prior"] for row in every)
    }  # fmt: skip
