"""The numerical inf-sup test of the mixed pairs (Chapelle and Bathe 1993, Comput. Struct. 47).

The tangent of a neo-Hookean body at rest is [A Bᵀ; B -C]: A holds 2 μ dev ε : dev ε, a norm of
displacements, and bulk C the square of pressures. The smallest λ of B A⁻¹ Bᵀ q = λ bulk C q is the
inf-sup constant's square over μ: a stable pair keeps it away from zero as the mesh is refined. With
the whole boundary held a constant pressure does no work, and no other pressure may do none.
"""

from __future__ import annotations

import numpy as np
import pytest
from scipy.linalg import eigh
from scipy.sparse import csc_array, csr_array
from scipy.sparse.linalg import splu

import supple

MU, BULK = 700.0, 3e5


def blocks(mesh):
    """A, B and bulk C of a body on ``mesh`` at rest, all dofs."""
    body = supple.Body(mesh, "mooney_rivlin", formulation="mixed", c1=MU / 2, c2=0.0, bulk=BULK)
    K, n = supple.assemble(body, np.zeros_like(mesh.points))[2], mesh.points.size
    return csr_array(K[:n, :n]), csr_array(K[n:, :n]), -BULK * K[n:, n:].toarray()


def spectrum(A, B, C):
    """All λ μ, in rising order."""
    work = B @ splu(csc_array(A)).solve(B.T.toarray())
    return MU * eigh(work, C, eigvals_only=True)


def inside(mesh):
    """Dofs (k,) of the nodes that are not on the boundary."""
    nodes = np.setdiff1d(np.arange(len(mesh.points)), mesh.boundary())
    return (3 * nodes[:, None] + np.arange(3)).ravel()


def taylor_hood(mesh):
    """λ μ with the boundary held: quadratic displacements, linear pressures."""
    A, B, C = blocks(mesh)
    free = inside(mesh)
    return spectrum(A[free][:, free], B[:, free], C)


def equal_order(mesh):
    """The same with displacements of degree 1: quadratic ones that are linear between corners."""
    corners, held = mesh.table.corners, np.zeros((len(mesh.points), len(mesh.points)))
    for cell in mesh.cells:
        held[np.ix_(cell, cell[:corners])] = mesh.table.corner_values()
    free = np.setdiff1d(np.unique(mesh.cells[:, :corners]), mesh.boundary())
    spread = csr_array(np.kron(held[:, free], np.eye(3)))
    A, B, C = blocks(mesh)
    return spectrum(spread.T @ A @ spread, B @ spread, C)


@pytest.mark.parametrize("element", ["P2", "Q2L"])
def test_smallest_eigenvalue_stays_away_from_zero(element, distorted):
    """Distorted meshes: one pressure without work, the constant; the next λ does not sink."""
    smallest = []
    for n in (2, 3, 4):
        values = taylor_hood(distorted(element, (n, n, n), curved=False))
        assert abs(values[0]) < 1e-10
        assert values[1] > 0.02, (n, values[:3])
        smallest.append(values[1])
    assert smallest[-1] > 0.7 * smallest[0], smallest


@pytest.mark.parametrize("element", ["P2", pytest.param("Q2L", marks=pytest.mark.slow)])
def test_equal_orders_fail_the_same_test(element, distorted):
    """375 displacements of the pressures' own degree against 343 pressures: the next λ is zero."""
    values = equal_order(distorted(element, (6, 6, 6), curved=False))
    assert abs(values[1]) < 1e-6, values[:5]


@pytest.mark.parametrize("element", ["P2", "Q2L"])
def test_pressure_of_a_squeezed_block_does_not_oscillate(element, distorted):
    """Held all round and drawn by gravity, it is ρ g z and a constant, to the mesh's accuracy.

    Incompressible: nothing moves, so p = ρ g · x + c exactly, and linear pressures hold that.
    """
    mesh = distorted(element, (3, 3, 3), curved=False)
    body = supple.Body(mesh, "mooney_rivlin", formulation="mixed", bulk=1e12, density=1000.0)
    body.gravity((1.0, -2.0, -9.0)).fix(np.unique(mesh.boundary()))
    state = body.solve()
    expected = -1000.0 * mesh.points @ (1.0, -2.0, -9.0)
    assert abs(state.u).max() < 1e-7
    shift = state.pressure - expected
    assert abs(shift - shift.mean()).max() < 1e-5 * np.ptp(expected)
