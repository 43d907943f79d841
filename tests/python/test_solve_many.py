"""Many solves at once are the solves one by one: same order, same answers, any processes."""

from __future__ import annotations

import pickle
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import supple
from supple import Body, ConvergenceError, Mesh, SuppleError

#: Functions that another process can import.
HELPERS = """
import os, signal

def sag(state):
    return float(state.u[:, 2].min())

def killed_if_soft(state):
    if state.u[:, 2].min() < -0.1:
        os.kill(os.getpid(), signal.SIGKILL)
    return sag(state)

def pushed(body, newton):
    body.clear_loads().force(lambda p: p[:, 0] > 0.399, (0.0, 0.0, newton))

def squeezed(body, metre):
    body.prescribe(lambda p: p[:, 0] > 0.399, (metre, 0.0, 0.0))
"""
#: Processes, of which starting more takes seconds.
COUNTS = [1, pytest.param(2, marks=pytest.mark.slow)]
YOUNGS = np.linspace(8e3, 16e3, 7)


def body(skin: bool = False) -> Body:
    mesh = Mesh.box((8, 2, 2), (0.4, 0.1, 0.1), "P1")
    half = supple.Tag("cells", np.flatnonzero(mesh.points[mesh.cells].mean(axis=1)[:, 0] > 0.2))
    mesh = Mesh(mesh.points, mesh.cells, "P1", {"far": half})
    made = Body(mesh, "neo_hookean", young=1e4, poisson=0.3, density=30.0)
    made.fix(lambda p: p[:, 0] < 1e-9).gravity((0.0, 0.0, -9.81))
    if skin:
        made.skin(lambda p: p[:, 2] < 1e-9, "neo_hookean", 1e-3, young=1e4)
    return made


def one_by_one() -> list[np.ndarray]:
    return [body().set(young=y).solve().u for y in YOUNGS]


@pytest.mark.parametrize("processes", COUNTS)
def test_cold_solves_are_those_one_by_one_to_the_last_bit(processes: int) -> None:
    """In both orders: nothing is left in a process that changes the next answer."""
    expected, entries = one_by_one(), [{"young": y} for y in YOUNGS]
    for order in (slice(None), slice(None, None, -1)):
        found = body().solve_many(entries[order], processes, warm=False)
        for state, u in zip(found, expected[order], strict=True):
            assert np.array_equal(state.u, u)


@pytest.mark.parametrize("processes", [None, *COUNTS])
def test_warm_solves_meet_the_cold_ones_to_the_tolerance_in_fewer_iterations(
    processes: int | None,
) -> None:
    """Moduli a hundredth apart: from those further off Newton needs as many as from zero."""
    entries = [{"young": young} for young in np.linspace(9.7e3, 1.03e4, 7)]
    found = body().solve_many(entries, processes)
    cold = body().solve_many(entries, processes=1, warm=False)
    for state, alone in zip(found, cold, strict=True):
        assert np.abs(state.u - alone.u).max() <= 1e-8 * state.mesh.size
    assert sum(s.iterations for s in found) < sum(s.iterations for s in cold)


def test_states_from_workers_have_mesh_and_laws_again() -> None:
    """Reactions carry the weight, stresses are those of a body of the entry's own."""
    given = body()
    entries: list[dict[str, Any]] = [{"young": 1.5e4}, {"young": np.linspace(1e4, 2e4, 192)}]
    for entry, state in zip(entries, given.solve_many(entries, 2), strict=True):
        alone = body().set(**entry).solve()
        assert state.mesh is given.mesh
        assert np.allclose(state.von_mises(), alone.von_mises(), rtol=1e-6)
        assert state.reactions.sum(axis=0)[2] == pytest.approx(9.81 * 30 * 0.004)


def test_each_name_of_an_entry_is_what_it_says() -> None:
    entries = [{"far.young": 2e4, "poisson": 0.4}, {"skin.young": 1e5},
               {"gravity": (0.0, 9.81, 0.0)}, {}]  # fmt: skip
    expected = [
        body(True).set("far", young=2e4).set(poisson=0.4), body(True).set_skin(young=1e5),
        body(True).gravity((0.0, 9.81, 0.0)), body(True),
    ]  # fmt: skip
    for state, one in zip(body(True).solve_many(entries), expected, strict=True):
        assert np.allclose(state.u, one.solve().u, rtol=0, atol=1e-8 * one.mesh.size)


def test_bodies_states_and_rest_shapes_go_to_other_processes_whole() -> None:
    """Through pickle, as any pool of processes sends them: laws, skins, supports, loads."""
    plane = supple.Surface(np.array([[-1.0, -1, 0], [1, -1, 0], [0, 2, 0]]), np.array([[0, 1, 2]]))
    given = body(skin=True).slide(lambda p: p[:, 2] < 1e-9, plane)
    state, rest = given.solve(), body().rest_shape()
    again, state_again, rest_again = pickle.loads(pickle.dumps((given, state, rest)))
    assert np.array_equal(again.solve().u, state.u)
    assert np.array_equal(state_again.cauchy(), state.cauchy())
    assert np.array_equal(rest_again.body().solve().u, rest.body().solve().u)


def test_the_body_stays_as_it_is() -> None:
    given = body()
    before = given.solve()
    given.solve_many([{"young": 1e4, "gravity": (0.0, 0.0, 9.81)}, {"poisson": 0.1}])
    assert np.array_equal(given.solve().u, before.u)


def test_wrong_entries_are_refused_by_their_number_before_anything_is_solved() -> None:
    def solved(_done: int, _total: int) -> None:
        pytest.fail("something was solved")

    for entry in ({"yuong": 1e3}, {"young": -1.0}, {"nowhere.young": 1e3}, 1e3):
        with pytest.raises(supple.InputError, match=r"^parameters\[1\]: "):
            body().solve_many([{"young": 1e4}, entry], progress=solved)
    for wrong in (0, "2", 1.5, True):
        with pytest.raises(supple.InputError, match="processes must be at least 1"):
            body().solve_many([], processes=wrong)
    with pytest.raises(supple.InputError, match="rtoll is no setting"):
        body().solve_many([], rtoll=1e-3)
    assert body().solve_many([]) == []


@pytest.fixture
def helpers(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Any:
    """The module of `HELPERS`, which other processes find."""
    import importlib

    (tmp_path / "solve_many_helpers.py").write_text(HELPERS, encoding="utf-8")
    monkeypatch.syspath_prepend(tmp_path)
    return importlib.import_module("solve_many_helpers")


def test_only_what_is_reduced_comes_back_and_progress_counts_it(helpers: Any) -> None:
    entries, seen = [{"young": y} for y in YOUNGS], list[tuple[int, int]]()
    found = body().solve_many(entries, 2, reduce=helpers.sag,
                              progress=lambda *at: seen.append(at))  # fmt: skip
    assert found == pytest.approx([u[:, 2].min() for u in one_by_one()], rel=1e-6)
    assert seen == [(k + 1, len(YOUNGS)) for k in range(len(YOUNGS))]
    with pytest.raises(supple.InputError, match="top of a file"):
        body().solve_many(entries, 2, reduce=lambda s: s.energy)


@pytest.mark.parametrize("processes", COUNTS)
def test_changes_of_structure_and_of_loads_go_through_a_function(
    helpers: Any, processes: int
) -> None:
    """New loads are new terms: a system made for one entry must not serve the next."""
    forces = [-0.002, 0.001, -0.001]
    found = body().solve_many(forces, processes, change=helpers.pushed)
    for force, state in zip(forces, found, strict=True):
        count = int((state.mesh.points[:, 0] > 0.399).sum())
        assert state.reactions.sum(axis=0)[2] == pytest.approx(-count * force)


@pytest.mark.parametrize("processes", COUNTS)
def test_what_has_no_equilibrium_is_an_error_in_its_place(helpers: Any, processes: int) -> None:
    """An end pushed through the other inverts cells whatever the law; the others are solved."""
    first, error, last = body().solve_many([-0.01, -0.41, 0.01], processes, change=helpers.squeezed)
    assert isinstance(error, ConvergenceError)
    assert 0 < error.load_factor < 1
    assert error.history
    assert [s.u[:, 0].min() for s in (first, last)] == pytest.approx([-0.01, 0.0], abs=2e-3)


def test_a_worker_that_is_killed_costs_its_entry_alone(helpers: Any) -> None:
    entries = [{"young": y} for y in (1e4, 3e3, 1.5e4, 2e4)]
    sags = [float(body().set(**e).solve().u[:, 2].min()) for e in entries]
    assert [sag < -0.1 for sag in sags] == [False, True, False, False]
    found = body().solve_many(entries, 2, reduce=helpers.killed_if_soft)
    assert isinstance(found[1], SuppleError)
    assert "parameters[1]" in str(found[1])
    assert "memory" in str(found[1])
    del found[1], sags[1]
    assert found == pytest.approx(sags, rel=1e-6)
