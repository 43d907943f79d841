"""Where a torso stands, from three or more landmarks."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from supple.errors import InputError
from supple.registration.initial_pose import Candidate
from supple.registration.pose_presets import PRESETS, shapes_of
from supple.registration.rigid import fit_rigid
from supple.registration.template import Floats, Template


def posture_from_landmarks(template: Template, named: Mapping[str, Floats]) -> list[Candidate]:
    """The presets brought rigidly to the landmarks, best first; none if these lie on a line.

    Raises:
        InputError: a landmark that the template does not name, or that is not (3,) finite.
    """
    for name, at in named.items():
        if name not in template.landmarks:
            known = ", ".join(template.landmarks)
            raise InputError(f"landmark {name!r} must be one of {known}.")
        if at.shape != (3,) or not np.isfinite(at).all():
            raise InputError(f"landmark {name!r} must be three finite numbers, m, got {at}.")
    shapes, target = shapes_of(template), np.array(list(named.values()))
    found = []
    for preset, posture, points in zip(PRESETS, shapes.postures, shapes.points, strict=True):
        marks = template.landmark_points(points)
        source = np.array([marks[name] for name in named])
        try:
            R, t = fit_rigid(source, target)
        except InputError:
            return []
        off = float(np.linalg.norm(source @ R.T + t - target, axis=1).mean())
        found.append(Candidate(posture.moved(R, t, template.joints), preset.name, off))
    return sorted(found, key=lambda one: one.score)
