"""Uncertainty: derivatives against differences, bands against draws, patches against fields."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

from supple.errors import InputError
from supple.registration.posture import posed
from supple.registration.procedural import torso
from supple.registration.synthetic import random_posture
from supple.registration.uncertainty import (
    covariance,
    inflation,
    jacobian,
    radius,
    slid,
    uncertainty_at,
    vertex_uncertainty,
)

template = cache(torso)


def test_the_jacobian_is_the_derivative_of_the_vertices():
    """Central differences of `posed` converge to it; in directions that mix all unknowns."""
    t = template()
    q = random_posture(t, "arms_up", 1)
    rows = jacobian(t, q)
    random = np.random.default_rng(0)
    for _ in range(3):
        d = random.normal(size=rows.shape[2])
        errors = []
        for h in (1e-3, 1e-4):
            difference = (posed(t, q.stepped(h * d)) - posed(t, q.stepped(-h * d))) / (2 * h)
            errors.append(np.abs(difference - rows @ d).max() / np.abs(difference).max())
        assert errors[1] < 1e-6, errors
        assert errors[0] / errors[1] > 50, f"must converge at order 2: {errors}"


def test_a_scale_of_the_root_alone_is_seen_in_the_right_columns():
    """Order of columns: of each bone ω, shift, scale; then blend."""
    t = template()
    q = random_posture(t, "standing", 1, shapes=0.0)
    rows = jacobian(t, q, np.arange(5))
    assert np.allclose(rows[:, :, 3:6], t.weights[:5, 0, None, None] * np.eye(3))
    assert rows.shape == (5, 3, 9 * len(t.bones) + len(t.blendshapes))


@pytest.mark.parametrize("variances", [(1.0, 1.0, 1.0), (4.0, 1.0, 0.1), (1.0, 0.0, 0.0)])
def test_the_radius_holds_95_of_100_normal_points(variances):
    """By 400,000 draws; equal variances: √χ²₃(0.95) = 2.7955; one alone: 1.9600."""
    random = np.random.default_rng(0)
    draws = np.linalg.norm(random.normal(size=(400_000, 3)) * np.sqrt(variances), axis=1)
    found = radius(np.array([variances]), 0.95)[0]
    assert (draws <= found).mean() == pytest.approx(0.95, abs=0.005)


def test_bands_of_a_shift_are_the_shift_s():
    """A covariance of the whole body's shift alone moves every vertex alike: sd is its sd."""
    t = template()
    q = random_posture(t, "standing", 1)
    unknowns = 9 * len(t.bones) + len(t.blendshapes)
    shift = np.zeros((unknowns, 1))
    shift[[9 * k + 3 for k in range(len(t.bones))]] = 1.0
    bands = vertex_uncertainty(t, q, 1e-6 * shift @ shift.T)
    assert np.allclose(bands.sd, 1e-3 / np.sqrt(3))
    assert np.allclose(bands.radius95, 1.96e-3, rtol=1e-3)
    mark = uncertainty_at(t, q, 1e-6 * shift @ shift.T, t.landmarks["xiphoid"])
    assert np.allclose(mark.covariances[0], np.diag([1e-6, 0, 0]), atol=1e-15)


def test_covariance_is_the_posterior_s():
    """Of a straight line through points with noise σ and a prior: Bayes' formula by hand."""
    x = np.array([0.0, 1.0, 2.0])
    rows = np.column_stack([np.ones(3), x])
    data, prior = rows.T @ rows / 0.1**2, np.diag([0.0, 1 / 0.5**2])
    assert np.allclose(covariance(data, prior), np.linalg.inv(data + prior))


@pytest.mark.parametrize("found", [0.05, 0.3])
def test_covariance_is_that_of_many_fits_whose_noise_was_assumed_wrongly(found):
    """20,000 lines with slopes from the prior and noise ``found``, all fitted as if it were 0.1."""
    random = np.random.default_rng(0)
    x = np.array([0.0, 1.0, 2.0])
    rows = np.column_stack([np.ones(3), x])
    data, prior = rows.T @ rows / 0.1**2, np.diag([1 / 2.0**2, 1 / 0.2**2])
    truth = random.normal(size=(20_000, 2)) * (2.0, 0.2)
    seen = truth @ rows.T + found * random.normal(size=(20_000, 3))
    fitted = np.linalg.solve(data + prior, rows.T @ seen.T / 0.1**2).T
    expected = np.cov((fitted - truth).T)
    assert np.allclose(covariance(data, prior, (found / 0.1) ** 2), expected, rtol=0.05)


def test_an_unknown_that_nothing_bounds_is_refused():
    with pytest.raises(InputError, match="free"):
        covariance(np.diag([1.0, 0.0]), np.zeros((2, 2)))
    with pytest.raises(InputError, match="one size"):
        covariance(np.eye(2), np.eye(3))


@pytest.mark.parametrize(("length", "white"), [(0.02, 0.0), (0.01, 1e-3), (0.0, 1e-3)])
def test_inflation_finds_the_integral_of_a_field_s_covariance(length, white):
    """A field of covariance σ² exp(−d²/2ℓ²) and white noise w² a point of area a: S =
    2π ℓ² σ² + w² a, within the sampling error of one draw, 40 %."""
    random = np.random.default_rng(4)
    step, sd = 0.01, 2e-3
    grid = np.stack(np.meshgrid(*2 * [np.arange(0, 0.9, step)]), axis=-1).reshape(-1, 2)
    points = np.column_stack([grid + random.uniform(-1, 1, grid.shape) * step / 4,
                              np.zeros(len(grid))])  # fmt: skip
    residuals = white * random.normal(size=len(points))
    whole = white**2 * step**2
    if length:
        waves = random.normal(size=(3, 400)) / length
        phases = random.uniform(0, 2 * np.pi, 400)
        residuals += sd * np.sqrt(2 / 400) * np.cos(points @ waves + phases).sum(axis=1)
        whole += 2 * np.pi * length**2 * sd**2
    found = inflation(points, residuals, patch=0.015, assumed=2e-3)
    assert found == pytest.approx(whole / (0.015**2 * 2e-3**2), rel=0.4)


def test_only_a_body_unlike_the_template_slides():
    """Skin that leaves the template by much less than the scan's noise adds nothing; by more, the
    band grows up to threefold, and never falls."""
    assert slid(0.0) == slid(0.2) < 1.0
    grown = [slid(left) for left in np.linspace(0.0, 2.0, 200)]
    assert (np.diff(grown) >= 0).all()
    assert grown[-1] == slid(np.inf) == 9.0
