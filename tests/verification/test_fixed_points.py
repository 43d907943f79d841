"""Sellier's fixed point and its accelerations: exact rates, and the inverse's rest shape met."""

from __future__ import annotations

import numpy as np
import pytest

import supple
from supple.acceleration import Aitken, Anderson, Relaxation
from supple.choices import FIXED_POINTS as METHODS

YOUNG, AREA, LENGTH = 1e3, 1e-2, 0.5


def bar(stretch):
    """A bar in a stiff tube, drawn to ``stretch`` by a dead force on its end; here as loaded.

    No node moves sideways and ν = 0, so F = diag(1, 1, s) with neo-Hooke's P = E/2 (s - 1/s): the
    end force fixes s whatever the length, and x(X) = s X is linear.
    """
    mesh = supple.Mesh.box((1, 1, 3), (0.1, 0.1, LENGTH), "Q1")
    body = supple.Body(mesh, "neo_hookean", young=YOUNG, poisson=0.0)
    body.prescribe(lambda p: p[:, 0] > -1, (0.0, 0.0, np.nan))
    body.fix(lambda p: p[:, 2] < 1e-9)
    force = YOUNG / 2 * (stretch - 1 / stretch) * AREA
    return body.force(lambda p: p[:, 2] > LENGTH - 1e-9, (0.0, 0.0, force / 4))


def hanging_block(element="P1", formulation="displacement", law="neo_hookean", g=4.0, **values):
    """A soft block held at its side, bent and drawn by its weight."""
    mesh = supple.Mesh.box((2, 2, 2), (0.1, 0.1, 0.1), element)
    values = values or {"young": 1e3, "poisson": 0.3}
    body = supple.Body(mesh, law, formulation, density=1000.0, **values)
    return body.fix(lambda p: p[:, 0] < 1e-9).gravity((g / 2, 0.0, -g))


@pytest.mark.parametrize("relaxation", [1.0, 0.5])
@pytest.mark.parametrize("stretch", [0.6, 1.4, 1.8])
def test_plain_fixed_point_contracts_by_one_minus_the_stretch(stretch, relaxation):
    """X ← X - ω (s X - x): the miss is multiplied by 1 - ω s, and X = x / s is found."""
    rest = bar(stretch).rest_shape(method="sellier", relaxation=relaxation, exact=True)
    rate = abs(1 - relaxation * stretch)
    misses = np.array(rest.misses)
    np.testing.assert_allclose(misses[1:6] / misses[:5], rate, rtol=1e-5)
    expected = int(np.ceil(np.log(1e-9 / misses[0]) / np.log(rate))) + 1
    assert abs(len(misses) - expected) <= 1
    np.testing.assert_allclose(rest.points[:, 2], rest.loaded.points[:, 2] / stretch, atol=1e-9)


def test_plain_fixed_point_fails_beyond_twice_the_length():
    """1 - s < -1 turns the bar inside out; half the step brings it back, acceleration too."""
    body = bar(2.2)
    with pytest.raises(supple.ConvergenceError, match=r"sellier (diverges|stalls)") as caught:
        body.rest_shape(method="sellier")
    misses = [row["miss"] for row in caught.value.history if "miss" in row]
    assert min(misses) > 1e-2
    for how in ({"relaxation": 0.5}, {"method": "sellier-aitken"}, {"method": "sellier-anderson"}):
        rest = body.rest_shape(**({"method": "sellier"} | how))
        np.testing.assert_allclose(rest.points[:, 2], body.mesh.points[:, 2] / 2.2, atol=1e-9)


@pytest.mark.parametrize("method", METHODS[1:])
def test_accelerations_end_where_the_map_is_linear_in_one_number(method):
    """Both are the secant method there: the third solve meets the target."""
    rest = bar(1.7).rest_shape(method=method, exact=True)
    assert rest.solves == 3
    assert rest.misses[2] < 1e-12


@pytest.mark.parametrize("exact", [True, False])
@pytest.mark.parametrize("method", METHODS)
def test_all_methods_arrive_at_the_inverse_rest_shape(method, exact):
    """To 1e-9 of the size, by another equation: direct forms only against the inverse form."""
    body = hanging_block()
    expected = body.rest_shape()
    rest = body.rest_shape(method=method, exact=exact, tolerance=1e-10)
    assert abs(rest.u).max() > 0.1 * body.mesh.size
    assert abs(rest.points - expected.points).max() <= 1e-9 * body.mesh.size
    np.testing.assert_allclose(rest.cauchy(), expected.cauchy(), rtol=0, atol=1e-5)
    np.testing.assert_allclose(rest.reactions, expected.reactions, rtol=0, atol=1e-8)
    assert rest.method == method
    assert rest.solves >= len(rest.misses)
    assert rest.iterations == sum(row["iteration"] > 0 for row in rest.history)


FORMS = {
    "P2 mixed": ("P2", "mixed", "mooney_rivlin"),
    "Q1 mean dilatation": ("Q1", "mean-dilatation", "mooney_rivlin"),
}


@pytest.mark.parametrize("form", FORMS)
def test_other_formulations_arrive_there_too(form):
    element, formulation, law = FORMS[form]
    body = hanging_block(element, formulation, law, g=2.0, c1=200.0, c2=100.0, bulk=1e4)
    expected = body.rest_shape()
    rest = body.rest_shape(method="sellier-anderson", tolerance=1e-10)
    assert abs(rest.points - expected.points).max() <= 1e-9 * body.mesh.size
    if expected.pressure is not None:
        np.testing.assert_allclose(rest.pressure, expected.pressure, rtol=0, atol=1e-4)


def loads(body, name):
    mesh = body.mesh

    def tip(p):
        return p[:, 0] > 0.1 - 1e-9

    if name == "moved supports":
        body.prescribe(tip, (0.01, 0.0, 0.005))
    elif name == "follower pressure":
        body.pressure(tip, 50.0)
    elif name == "traction per loaded area":
        body.traction(tip, (0.0, 30.0, 0.0), per="loaded")
    elif name == "skin":
        body.skin(tip, "neo_hookean", thickness=1e-3, young=2e3)
    elif name == "two laws":
        body.region(np.arange(len(mesh.cells) // 2), "neo_hookean", young=3e3)


@pytest.mark.parametrize("density_of", ["rest", "loaded"])
@pytest.mark.parametrize(
    "load",
    ["moved supports", "follower pressure", "traction per loaded area", "skin", "two laws"],
)
def test_every_load_and_support_that_the_forward_solve_knows(load, density_of):
    """Against the inverse form, 1e-9 of the size, for density at rest and density as loaded."""
    body = hanging_block("Q1", g=2.0)
    loads(body, load)
    expected = body.rest_shape(density_of=density_of)
    rest = body.rest_shape(method="sellier-anderson", density_of=density_of, tolerance=1e-10)
    assert abs(rest.points - expected.points).max() <= 1e-9 * body.mesh.size
    for found in (rest, expected):
        assert supple.round_trip(found).relative <= 1e-9


def test_a_body_that_slides_is_met_by_anderson():
    """A shift of the rest shape into the floor hardly moves the loaded one, so plain steps crawl.

    For the same reason the rest shape is known but for that shift: the stress is the forward one's.
    """
    floor = supple.Surface([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]], [[0, 1, 2], [0, 2, 3]])
    mesh = supple.Mesh.box((2, 2, 2), (0.1, 0.1, 0.1), "Q1")
    body = supple.Body(mesh, "neo_hookean", density=1000.0, young=1e3, poisson=0.3)
    body.slide(lambda p: p[:, 2] < 1e-9, floor, compliance=1e-4)
    for axis in range(2):
        held = np.where(np.arange(3) == axis, 0.0, np.nan)
        body.prescribe(lambda p, axis=axis: p[:, axis] < 1e-9, held)
    state = body.gravity((0.0, 0.0, -4.0)).solve()
    assert abs(state.u).max() > 0.01 * mesh.size
    loaded = body.on(mesh.moved(state.points))
    rest = loaded.rest_shape(method="sellier-anderson", tolerance=1e-10)
    assert supple.round_trip(rest).relative <= 1e-9
    np.testing.assert_allclose(rest.cauchy(), state.cauchy(), rtol=0, atol=1e-5)


def test_anderson_needs_fewer_solves_than_plain_where_plain_is_slow():
    """Near its limit the plain fixed point crawls, and Anderson's needs less than half."""
    body = hanging_block(g=6.0)
    plain, anderson = (body.rest_shape(method=m, exact=True).solves for m in METHODS[::2])
    assert 2 * anderson < plain, (plain, anderson)


def test_failures_say_why_and_leave_the_body_as_it_was():
    """No equilibrium on the loaded shape; too few solves; a growing miss; then as before."""
    body = hanging_block()
    before = body.rest_shape(), body.solve()
    with pytest.raises(supple.ConvergenceError, match="max_solves = 3") as caught:
        body.rest_shape(method="sellier", max_solves=3)
    assert caught.value.history[-1]["solve"] == 3
    body.gravity((0.0, 0.0, -80.0))
    for method in METHODS:
        with pytest.raises(supple.ConvergenceError, match="no rest shape") as caught:
            body.rest_shape(method=method)
        assert caught.value.cause in str(caught.value)
        assert caught.value.history
        assert 0 <= caught.value.load_factor <= 1
    body.gravity((2.0, 0.0, -4.0))
    np.testing.assert_array_equal(body.rest_shape().u, before[0].u)
    np.testing.assert_array_equal(body.solve().u, before[1].u)


def test_wrong_options_are_refused():
    body = hanging_block()
    with pytest.raises(supple.InputError, match="takes no 'depht'"):
        body.rest_shape(method="sellier-anderson", depht=3)
    with pytest.raises(supple.InputError, match="takes no 'depth'"):
        body.rest_shape(depth=3)
    with pytest.raises(supple.InputError, match="relaxation must be above 0"):
        body.rest_shape(method="sellier", relaxation=0.0)


def test_reversed_gravity_misses_by_the_square_of_the_load():
    """A tenth of gravity, a hundredth of the miss; the exact rest shape has none."""
    misses = []
    for g in (0.4, 0.04):
        misses.append(supple.reversed_gravity_error(hanging_block(g=g).rest_shape()))
    assert 80 < misses[0] / misses[1] < 120


@pytest.mark.parametrize(
    "make", [lambda: Aitken(0.5), lambda: Anderson(4), lambda: Relaxation(0.3)]
)
def test_accelerations_solve_linear_maps(make):
    """x = A x + b with eigenvalues of A from -2 to 0.5; plain steps of 1 would run away."""
    rng = np.random.default_rng(0)
    turn = np.linalg.qr(rng.normal(size=(4, 4)))[0]
    A, b = turn @ np.diag([-2.0, -0.5, 0.1, 0.5]) @ turn.T, rng.normal(size=4)
    acceleration, x = make(), np.zeros(4)
    misses = []
    while len(misses) < 400 and (not misses or misses[-1] > 1e-10):
        r = A @ x + b - x
        misses.append(np.linalg.norm(r))
        x = acceleration.step(x, r)
    np.testing.assert_allclose(x, np.linalg.solve(np.eye(4) - A, b), atol=1e-9)
    if isinstance(acceleration, Anderson):
        assert (
            len(misses) <= 7
        )  # GMRES ends in 4 steps, and this with it (Walker and Ni, theorem 2.2)
