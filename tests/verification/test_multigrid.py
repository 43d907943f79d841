"""Multigrid against direct factors, and the properties that its convergence rests on."""

import numpy as np
import pytest

import supple
from supple import multigrid
from supple.core import core

pytest.importorskip("pyamg", reason="extra multigrid")


def block(element="P1", cells=5, poisson=0.3):
    """A leaning block, strained by about a quarter."""
    mesh = supple.Mesh.box((cells,) * 3, (0.1, 0.1, 0.1), element)
    body = supple.Body(mesh, "neo_hookean", density=1000.0, young=3e3, poisson=poisson)
    return body.fix(lambda p: p[:, 2] < 1e-9).gravity((1.5, 0.0, -3.0))


def hierarchy(body, shift=0.0):
    """Multigrid of the body's tangent at rest, that tangent and its free dofs.

    ``shift`` of the mean diagonal is added, so that a body that nothing holds has a factor.
    """
    from scipy.sparse import eye_array, tril

    n = body.mesh.points.size
    free = np.flatnonzero(~body._fixed.ravel())
    tangent = supple.assemble(body, np.zeros((n // 3, 3)))[2][free][:, free]
    lower = tril(tangent + shift * tangent.diagonal().mean() * eye_array(len(free))).tocsc()
    lower.sort_indices()
    grid = core().Multigrid(
        lower.indptr, lower.indices, free, body.mesh.points.ravel(),
        *multigrid.corners(body.mesh), multigrid.aggregate,
    )  # fmt: skip
    assert grid.update(lower.data)
    return grid, tangent, free


def rigid_motions(points):
    """(3n, 6) shifts and infinitesimal turns."""
    turns = [np.cross(axis, points) for axis in np.eye(3)]
    shifts = [np.broadcast_to(axis, points.shape) for axis in np.eye(3)]
    return np.stack([*shifts, *turns], axis=2).reshape(-1, 6)


@pytest.mark.parametrize("element", ["P1", "P2", "Q1"])
def test_rigid_motions_are_in_the_range_of_the_prolongation(element):
    """Of a body that nothing holds, to the single precision in which prolongations are kept."""
    from scipy.sparse import bsr_array

    mesh = supple.Mesh.box((8, 8, 8) if element != "P2" else (4, 4, 4), (0.1, 0.1, 0.1), element)
    grid, _, _ = hierarchy(supple.Body(mesh, "neo_hookean"), shift=1e-8)
    start, column, values = grid.prolongation(0)
    P = bsr_array((values.transpose(0, 2, 1), column, start), dtype=float).toarray()
    motions = rigid_motions(mesh.points - mesh.points.mean(axis=0))
    found = np.linalg.lstsq(P, motions, rcond=None)[0]
    error = abs(P @ found - motions).max(axis=0) / abs(motions).max(axis=0)
    assert error.max() < 1e-5, error


@pytest.mark.parametrize("element", ["P1", "P2", "Q2"])
def test_a_cycle_is_symmetric_and_positive_definite(element):
    """M as a dense matrix; the spectrum of M A, by numpy, lies within (0.02, 1.2)."""
    grid, tangent, free = hierarchy(block(element, 8 if element == "P1" else 3))
    assert len(grid.rows) > 1
    M = np.column_stack([grid.apply(row) for row in np.eye(len(free))])
    assert abs(M - M.T).max() <= 1e-5 * abs(M).max()
    M = 0.5 * (M + M.T)
    root = np.linalg.cholesky(M)
    spectrum = np.linalg.eigvalsh(root.T @ tangent.toarray() @ root)
    assert spectrum[0] > 0.02
    assert spectrum[-1] < 1.2


@pytest.mark.parametrize("element", ["P1", "P2", "Q1", "Q2", "Q2L", "Pr1"])
def test_the_answer_is_that_of_a_direct_factor(element):
    """To the tolerance of Newton's method, which both reach."""
    body = block(element, 8 if element in ("P1", "Q1") else 3)
    found, known = body.solve(solver="multigrid"), body.solve(solver="direct")
    assert found.timings["solver"].startswith("multigrid")
    assert found.timings["krylov_iterations"] > 0
    assert abs(found.u - known.u).max() <= 1e-7 * abs(known.u).max()


@pytest.mark.parametrize("case", ["soft inclusion", "stiff inclusion", "nearly incompressible"])
def test_hard_bodies_are_solved_as_by_a_direct_factor(case):
    """Moduli a thousand times apart, or ν = 0.49."""
    body = block("P1", 9, 0.49 if case == "nearly incompressible" else 0.3)
    middle = body.mesh.points[body.mesh.cells].mean(axis=1) - 0.05
    inside = np.linalg.norm(middle, axis=1) < 0.03
    if "inclusion" in case:
        body.set(where=inside, young=3e1 if case.startswith("soft") else 3e6)
        body.gravity((0.3, 0.0, -0.6))
    found, known = body.solve(solver="multigrid"), body.solve(solver="direct")
    assert abs(found.u - known.u).max() <= 1e-7 * abs(known.u).max()


def test_iterations_grow_slowly_under_refinement():
    """Twice as fine, an eighth of the cells' volume: at most half as many again (a theory without
    smoothing gives twice as many)."""
    counts = []
    for cells in (8, 16):
        state = block("P1", cells).solve(solver="multigrid", rtol=1e-8)
        counts.append(state.timings["krylov_iterations"] / state.iterations)
    assert counts[1] < 1.5 * counts[0], counts


def test_a_column_that_buckles_is_unstable():
    """Twice Euler's load π²EI/(2L)² on a slender clamped column, straight: found by negative
    curvature; at 0.8 of it the column stands."""
    mesh = supple.Mesh.box((2, 2, 10), (0.01, 0.01, 0.2), "Q2")
    body = supple.Body(mesh, "neo_hookean", young=1e6, poisson=0.0)
    euler = np.pi**2 * 1e6 * (0.01**4 / 12) / (2 * 0.2) ** 2
    body.fix(lambda p: p[:, 2] < 1e-9)
    for share in (0.8, 2.0):
        body.clear_loads()
        body.traction(lambda p: p[:, 2] > 0.2 - 1e-9, (0.0, 0.0, -share * euler / 1e-4))
        if share < 1:
            assert abs(body.solve(solver="multigrid").u[:, :2]).max() < 1e-6
            continue
        with pytest.raises(supple.ConvergenceError, match="unstable"):
            body.solve(solver="multigrid")


def test_thread_counts_agree():
    """To 1e-12 of the largest displacement, on a mesh that is large enough to be shared."""
    runtime, before = core(), core().threads()
    found = []
    try:
        for threads in (1, 2, 4):
            runtime.set_threads(threads)
            found.append(block("P1", 13).solve(solver="multigrid").u)
    finally:
        runtime.set_threads(before)
    for u in found[1:]:
        assert abs(u - found[0]).max() <= 1e-12 * abs(found[0]).max()


def test_a_tangent_that_is_not_symmetric_is_refused():
    """A pressure that follows has no energy; a mixed form is not positive definite."""
    body = block().pressure(lambda p: p[:, 2] > 0.099, 10.0)
    mixed = supple.Body(
        supple.Mesh.box((2, 2, 2), (0.1, 0.1, 0.1), "P2"), "neo_hookean_isochoric", "mixed"
    )
    mixed.fix(lambda p: p[:, 2] < 1e-9)
    for unsuitable in (body, mixed):
        with pytest.raises(supple.InputError, match="symmetric positive definite"):
            unsuitable.solve(solver="multigrid")


def test_without_pyamg_its_extra_is_named(monkeypatch):
    """And "auto" solves all the same."""
    monkeypatch.setattr(multigrid, "available", lambda: False)
    with pytest.raises(supple.InputError, match=r"supple\[multigrid\]"):
        block().solve(solver="multigrid")
    assert not block().solve().timings["solver"].startswith("multigrid")
