"""What is judged with the scan at hand: a second body beside the patient, a chest without breasts.

Scans are of the shipped template, so that the fit alone has no doubt of them.
"""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

from supple.registration.output import Outcome, judged
from supple.registration.posture import posed
from supple.registration.procedural import torso
from supple.registration.register import register
from supple.registration.synthetic import SyntheticScan, random_posture, synthetic_scan
from supple.surface import Surface


@cache
def scan(seed: int) -> SyntheticScan:
    posture = random_posture(torso(), "standing", seed)
    return synthetic_scan(
        torso(), posture, seed, points=12_000, noise=1e-3, missing=0.1, clutter=0.0, rotation=0.0
    )


def warnings(surface: Surface) -> tuple[bool, str]:
    fit = judged(Outcome(register(surface, torso()), surface)).registration
    return fit.trustworthy, " ".join(fit.warnings)


@pytest.mark.slow
@pytest.mark.parametrize("triangles", [True, False])
def test_a_second_body_beside_the_patient_is_said(triangles):
    """0.8 m to the left, another shape; either alone is trusted."""
    one, other = scan(1006).surface, scan(1007).surface
    points = np.vstack([one.points, other.points + np.array([0.8, 0.0, 0.0])])
    both = np.vstack([one.triangles, other.triangles + len(one.points)])
    trusted, said = warnings(Surface(points, both) if triangles else Surface(points))
    assert not trusted
    assert "another body 8" in said or "another body 7" in said
    assert warnings(one) == (True, "")


@pytest.mark.slow
def test_a_ball_of_half_as_many_points_is_no_second_body():
    one = scan(1006).surface
    way = np.random.default_rng(0).normal(size=(len(one.points) // 2, 3))
    ball = 0.15 * way / np.linalg.norm(way, axis=1)[:, None] + [0.9, 0.0, 0.0]
    assert "another body" not in warnings(Surface(np.vstack([one.points, ball])))[1]


@pytest.mark.slow
@pytest.mark.parametrize("gone", [("left",), ("left", "right")])
def test_a_breast_that_is_gone_is_said(gone):
    """Its skin made a soap film over its rim: the fit is as good, but nothing holds the drawing."""
    t = torso()
    points = posed(t, random_posture(t, "standing", 1004))
    edges = t.triangles[:, [0, 1, 1, 2, 2, 0, 1, 0, 2, 1, 0, 2]].reshape(-1, 2)
    count = np.bincount(edges[:, 0], minlength=len(points))[:, None]
    flat = np.any([t.regions[f"breast_{side}"] for side in gone], axis=0)
    for _ in range(400):
        mean = np.zeros_like(points)
        np.add.at(mean, edges[:, 0], points[edges[:, 1]])
        points[flat] = (mean / count)[flat]
    a, b, c = points[t.triangles].transpose(1, 0, 2)
    dense = np.vstack([points, (a + b) / 2, (b + c) / 2, (a + b + c) / 3])
    said = warnings(Surface(dense))[1]
    assert all(f"{side} breast stands out by" in said for side in gone)
    assert ("right breast stands out" in said) == ("right" in gone)
