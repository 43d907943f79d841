"""Fibres seen in the loaded shape: their directions at rest are found with the rest shape."""

from __future__ import annotations

import numpy as np
import pytest

import supple
from supple import directions

pytestmark = pytest.mark.usefixtures("quick_compiler")
EDGE = 0.1
#: law, element, formulation, traction in Pa: strains of 20 to 40 %, fibres that turn by 4 to 10°.
CASES = [
    ("holzapfel_ogden", "P1", "displacement", 300.0),
    ("guccione", "P1", "displacement", 600.0),
    pytest.param("guccione", "Q1", "mean-dilatation", 600.0, marks=pytest.mark.slow),
    pytest.param("fung_orthotropic", "Q2", "displacement", 800.0, marks=pytest.mark.slow),
    pytest.param("holzapfel_gasser_ogden", "P2", "mixed", 1500.0, marks=pytest.mark.slow),
    pytest.param("holzapfel_gasser_ogden", "P2", "displacement", 1500.0, marks=pytest.mark.slow),
    pytest.param("hooke_orthotropic", "Q1", "displacement", 300.0, marks=pytest.mark.slow),
    pytest.param("costa", "Q2L", "mixed", 1500.0, marks=pytest.mark.slow),
    pytest.param(
        "transversely_isotropic_mooney_rivlin", "P1", "displacement", 8e5, marks=pytest.mark.slow
    ),
    pytest.param("holzapfel_ogden_printed", "Q1", "mean-dilatation", 5e5, marks=pytest.mark.slow),
]
every_case = pytest.mark.parametrize(("law", "element", "formulation", "traction"), CASES)


def names(law):
    return [p.name for p in supple.material(law).parameters if p.kind.size > 1]


def fibrous(law, element, formulation, traction):
    """A block held at its base, its fibres another in each cell; gravity and a traction bend it."""
    count = (2, 2, 2) if element in ("P1", "Q1") else (1, 1, 2)
    size = (EDGE * count[0] / 2, EDGE * count[1] / 2, EDGE)
    mesh = supple.Mesh.box(count, size, element)
    x = np.linspace(0, 1, len(mesh.cells))
    row = np.column_stack([1 - 0.5 * x, 0.5 * x, x])
    body = supple.Body(mesh, law, formulation, density=1000.0)
    body.set(**{name: np.roll(row, k, axis=1) for k, name in enumerate(names(law))})
    body.fix(lambda p: p[:, 2] < 1e-9).gravity((0.0, traction / 200, traction / 100))
    return body.traction(lambda p: p[:, 2] > EDGE - 1e-9, (0.3 * traction, 0.0, traction))


def given(body):
    """The directions as the body has them, name → (c, 3)."""
    return {name: body._description.regions[0].values[name] for name in names_of(body)}


def names_of(body):
    return names(body._description.regions[0].law.name)


def largest_turn(one, other):
    """rad, of all directions of two tables."""
    return max(np.linalg.norm(one[name] - other[name], axis=1).max() for name in one)


@every_case
def test_loaded_fibres_lead_back_to_the_rest_shape_and_its_fibres(
    law, element, formulation, traction
):
    """rest_shape(directions_of="loaded") ∘ solve = identity of places and directions, to 1e-9."""
    body = fibrous(law, element, formulation, traction)
    state = body.solve()
    seen = state.directions("loaded")
    assert largest_turn(seen, given(body)) > np.radians(3)
    loaded = body.on(state.mesh.moved(state.points)).set(**seen)
    rest = loaded.rest_shape(directions_of="loaded")
    assert abs(rest.points - body.mesh.points).max() <= 1e-9 * body.mesh.size
    assert largest_turn(rest.directions(), given(body)) <= 1e-9
    np.testing.assert_allclose(
        rest.cauchy(), state.cauchy(), rtol=0, atol=1e-8 * abs(state.cauchy()).max()
    )


@every_case
def test_the_body_at_rest_loads_back_to_shape_and_fibres(law, element, formulation, traction):
    """solve ∘ rest_shape = identity, and under load the fibres lie as given."""
    body = fibrous(law, element, formulation, 0.6 * traction)
    rest = body.rest_shape(directions_of="loaded")
    assert largest_turn(rest.directions(), given(body)) > np.radians(1)
    again = rest.body().solve()
    assert abs(again.points - body.mesh.points).max() <= 1e-9 * body.mesh.size
    assert largest_turn(rest.directions("loaded"), given(body)) <= directions.ROUNDING
    assert largest_turn(again.directions("loaded"), given(body)) <= 1e-9


def test_forward_solves_alone_find_the_fibres_at_rest_too():
    """Anderson–Sellier, exact to its own tolerance, against the inverse form."""
    body = fibrous("holzapfel_gasser_ogden", "P1", "displacement", 800.0)
    exact = body.rest_shape(directions_of="loaded")
    rest = body.rest_shape("sellier-anderson", directions_of="loaded", tolerance=1e-9)
    assert abs(rest.points - exact.points).max() <= 1e-8 * body.mesh.size
    assert 0 < largest_turn(rest.directions(), exact.directions()) <= 1e-7


def test_crossed_fibres_of_a_pulled_strip_stand_wider_apart_at_rest():
    """tan β0 = (λ1/λ2) tan β, β from the axis of the pull; lengths of the rest shape give λ."""
    mesh = supple.Mesh.box((1, 1, 1), (0.2, 0.1, 0.05), "P1")
    beta = np.radians(40.0)
    fibre = [(np.cos(beta), sign * np.sin(beta), 0.0) for sign in (1, -1)]
    body = supple.Body(mesh, "holzapfel_gasser_ogden", fibre1=fibre[0], fibre2=fibre[1])
    body.prescribe(np.arange(8), np.where(mesh.points < 1e-9, 0.0, np.nan))
    body.traction(lambda p: p[:, 0] > 0.2 - 1e-9, (3e3, 0.0, 0.0))
    rest = body.rest_shape(directions_of="loaded")
    stretch = np.array([0.2, 0.1, 0.05]) / np.ptp(rest.points, axis=0)
    assert stretch[0] > 1.2
    at_rest = np.arctan(stretch[0] / stretch[1] * np.tan(beta))
    for name, sign in (("fibre1", 1), ("fibre2", -1)):
        expected = [np.cos(at_rest), sign * np.sin(at_rest), 0.0]
        np.testing.assert_allclose(rest.directions()[name][0], expected, rtol=0, atol=1e-11)


def test_a_sheet_goes_back_with_its_plane():
    """Axes that the law makes at rest span the lines of matter that f and s span under load."""
    body = fibrous("holzapfel_ogden", "P1", "displacement", 180.0)
    rest = body.rest_shape(directions_of="loaded")
    F, found, seen = rest.deformation_gradient(), rest.directions(), given(body)
    f, s = found["fibre"], found["sheet"]
    across = s - (f * s).sum(axis=1, keepdims=True) * f
    normal = np.cross(seen["fibre"], seen["sheet"])
    for line in (f, across):
        moved = np.einsum("cij,cj->ci", F, line)
        assert abs((moved * normal).sum(axis=1)).max() < 1e-11


def test_directions_at_rest_are_the_default():
    """As given, they are those of the rest shape: the trip closes without looking at the turn."""
    body = fibrous("holzapfel_ogden", "P1", "displacement", 300.0)
    state = body.solve()
    rest = body.on(state.mesh.moved(state.points)).rest_shape()
    assert abs(rest.points - body.mesh.points).max() <= 1e-9 * body.mesh.size
    assert largest_turn(rest.directions(), given(body)) < 1e-15
    assert largest_turn(rest.directions("loaded"), state.directions("loaded")) < 1e-9


def test_of_two_laws_only_one_has_fibres():
    """Cells of the other have none (NaN); places and fibres go there and back."""
    body = fibrous("holzapfel_ogden", "P1", "displacement", 200.0)
    soft = np.arange(20)
    body.region(soft, "neo_hookean", young=2e3, poisson=0.4)
    state = body.solve()
    seen = state.directions("loaded")
    assert np.isnan(seen["fibre"][soft]).all()
    loaded = body.on(state.mesh.moved(state.points))
    stiff = np.arange(20, 48)
    loaded.set(where=stiff, **{name: value[stiff] for name, value in seen.items()})
    rest = loaded.rest_shape(directions_of="loaded")
    assert abs(rest.points - body.mesh.points).max() <= 1e-9 * body.mesh.size
    again = rest.body().solve()
    assert abs(again.points - state.points).max() <= 1e-9 * body.mesh.size


def test_a_body_without_directions_has_the_same_rest_shape_either_way():
    body = supple.Body(supple.Mesh.box((2, 2, 2), (EDGE,) * 3), "neo_hookean", density=1000.0)
    body.fix(lambda p: p[:, 2] < 1e-9).gravity((0.0, 1.0, 2.0))
    one, other = (body.rest_shape(directions_of=of) for of in ("rest", "loaded"))
    assert abs(one.u - other.u).max() == 0.0
    assert one.directions("loaded") == {}


def test_reversed_gravity_reads_the_loaded_fibres_as_they_are():
    """Near the exact answer at first order: ten times less load, a hundred times less difference.

    Its reference is the loaded shape, so fibres of that shape need no search.
    """
    differences = []
    for load in (2.0, 0.2):
        body = fibrous("guccione", "P1", "displacement", load)
        exact = body.rest_shape(directions_of="loaded")
        rough = body.rest_shape(method="reversed-gravity", directions_of="loaded")
        turn = largest_turn(exact.directions(), rough.directions())
        assert largest_turn(rough.directions(), given(body)) > 10 * turn
        differences.append((abs(exact.points - rough.points).max(), turn))
    ratios = np.divide(*differences)
    assert (ratios > 80).all(), ratios
    assert (ratios < 120).all(), ratios


def test_a_start_brings_its_directions_along():
    """From its own answer nothing is left to do but to see so."""
    body = fibrous("guccione", "P1", "displacement", 300.0)
    rest = body.rest_shape(directions_of="loaded")
    again = body.rest_shape(directions_of="loaded", start=rest)
    assert again.iterations <= 2 < rest.iterations
    assert largest_turn(rest.directions(), again.directions()) < 1e-11


def test_the_body_keeps_the_directions_that_it_was_given():
    """The search leaves no trace in the body: its own values, and the same solve afterwards."""
    body = fibrous("guccione", "P1", "displacement", 300.0)
    before, state = given(body), body.solve()
    body.rest_shape(directions_of="loaded")
    assert largest_turn(given(body), before) == 0.0
    assert abs(body.solve().u - state.u).max() == 0.0


def test_directions_that_do_not_settle_are_an_error(monkeypatch):
    """With its cause, the turn that is left, and what else could be tried."""
    monkeypatch.setattr(directions, "_PATIENCE", 3)
    body = fibrous("guccione", "P1", "displacement", 300.0)
    with pytest.raises(supple.ConvergenceError, match="still turn by") as caught:
        body.rest_shape(directions_of="loaded")
    assert "directions at rest do not settle" in caught.value.cause
    assert len(caught.value.history) == 3
    turns = [step["turn"] for step in caught.value.history]
    assert turns[0] > turns[1] > turns[2] > directions.SETTLED


def test_a_word_that_names_no_state_is_refused():
    body = fibrous("guccione", "P1", "displacement", 300.0)
    with pytest.raises(supple.InputError, match="directions_of must be"):
        body.rest_shape(directions_of="deformed")
    with pytest.raises(supple.InputError, match="of must be"):
        body.solve().directions("deformed")


def test_a_skin_with_directions_is_refused():
    """A membrane's frame is its own, so a direction would mean nothing, at rest or loaded."""
    body = supple.Body(supple.Mesh.box((1, 1, 1), (EDGE,) * 3), "neo_hookean")
    with pytest.raises(supple.MaterialError, match="guccione has a direction, fibre"):
        body.skin(lambda p: p[:, 0] > -1, "guccione", thickness=1e-3)
