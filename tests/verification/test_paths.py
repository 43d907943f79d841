"""Paths of equilibria past their limit points: closed forms of one unknown, stability, time."""

from __future__ import annotations

from contextlib import suppress
from time import process_time

import numpy as np
import pytest

import supple
from supple import newton
from supple.core import core
from supple.rest_shape import Judge

YOUNG, POISSON, STIFFENING = 1e3, 0.3, 0.02
MU = YOUNG / (2 + 2 * POISSON)
LAMBDA = YOUNG * POISSON / ((1 + POISSON) * (1 - 2 * POISSON))
STRETCHES = np.linspace(1, 4, 600001)

LAW = f'''"""Neo-Hookean that stiffens with volume."""
from supple.energy import Kinematics, Pa, Ratio, lame, ln

def psi(k: Kinematics, young: Pa = 1e3, poisson: Ratio = 0.3):
    mu, lmbda = lame(young, poisson)
    soft = mu / 2 * (k.I1 - 3) - mu * ln(k.J) + lmbda / 2 * ln(k.J) ** 2
    return soft + young * {STIFFENING / YOUNG / 4!r} * (k.J - 1) ** 4
'''


def tension(s, stiffening=0.0):
    """Cauchy stress under equal stretches s of soft + a/4 (J - 1)⁴, J = s³."""
    soft = (MU * (s**2 - 1) + 3 * LAMBDA * np.log(s)) / s**3
    return soft + stiffening * (s**3 - 1) ** 3


def cube(load, law="neo_hookean", element="Q1", cells=2):
    """A cube on rollers drawn out by a suction that follows it: uniform, of one unknown."""
    mesh = supple.Mesh.box((cells,) * 3, (1.0, 1.0, 1.0), element)
    body = supple.Body(mesh, law, young=YOUNG, poisson=POISSON)
    body.prescribe(np.arange(len(mesh.points)), np.where(mesh.points < 1e-9, 0.0, np.nan))
    for axis in range(3):
        body.pressure(lambda p, axis=axis: p[:, axis] > 1 - 1e-9, -load)
    return body


def beam(young, cells=(12, 2, 2)):
    """A beam that is straight and level under its own weight; its rest shape curls up."""
    mesh = supple.Mesh.box(cells, (0.2, 0.04, 0.04), "P1")
    body = supple.Body(mesh, "neo_hookean", density=1000.0, young=young, poisson=0.45)
    return body.fix(lambda p: p[:, 0] < 1e-9).gravity((0.0, 0.0, -9.81))


def solve(body, inverse):
    return body.rest_shape() if inverse else body.solve()


@pytest.fixture
def follow(monkeypatch):
    """The path from the start, where Newton's method might jump to its end at once."""
    original = newton.solve

    def followed(system, start, prescribed, native, settings, judge=None):
        native.follow = True
        return original(system, start, prescribed, native, settings, judge)

    monkeypatch.setattr(newton, "solve", followed)


@pytest.mark.parametrize("inverse", [False, True])
@pytest.mark.parametrize("share", [1.1, 2.0, 5.0])
def test_the_largest_load_is_known_to_a_thousandth(share, inverse):
    """The maximum of σ(s) = (μ (s² - 1) + 3 λ ln s) / s³, and the stretch that it belongs to."""
    values = tension(STRETCHES)
    with pytest.raises(supple.ConvergenceError, match="limit point") as caught:
        solve(cube(share * values.max()), inverse)
    assert caught.value.load_factor == pytest.approx(1 / share, rel=1e-3)
    assert caught.value.load_factor <= 1 / share + 1e-9
    edge = np.ptp(caught.value.points, axis=0)
    stretch = STRETCHES[values.argmax()]
    np.testing.assert_allclose(edge, 1 / stretch if inverse else stretch, rtol=2e-2)


@pytest.mark.parametrize("inverse", [False, True])
def test_a_path_that_turns_back_is_followed_to_the_whole_load(inverse, follow, tmp_path):
    """σ(s) rises, falls and rises again: the root beyond both limit points, which is told of."""
    (tmp_path / "stiffening.py").write_text(LAW, encoding="utf-8")
    values = tension(STRETCHES, STIFFENING)
    top = np.flatnonzero((values[1:-1] > values[2:]) & (values[1:-1] > values[:-2]))[0] + 1
    load = 1.15 * values[top]
    root = STRETCHES[np.flatnonzero(values > load)[0]]
    found = solve(cube(load, tmp_path / "stiffening.py"), inverse)
    F = found.deformation_gradient()
    np.testing.assert_allclose(F, np.broadcast_to(root * np.eye(3), F.shape), atol=2e-5)
    (warning,) = found.warnings
    told = float(warning.split("limit point at ")[1].split(" %")[0])
    assert told == pytest.approx(100 / 1.15, rel=1e-3)
    assert min(h["load_factor"] for h in found.history[5:]) < 0.98 / 1.15


def test_a_path_followed_gives_what_newton_gives_at_once(follow):
    """Where both can: a leaning block, forward and back, to solver tolerance."""
    mesh = supple.Mesh.box((2, 2, 4), (0.1, 0.1, 0.2), "P1")
    body = supple.Body(mesh, "neo_hookean", density=1000.0, young=2e3, poisson=0.4)
    body.fix(lambda p: p[:, 2] < 1e-9).gravity((2.0, 0.0, 3.0))
    rest = body.rest_shape()
    assert len({h["load_factor"] for h in rest.history}) > 3
    again = body.on(rest.mesh).solve()
    assert abs(again.points - mesh.points).max() <= 1e-9 * mesh.size


def test_a_rest_shape_that_would_not_bear_the_load_is_refused(monkeypatch):
    """At the given shape K has no negative eigenvalue (numpy) under the load that is told, and one
    or more under the whole."""
    body = beam(2e4)
    with pytest.raises(supple.ConvergenceError, match="unstable") as caught:
        body.rest_shape()
    reached = caught.value.load_factor
    assert 0.2 < reached < 1
    light = beam(2e4).gravity((0.0, 0.0, -9.81 * reached))
    rest = light.rest_shape()
    np.testing.assert_allclose(rest.points, caught.value.points, atol=1e-4 * body.mesh.size)
    assert lowest_eigenvalue(light, rest) > 0
    monkeypatch.setattr(Judge, "__call__", lambda *_: core().Outcome.converged)
    assert lowest_eigenvalue(body, body.rest_shape()) < 0


def lowest_eigenvalue(body, rest):
    """Of the free part of K where the body on its rest shape is loaded into the given one."""
    free = np.flatnonzero(body.mesh.points[:, 0] > 1e-9)
    dofs = (3 * free[:, None] + np.arange(3)).ravel()
    K = supple.assemble(body.on(rest.mesh), -rest.u)[2].toarray()
    return np.linalg.eigvalsh(K[np.ix_(dofs, dofs)])[0]


def seconds(attempt):
    """Least CPU time of three runs; what fails is no error here."""
    times = []
    for _ in range(3):
        start = process_time()
        with suppress(supple.ConvergenceError):
            attempt()
        times.append(process_time() - start)
    return min(times)


@pytest.mark.slow
@pytest.mark.parametrize("share", [1.1, 2.0])
def test_a_load_without_a_rest_shape_fails_in_three_times_a_good_search(share):
    """Against nine tenths of the largest, on a cube of 1,331 nodes, all built anew."""
    largest = tension(STRETCHES).max()
    good = seconds(lambda: solve(cube(0.9 * largest, "neo_hookean", "P1", 10), True))
    bad = seconds(lambda: solve(cube(share * largest, "neo_hookean", "P1", 10), True))
    assert bad <= 3 * good


@pytest.mark.slow
def test_a_beam_too_soft_fails_in_three_times_a_good_solve():
    """45 kPa is the softest that is stable when level, by 5 %; 20 kPa bear half of the load.

    Counted in residuals and tangents: of 30 ms a machine's clock makes what it likes.
    """
    cells = (20, 4, 4)
    good = beam(4.5e4, cells).rest_shape()
    with pytest.raises(supple.ConvergenceError) as failed:
        beam(2e4, cells).rest_shape()
    assert len(failed.value.history) <= 3 * len(good.history)
