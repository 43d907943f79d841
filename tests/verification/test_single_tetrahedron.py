"""Single tetrahedra taken back to rest, thesis Table 3: by one inverse solve, and by Sellier.

Independent answers: the drawn shape, differences of the residual by the rest shape, and where a
loaded shape has two rest shapes, forward solves from both.
"""

from __future__ import annotations

import json
from itertools import product

import numpy as np
import pytest

import supple
from supple.cli import main
from supple.studies import single_tetrahedron as single
from supple.studies import single_tetrahedron_run as methods


@pytest.fixture(scope="module")
def samples():
    return single.draw(tetrahedra=2)


def test_the_tests_are_17_shapes_by_3_laws_by_3_loads(samples):
    assert single.TETRAHEDRA * len(single.LAWS) * len(single.LOADS) == 153
    assert [s.number for s in samples] == list(range(18))
    assert [(s.law, s.load) for s in samples] == [*product(single.LAWS, single.LOADS)] * 2
    again = single.draw(tetrahedra=1)
    np.testing.assert_array_equal(again[0].tetrahedron.points, samples[0].tetrahedron.points)
    other = single.draw(seed=2, tetrahedra=1)
    assert not np.array_equal(other[0].tetrahedron.points, samples[0].tetrahedron.points)


def test_what_is_printed_of_the_thesis_is_what_the_references_hold(shared):
    text = (shared / "reference/references.json").read_text(encoding="utf-8")
    printed = json.loads(text)["single_tetrahedron"]
    for name, row in methods.THESIS.items():
        own = printed["inverse_fem" if name == "inverse" else name]
        assert row == tuple(own[key] for key in ("average_error", "simulations", "time_ratio"))
    assert printed["part_II_sellier_failures_in_50_iterations"] == methods.THESIS_FAILURES


def test_laws_have_the_youngs_modulus_and_poissons_ratio_of_the_sample():
    """Slope of uniaxial stress and of lateral strain at rest, on a cube that pulls by 1e-5."""
    for law, values in single.LAWS.items():
        mesh = supple.Mesh.box((1, 1, 1), (1.0, 1.0, 1.0), "Q1")
        body = supple.Body(mesh, law, **values(2e3, 0.3))
        for axis in range(3):
            where = np.flatnonzero(mesh.points[:, axis] == 0)
            body.prescribe(where, np.where(np.arange(3) == axis, 0.0, np.nan))
        pulled = np.flatnonzero(mesh.points[:, 0] == 1)
        state = body.prescribe(pulled, (1e-5, np.nan, np.nan)).solve()
        force = state.reactions[pulled, 0].sum()
        assert force == pytest.approx(2e3 * 1e-5, rel=1e-4), law
        assert state.u[:, 1].min() == pytest.approx(-0.3e-5, rel=1e-4), law


def test_the_drawn_shape_comes_back(samples):
    """To rounding by the inverse; by Sellier's method to its tolerance, with more work."""
    for result in methods.run(samples[1::3]):
        found, size = result.found, np.ptp(result.sample.tetrahedron.points, axis=0).max()
        assert found["inverse"].error <= 1e-14 * size
        sellier, anderson = found["sellier_same_accuracy"], found["anderson_same_accuracy"]
        assert max(sellier.error, anderson.error) <= 1e-12 * size
        assert found["sellier_1e-6"].error <= 1e-6 * size
        assert found["sellier_1e-6"].solves < sellier.solves
        assert found["inverse"].iterations < 0.5 * anderson.iterations


def moved_rest(body, state, d):
    """Free residual (3,) at the same loaded shape from a rest shape whose free node moved by d."""
    points = body.mesh.points + np.outer([0, 0, 0, 1], d)
    other = body.on(body.mesh.moved(points))
    return supple.assemble(other, state.points - points)[1][3]


@pytest.mark.parametrize("number", [2, 5, 8])
def test_the_slope_by_the_rest_shape_is_that_of_differences(samples, number):
    body = samples[number].body()
    state, h = single.loaded_shape(body), 1e-5 * samples[number].tetrahedron.height
    columns = [
        (moved_rest(body, state, d) - moved_rest(body, state, -d)) / (2 * h) for d in h * np.eye(3)
    ]
    assert single.slope_by_rest(body, state) == pytest.approx(
        np.linalg.det(-np.transpose(columns)), rel=1e-6
    )


def test_past_the_fold_a_loaded_shape_has_two_rest_shapes():
    """Why such tetrahedra are drawn again: both shapes go, in stable equilibrium, to the same."""
    points = np.array([[0, 0, 0], [-0.05266367, -0.07307697, -0.63570621],
                       [-0.20480581, -0.29051674, -0.59364953],
                       [-0.19148402, 0.1422479, -0.47090324]])  # fmt: skip
    down = np.array([0.33564012, 0.22295747, -0.91522439])
    shape = single.Tetrahedron(points, 0.23753455, 0.19680175, down)
    body = single.Sample(0, shape, "saint_venant_kirchhoff", 1.0).body()
    state = single.loaded_shape(body)
    unloaded = body.on(body.mesh).gravity((0.0, 0.0, 0.0))
    assert single.slope_by_rest(unloaded, unloaded.solve()) > 0
    assert single.slope_by_rest(body, state) < 0
    rest = body.on(body.mesh.moved(state.points)).rest_shape(rtol=single.RTOL)
    assert abs(rest.points - body.mesh.points).max() > 0.05
    again = body.on(rest.mesh).solve(rtol=single.RTOL)
    assert abs(again.points - state.points).max() < 1e-10


def test_failures_are_counted_and_left_out_of_the_means():
    nan = methods.Found(np.nan, 50, 200, 1.0, "diverges")
    good = methods.Found(1e-13, 10, 40, 0.2)
    inverse = methods.Found(1e-16, 1, 4, 0.1)
    found = [{**dict.fromkeys(methods.METHODS, m), "inverse": inverse} for m in (good, nan)]
    results = [methods.Result(None, 1.0, 1.0, 0.1, methods_found) for methods_found in found]
    rows = {row["method"]: row for row in methods.summary(results)}
    sellier = rows["sellier_same_accuracy"]
    assert (rows["inverse"]["failed"], sellier["solved"], sellier["failed"]) == (0, 1, 1)
    assert (sellier["forward_solves"], sellier["iterations_by_inverse"]) == (10, 10)
    assert sellier["time_by_inverse"] == pytest.approx(2)


@pytest.mark.parametrize(("bar", "code"), [(1e-12, 0), (0.0, 3)])
def test_the_study_writes_tables_and_figures_and_exits_3_beyond_the_bar(
    tmp_path, monkeypatch, bar, code
):
    drawn = single.draw(tetrahedra=1)
    monkeypatch.setattr(single, "draw", lambda seed: drawn)
    monkeypatch.setattr(methods, "BAR", bar)
    assert main(["study", "single-tetrahedron", "--out", str(tmp_path / "out")]) == code
    names = {f"single_tetrahedron{end}" for end in (".csv", "_methods.csv", ".png", ".svg")}
    assert {p.name for p in (tmp_path / "out").iterdir()} == names | {"result.json"}
    found = json.loads((tmp_path / "out" / "result.json").read_text(encoding="utf-8"))
    assert found["tests"] == 9
    assert found["methods"][0]["solved"] == 9


@pytest.mark.slow
def test_all_153_come_back():
    """153 of 153, on average 1e-12 m and in one solve; the thesis' Sellier failed 7 times."""
    results = list(methods.run(single.draw()))
    inverse, _, sellier, anderson = methods.summary(results)
    assert (inverse["solved"], anderson["solved"]) == (153, 153)
    assert inverse["mean_error_m"] <= methods.BAR
    assert inverse["largest_error_m"] <= methods.BAR
    assert sellier["failed"] > 0
    assert sellier["forward_solves"] > 10
