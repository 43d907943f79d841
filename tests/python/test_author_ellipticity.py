"""Strong ellipticity: minima that are known, losses where a formula puts them."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import brentq

from supple.author import limits
from supple.author.curves import along
from supple.author.ellipticity import least_wave_stiffness
from supple.author.modes import MODES
from supple.author.points import PointLaw
from supple.author.samples import Range
from supple.laws import read_law

YOUNG, POISSON = 3e3, 0.3
MU = YOUNG / (2 * (1 + POISSON))
LAMBDA = YOUNG * POISSON / ((1 + POISSON) * (1 - 2 * POISSON))
EYE = np.eye(3)


def losses(law, volume, poisson=POISSON):
    point, mode = PointLaw(read_law(law), young=YOUNG, poisson=poisson), MODES["volumetric"]
    curve = along(point, mode, Range(volume=volume).values(mode))
    return {x.side: x.value for x in limits.losses(point, curve, YOUNG)}


def test_the_slowest_wave_of_hookes_solid_is_the_slower_of_two():
    """min(mu, lambda + 2 mu), whichever it is."""
    for mu, lmbda in ((1.0, 2.0), (1.0, -1.5)):
        A = lmbda * np.einsum("ij,kl->ijkl", EYE, EYE)
        A = A + mu * (np.einsum("ik,jl->ijkl", EYE, EYE) + np.einsum("il,jk->ijkl", EYE, EYE))
        assert least_wave_stiffness(A[None])[0] == pytest.approx(min(mu, lmbda + 2 * mu), abs=1e-12)


def test_no_pair_of_directions_is_below_the_minimum():
    """Twenty thousand random pairs for each of ten random tangents, the best of them close."""
    rng = np.random.default_rng(0)
    A = rng.standard_normal((10, 9, 9))
    A = (A + np.swapaxes(A, 1, 2)).reshape(10, 3, 3, 3, 3)
    least = least_wave_stiffness(A)
    a, n = rng.standard_normal((2, 20_000, 3))
    dyads = np.einsum("pi,pj->pij", a, n).reshape(-1, 9)
    dyads /= np.linalg.norm(dyads, axis=1, keepdims=True)
    tried = np.einsum("pa,mab,pb->mp", dyads, A.reshape(10, 9, 9), dyads, optimize=True).min(axis=1)
    assert (least <= tried).all()
    np.testing.assert_allclose(least, tried, rtol=0.05)


def test_saint_venant_kirchhoff_loses_it_in_compression():
    """F = λI: (3 lambda + 2 mu)(λ² - 1)/2 + λ² mu = 0 for shear waves; the thesis' material."""
    squared = (3 * LAMBDA + 2 * MU) / (3 * LAMBDA + 4 * MU)
    found = losses("saint_venant_kirchhoff", (0.5, 1.5))
    assert found == {"below": pytest.approx(squared**1.5, abs=1e-4)}


def test_neo_hookean_loses_it_in_swelling():
    """F = λI, pressure waves, ν = 0.45 so lambda = 9 mu: 1 + (10 - 9 ln J)/λ² = 0."""
    at = brentq(lambda J: 1 + (10 - 9 * np.log(J)) / J ** (2 / 3), 2.0, 20.0)
    found = losses("neo_hookean", (0.5, 2 * at), poisson=0.45)
    assert found == {"above": pytest.approx(at, rel=1e-3)}


def test_where_there_is_no_tangent_there_is_no_minimum():
    A = np.full((2, 3, 3, 3, 3), np.nan)
    A[0] = np.einsum("ik,jl->ijkl", EYE, EYE)
    least = least_wave_stiffness(A)
    assert least[0] == pytest.approx(1.0)
    assert np.isnan(least[1])
