"""Swellings of the skin on a lattice of places: what makes the shapes as general as a spline."""

from __future__ import annotations

import numpy as np

from supple.registration import procedural_body as body
from supple.registration.procedural_fields import Field, bump

#: Heights (m) of the rings of places, and their angles from the front to the left (degrees).
_RINGS = {
    "hip": (-0.29, (0, 35, 70, 105, 140, 180)),
    "belly": (-0.215, (0, 35, 70, 105, 140, 180)),
    "waist": (-0.14, (0, 35, 70, 105, 140, 180)),
    "ribs": (-0.065, (0, 40, 75, 110, 145, 180)),
    "chest": (0.015, (0, 75, 110, 145, 180)),
    "thorax": (0.09, (0, 40, 145, 180)),
}


def bumps() -> dict[str, Field]:
    """Name of the place → a swelling of 6 mm around it; those off the midline are left."""
    made: dict[str, Field] = {}
    for ring, (height, angles) in _RINGS.items():
        for angle in angles:
            side = "" if angle in (0, 180) else "_left"
            made[f"{ring}_{angle}{side}"] = bump(_place(angle, height), (0.075, 0.075, 0.075), 0.006)
    return made


def _place(angle: float, height: float) -> tuple[float, float, float]:
    """Where a ray from the trunk's axis meets the trunk."""
    way = np.array([np.sin(np.radians(angle)), -np.cos(np.radians(angle)), 0.0])
    at = np.array([[0.0, 0.0, height]]) + 0.3 * way
    for _ in range(60):
        at -= 0.7 * body.trunk(at)[:, None] * way
    return (float(at[0, 0]), float(at[0, 1]), height)


