"""Fits by the core: what is recovered, what holds, what is refused."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from supple.core import core
from supple.errors import ConvergenceError, InputError
from supple.registration.posture import Posture, posed
from supple.registration.rig import Priors, Rig, Stage
from supple.registration.template import Template
from supple.registration.weights import Weights
from supple.surface import Surface

from .crude_torso import chained_posture, crude_torso


def exact_stages() -> tuple[Stage, ...]:
    loose = Stage("all", 15, 1e-4, 0.06, 0.02, 80.0, 0.3, flat=0.0)
    return loose, Stage("all", 60, 1e-9, 0.03, 0.005, 60.0, 0.3, flat=0.0)


def test_a_posture_is_recovered_from_its_exact_scan() -> None:
    """Noise-free scan of the same template, priors next to off: vertices return within 1 µm."""
    template = crude_torso(40, 30, 8)
    truth = chained_posture(template, 8, turn=0.05)
    expected = posed(template, truth)
    rig = Rig(template)
    rig.set_scan(Surface(expected, template.triangles), thin=False)
    weak = Weights(scale=1e-9, blendshape=1e-9, joint=1e-9)
    found = rig.fit(Posture.rest(template), exact_stages(), weak)
    assert abs(found.points - expected).max() < 1e-6


def noisy_rig(template: Template, seed: int = 9) -> tuple[Rig, np.ndarray]:
    rng = np.random.default_rng(seed)
    expected = posed(template, chained_posture(template, seed))
    inside = rng.dirichlet([1, 1, 1], (len(template.triangles), 8))
    cloud = np.einsum("tsc,tcd->tsd", inside, expected[template.triangles]).reshape(-1, 3)
    rig = Rig(template)
    rig.set_scan(Surface(cloud + 1e-3 * rng.standard_normal(cloud.shape)))
    return rig, expected


def test_a_noisy_cloud_is_fitted_within_its_noise() -> None:
    """A cloud of points alone, 1 mm of noise: the mean distance to the true skin is below that."""
    template = crude_torso(40, 30, 8)
    rig, expected = noisy_rig(template)
    found = rig.fit(Posture.rest(template))
    _, _, distance = rig.land(found.posture, expected)
    assert distance.mean() < 1e-3
    assert found.converged
    assert found.history[-1] < 0.1 * found.history[0]


def test_threads_leave_no_trace() -> None:
    template = crude_torso(40, 30, 8)
    before = core().threads()
    results = []
    try:
        for threads in (1, 2, 4):
            core().set_threads(threads)
            rig, _ = noisy_rig(template)
            results.append(rig.fit(Posture.rest(template)))
    finally:
        core().set_threads(before)
    for other in results[1:]:
        assert np.array_equal(results[0].points, other.points)
        assert np.array_equal(results[0].data_matrix, other.data_matrix)
        assert results[0].history == other.history


def joint_gaps(template: Template, posture: Posture) -> np.ndarray:
    gaps = []
    for k, p in enumerate(template.parents):
        if p >= 0:
            arm = template.joints[k] - template.joints[p]
            carried = posture.rotations[p] @ (posture.scales[p] * arm) + template.joints[p]
            gaps.append(template.joints[k] + posture.translations[k]
                        - carried - posture.translations[p])  # fmt: skip
    return np.linalg.norm(gaps, axis=1)


def test_stiff_joints_hold_exactly_and_compliant_ones_nearly() -> None:
    """By multipliers to Newton's accuracy; by energy within some standard deviations of 1 mm."""
    template = crude_torso(40, 30, 8)
    rig, _ = noisy_rig(template)
    stages = (Stage("bones", 10, 1e-3, 0.1, 0.04), Stage("all", 25, 1e-7, flat=0.0))
    start = Posture.rest(template)
    compliant = rig.fit(start, stages)
    stiff = rig.fit(start, stages, priors=Priors(stiff_joints=True))
    assert joint_gaps(template, stiff.posture).max() < 1e-7
    assert 1e-7 < joint_gaps(template, compliant.posture).max() < 5e-3


def test_the_blend_stays_in_its_bounds_and_touches_one() -> None:
    """A bound that cuts off the truth is reached, and nothing passes it."""
    template = crude_torso(40, 30, 8)
    tight = replace(template, blendshape_bounds=np.tile([-0.3, 0.2], (8, 1)))
    rig, _ = noisy_rig(template)
    truth = chained_posture(template, 9).blend
    bounded = Rig(tight)
    bounded.set_scan(Surface(rig._fit.scan.points), thin=False)
    found = bounded.fit(Posture.rest(template)).posture.blend
    assert found.min() >= -0.3
    assert found.max() <= 0.2
    assert (truth > 0.3).any()
    assert found.max() == pytest.approx(0.2, abs=1e-12)


def test_convexity_of_the_thesis_holds_as_an_option() -> None:
    """Σα = 1 and α ≥ 0."""
    template = crude_torso(40, 30, 8)
    rig, _ = noisy_rig(template)
    blend = rig.fit(Posture.rest(template), priors=Priors(convex=True)).posture.blend
    assert blend.sum() == pytest.approx(1.0, abs=1e-9)
    assert blend.min() >= -1e-12


def test_a_fit_from_far_away_says_so() -> None:
    template = crude_torso(16, 12, 6)
    rig = Rig(template)
    rig.set_scan(Surface(template.points + 5.0, template.triangles))
    with pytest.raises(ConvergenceError, match="must start near the scan"):
        rig.fit(Posture.rest(template))


def test_wrong_input_is_refused() -> None:
    template = crude_torso(16, 12, 6)
    rig = Rig(template)
    with pytest.raises(InputError, match="call set_scan first"):
        Rig(template).fit(Posture.rest(template))
    rig.set_scan(Surface(template.points, template.triangles))
    with pytest.raises(InputError, match="'elbow' must be one of"):
        rig.fit(Posture.rest(template), landmarks={"elbow": (0, 0, 0)})
    with pytest.raises(InputError, match="must be ≥ 0"):
        Weights(scale=-1)
    with pytest.raises(InputError, match="an iteration at least"):
        rig.fit(Posture.rest(template), (Stage(iterations=0),))
