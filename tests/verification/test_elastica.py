"""The heavy elastica: series for small loads, scipy's collocation for large ones, known limits."""

from __future__ import annotations

import numpy as np
import pytest

from supple.studies.elastica import Cantilever, bend, unbend


def bar(load: float, **more: float) -> Cantilever:
    """Of length 1 and E I = 1: the load is w L³ / E I."""
    return Cantilever(1.0, np.full(2, load), np.ones(2), **more)


def test_small_deflections_are_those_of_linear_theory():
    """Drop w L⁴ / 8 E I, angle w L³ / 6 E I; the tip comes nearer by ∫ θ²/2 = (w L³/E I)² / 112."""
    load = 1e-3
    bent = bend(bar(load))
    assert bent.drop[-1] == pytest.approx(load / 8, rel=1e-6)
    assert bent.angle[-1] == pytest.approx(load / 6, rel=1e-6)
    assert -bent.tip[0] == pytest.approx(load**2 / 112, rel=1e-6)


@pytest.mark.parametrize("load", [1.0, 8.333, 30.0])
def test_large_deflections_solve_the_boundary_value_problem(load):
    """scipy's collocation of θ'' = -(w L³/E I)(1 - s) cos θ, θ(0) = 0 = θ'(1), from the root."""
    from scipy.integrate import solve_bvp

    def slope(s, y):
        return np.vstack([y[1], -load * (1 - s) * np.cos(y[0]), np.cos(y[0]), np.sin(y[0])])

    def ends(a, b):
        return np.array([a[0], b[1], a[2], a[3]])

    s = np.linspace(0, 1, 201)
    found = solve_bvp(slope, ends, s, np.vstack([s, 1 - s, s, 0.5 * s]), tol=1e-9, max_nodes=50000)
    assert found.success
    bent = bend(bar(load))
    assert bent.angle == pytest.approx(found.sol(s)[0], abs=1e-7)
    assert [bent.x[-1], bent.drop[-1]] == pytest.approx(found.sol(1.0)[2:], abs=1e-7)


def test_a_bar_too_weak_to_bend_back_hangs_straight_down_but_for_its_root():
    """With l = (E I/W)^(1/2) the root's bend, E I θ'²/2 = W (1 - sin θ), takes (2 - √2) l off."""
    layer = 300**-0.5
    bent = bend(bar(300.0), points=801)
    assert bent.drop[-1] == pytest.approx(1 - (2 - 2**0.5) * layer, abs=layer**2)
    assert bent.angle[-1] == pytest.approx(np.pi / 2, abs=1e-3)


def test_stretch_and_shear_are_added_as_in_linear_theory():
    """A small load w drops the tip by w L²/2 κGA more; it stretches the bar only as it hangs."""
    load, shearing = 1e-4, 50.0
    more = bend(bar(load, shearing=shearing)).drop[-1] - bend(bar(load)).drop[-1]
    assert more == pytest.approx(load / (2 * shearing), rel=1e-5)
    assert bend(bar(load, stretching=shearing)).drop[-1] == pytest.approx(load / 8, rel=1e-6)


def test_a_bar_of_two_halves_drops_as_the_unit_load_says():
    """EI doubled near the root: ∫ M m / EI with M = w (1-s)²/2, m = 1 - s, by hand."""
    bending = np.where(np.linspace(0, 1, 4001) < 0.5, 2.0, 1.0)
    bent = bend(Cantilever(1.0, np.full(4001, 1e-4), bending), points=2001)
    assert bent.drop[-1] == pytest.approx(1e-4 / 8 * ((1 - 1 / 16) / 2 + 1 / 16), rel=1e-3)


def test_unbending_a_bent_bar_gives_the_straight_one():
    bent = bend(bar(8.333), points=801)
    rest = unbend(bar(8.333), bent)
    assert np.abs(rest.drop).max() < 2e-6
    assert rest.x[-1] == pytest.approx(1.0, abs=1e-9)
