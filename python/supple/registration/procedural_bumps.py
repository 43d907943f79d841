"""Swellings of the skin on a lattice of places: what makes the shapes as general as a spline."""

from __future__ import annotations

from functools import cache

import numpy as np
import numpy.typing as npt

from supple.registration import procedural_body as body
from supple.registration.procedural_fields import Field, bump, trunk_bump

Floats = npt.NDArray[np.float64]

#: Heights (m) of the rings of places on the trunk, and their angles from front to left (degrees).
_RINGS = {
    "hip": (-0.30, (0, 35, 70, 105, 140, 180)),
    "belly": (-0.22, (0, 35, 70, 105, 140, 180)),
    "waist": (-0.14, (0, 35, 70, 105, 140, 180)),
    "ribs": (-0.06, (0, 40, 75, 110, 145, 180)),
    "chest": (0.015, (0, 75, 145, 180)),  # at 110 lies the armpit's cleft
    "thorax": (0.085, (0, 40, 145, 180)),
    "girdle": (0.150, (150, 180)),
}
_RADIUS, _HEIGHT = 0.105, 0.008  # of a swelling, m
#: Those near the armpit's cleft, where normals turn within few mm, are less high, m.
_LOW = {"chest_75": 0.005}
#: Places on the left arm: along it from the shoulder, m, and angles from its outside to its front.
_ARM_PLACES = ((0.08, (0, 90, 270)), (0.16, (0, 90, 180, 270)))
_ARM_RADIUS = 0.065


@cache
def bumps() -> dict[str, Field]:
    """Name of the place → a swelling around it; those off the midline are left."""
    places = [(ring, z, angle) for ring, (z, angles) in _RINGS.items() for angle in angles]
    middles = _on_trunk(np.array([(z, angle) for _, z, angle in places]))
    made: dict[str, Field] = {}
    for (ring, _, angle), middle in zip(places, middles, strict=True):
        side = "" if angle in (0, 180) else "_left"
        height = _LOW.get(f"{ring}_{angle}", _HEIGHT)
        made[f"{ring}_{angle}{side}"] = trunk_bump(middle, (_RADIUS,) * 3, height)
    for along, angles in _ARM_PLACES:
        for angle in angles:
            name = f"arm_{round(1000 * along)}_{angle}_left"
            made[name] = bump(_on_arm(angle, along), (_ARM_RADIUS,) * 3, _HEIGHT)
    return made


def _on_trunk(place: Floats) -> Floats:
    """Where rays from the trunk's axis, ``place`` (k, 2) m and degrees, meet the trunk, (k, 3)."""
    turn = np.radians(place[:, 1])
    way = np.stack([np.sin(turn), -np.cos(turn), 0 * turn], axis=1)
    axis = np.stack([0 * turn, 0 * turn, place[:, 0]], axis=1)
    return body.met(axis + 0.3 * way, -way, body.trunk)


def _on_arm(angle: float, along: float) -> Floats:
    front = np.array([0.0, -1.0, 0.0]) + body.ARM[1] * body.ARM
    outside = np.cross(front, body.ARM)
    turn = np.radians(angle)
    way = np.cos(turn) * outside + np.sin(turn) * front
    return np.asarray(body.SHOULDER + along * body.ARM + 0.046 * way)
