"""Conjugate gradients on kept factors find what a factorisation at every iteration finds."""

from __future__ import annotations

import numpy as np
import pytest

import supple
from supple import solvers

LENGTH = 0.2


def beam(element="P1", cells=(12, 2, 2), width=0.02, g=2.0, law="neo_hookean", **values):
    """Clamped at x = 0, it hangs down by its own weight."""
    mesh = supple.Mesh.box(cells, (LENGTH, width, width), element)
    values = {"young": 1e5, "poisson": 0.3} | values
    body = supple.Body(mesh, law, density=1000.0, **values)
    return body.fix(lambda p: p[:, 0] < 1e-9).gravity((0.0, 0.0, -g))


def assert_same(kept, direct):
    """Displacements to 1e-9 of the length, residual below the tolerance asked for."""
    last = kept.history[-1]
    assert last["residual"] <= last["tolerance"]
    assert abs(kept.u - direct.u).max() <= 1e-9 * LENGTH


@pytest.mark.parametrize(
    ("element", "cells", "width", "g", "values"),
    [
        pytest.param("P1", (12, 2, 2), 0.02, 3.0, {}, id="slender"),
        pytest.param("Q1", (4, 4, 4), 0.2, 60.0, {}, id="blocky"),
        pytest.param("Q2", (6, 2, 2), 0.06, 10.0, {"poisson": 0.499}, id="nearly incompressible"),
        pytest.param("Q2", (6, 1, 1), 0.03, 4.0, {}, id="Q2"),
    ],
)
def test_answer_is_that_of_a_factorisation_at_every_iteration(element, cells, width, g, values):
    """Bodies that bend, are squeezed, keep their volume: the same state, on fewer factors."""
    body = beam(element, cells, width, g, **values)
    direct, kept = body.solve(solver="direct"), body.solve(solver="cg")
    assert abs(direct.u).max() > 0.05 * LENGTH
    assert_same(kept, direct)
    assert direct.timings["krylov_iterations"] == 0 < kept.timings["krylov_iterations"]
    assert kept.timings["factorisations"] < direct.timings["factorisations"]


def test_twenty_changes_of_parameters_need_few_factors():
    """Each of twenty stiffnesses and Poisson's ratios, up to 30 % apart: as a new body has it."""
    body, random = beam(), np.random.default_rng(0)
    body.solve(solver="cg")
    factorisations = iterations = 0
    for _ in range(20):
        values = {"young": random.uniform(0.8e5, 1.2e5), "poisson": random.uniform(0.2, 0.4)}
        state = body.set(**values).solve(solver="cg")
        factorisations += int(state.timings["factorisations"])
        iterations += state.iterations
        assert_same(state, beam(**values).solve(solver="direct"))
    assert 4 * factorisations <= iterations


def test_path_finds_the_factors_of_both_its_ends():
    """After a path that went far, neither its end nor its beginning wants another factor.

    The far end's alone would not serve at the beginning: there a new body's own beginning, where
    one factor and no iteration but its rounding's is needed, sets what is few.
    """
    body, light, end = beam(), (0.0, 0.0, -2e-3), (0.0, 0.0, -2.0)
    far = body.solve(solver="cg")
    assert abs(far.u).max() > 0.1 * LENGTH
    near = body.gravity(light).solve(solver="cg")
    again = body.gravity(end).solve(solver="cg")
    assert near.timings["factorisations"] == again.timings["factorisations"] == 0
    fresh = beam().gravity(light).solve(solver="cg")
    assert near.timings["krylov_iterations"] <= fresh.timings["krylov_iterations"]
    assert_same(near, fresh)
    assert_same(again, beam().solve(solver="direct"))


def test_other_loads_and_supports_are_met_with_what_is_kept():
    """Gravity the other way and a moved support, after a factor was kept for neither."""
    body = beam()
    body.solve(solver="cg")
    body.gravity((0.0, 2.0, 0.0))
    assert_same(body.solve(solver="cg"), body.solve(solver="direct"))
    body.prescribe(lambda p: p[:, 0] < 1e-9, (0.0, 0.01, 0.0))
    assert_same(body.solve(solver="cg"), body.solve(solver="direct"))


def test_direct_solves_do_not_depend_on_what_was_solved_before():
    """To the last bit, on one thread's order of sums."""
    body = beam()
    before = body.solve(solver="direct").u
    body.set(young=2e5).solve(solver="cg")
    after = body.set(young=1e5).solve(solver="direct").u
    np.testing.assert_array_equal(after, before)


def test_column_that_buckles_is_refused_though_its_kept_factor_is_definite():
    """Euler's column: no force of the straight one has a part in the mode in which it buckles.

    The factor kept from 0.9 of Euler's load preconditions the iterations at 4 of it; they alone,
    begun from the residual, would never leave the symmetric displacements.
    """
    width, length, young = 0.01, 0.2, 1e6
    mesh = supple.Mesh.box((2, 2, 10), (width, width, length), "Q2")
    body = supple.Body(mesh, "neo_hookean", young=young, poisson=0.0)
    body.fix(lambda p: p[:, 2] < 1e-9)
    euler = np.pi**2 * young * (width**4 / 12) / (2 * length) ** 2
    body.traction(lambda p: p[:, 2] > length - 1e-9, (0.0, 0.0, -0.9 * euler / width**2))
    assert abs(body.solve(solver="cg").u[:, :2]).max() < 1e-9
    body.set(young=0.9 / 4 * young)
    refusals = []
    for solver in ("cg", "direct"):
        with pytest.raises(supple.ConvergenceError, match="unstable") as caught:
            body.solve(solver=solver)
        refusals.append(caught.value.cause)  # the worst cells are alike by symmetry
    assert refusals[0] == refusals[1]


def test_unknown_solver_is_refused_with_the_names_that_there_are():
    """One sentence with what was given."""
    with pytest.raises(supple.InputError, match=r'"auto", "direct", "cg"'):
        beam().solve(solver="lu")


def test_auto_says_what_it_took_and_why():
    """A small body is factorised, one with an unsymmetric tangent always."""
    assert beam().solve().timings["solver"].startswith("direct: a factor of ")
    follower = beam().pressure(lambda p: p[:, 2] > 0.02 - 1e-9, 1.0)
    assert follower.solve(solver="cg").timings["solver"].startswith("direct: only tangents")


def test_only_multigrid_that_auto_took_gives_way_to_factors():
    """Where no equilibrium was found: not what was asked for, nor a factor past the memory."""
    grid = solvers.Pick("multigrid", "")
    other = solvers.behind(grid, "auto", 50_000)
    assert other is not None
    assert other.name == "cg"
    assert solvers.behind(grid, "multigrid", 50_000) is None
    assert solvers.behind(grid, "auto", 5_000_000) is None
    assert solvers.behind(other, "auto", 50_000) is None
