"""Patch tests: linear fields and volumes on distorted meshes, quadratics on affine cells."""

from __future__ import annotations

import numpy as np
import pytest

import supple
from supple import assembly
from supple.kernels.cells import ELEMENTS

A = np.array([[0.2, 0.1, -0.05], [0.0, -0.15, 0.1], [0.05, 0.0, 0.25]])
F = np.eye(3) + A


#: The 4 points of P2 integrate straight-edged cells exactly, those of the others of degree 2 curved
#: ones too; a curved P2 cell needs degree 3, two of its area vectors times one of its gradients.
CASES = [
    *(pytest.param(e, e != "P2", None, id=e) for e in ELEMENTS),
    pytest.param("P2", True, 3, id="P2 curved", marks=pytest.mark.slow),
]


@pytest.mark.parametrize("law", ["neo_hookean", "corotational_polar"])
@pytest.mark.parametrize(("element", "curved", "degree"), CASES)
def test_linear_field_on_the_boundary_gives_it_inside(element, curved, degree, law, distorted):
    """u = A x on the boundary of a distorted mesh: the same within, F = I + A everywhere."""
    mesh = distorted(element, (3, 3, 3), curved)
    facets = mesh.boundary()
    outside = np.unique(facets[facets >= 0])
    assert len(outside) < len(mesh.points)
    body = supple.Body(mesh, law, quadrature=degree).prescribe(outside, mesh.points[outside] @ A.T)
    state = body.solve()
    np.testing.assert_allclose(state.u, mesh.points @ A.T, atol=1e-12)
    found = state.deformation_gradient(at="quadrature")
    np.testing.assert_allclose(found, np.broadcast_to(F, found.shape), atol=1e-11)


@pytest.mark.parametrize(("element", "curved", "degree"), CASES)
def test_volume_of_a_linear_field_is_exact(element, curved, degree, distorted):
    """∫ J dV = det F times the volume at rest = the volume of the moved mesh."""
    mesh = distorted(element, (2, 2, 2), curved)
    body = supple.Body(mesh, "neo_hookean", quadrature=degree).prescribe(
        lambda p: p[:, 0] > -9, mesh.points @ A.T
    )
    state = body.solve()
    J = np.linalg.det(state.deformation_gradient(at="quadrature"))
    volume = (J * state._values.volume).sum()
    assert volume == pytest.approx(np.linalg.det(F) * mesh.volume, rel=1e-12)
    assert mesh.moved(state.points).volume == pytest.approx(volume, rel=1e-12)


@pytest.mark.parametrize("element", ["P2", "Q2", "Q2L", "Pr2"])
def test_quadratic_field_is_exact_on_affine_cells(element):
    """F of a full quadratic u at the quadrature points of a sheared box, against its gradient."""
    from supple.kernels.elements import STIFFNESS_DEGREE, quadrature

    box = supple.Mesh.box((2, 2, 1), (1.0, 0.8, 0.5), element)
    mesh = box.moved(box.points @ np.array([[1, 0.3, 0], [0, 1, 0.2], [0.1, 0, 1.0]]).T)
    B = 0.1 * np.random.default_rng(0).uniform(-1, 1, (3, 3, 3))
    B = B + B.transpose(0, 2, 1)
    u = np.einsum("ijk,nj,nk->ni", B, mesh.points, mesh.points)
    body = supple.Body(mesh, "neo_hookean")
    table = assembly.system(body).regions[0].tabulate("points", u.ravel())
    found = table.reshape(len(mesh.cells), -1, 20)[:, :, :9].reshape(len(mesh.cells), -1, 3, 3)
    places, _ = quadrature(element, STIFFNESS_DEGREE[element])
    third = 4 if element.startswith("Q") else 3
    first, along = mesh.table.from_vtk[0], mesh.table.from_vtk[[1, 2, third]]
    corners = mesh.points[mesh.cells]
    edges = corners[:, along] - corners[:, [first]]
    at = corners[:, [first]] + np.einsum("qd,cdi->cqi", places, edges)
    expected = np.eye(3) + 2 * np.einsum("ijk,cqk->cqij", B, at)
    np.testing.assert_allclose(found, expected, atol=1e-13)


#: Rules asked for, and how many points they have in a cell.
RULES = [
    ("P2", (4, "xiao_gimbutas"), 11),
    ("Q1", (2, "gll"), 27),
    ("Q2L", None, 27),
    ("Pr1", (3, "gauss_jacobi"), 4 * 2),
    ("Pr2", None, 18),
    ("Pr2", 6, 12 * 4),
]


@pytest.mark.parametrize(("element", "rule", "points"), RULES)
def test_energy_is_the_sum_over_the_points_that_the_fields_are_given_at(
    element, rule, points, distorted
):
    """∫ψ of the weak form = Σ ψ × volume of the point values: one rule for both."""
    mesh = distorted(element, (2, 1, 1))
    rng = np.random.default_rng(1)
    u = mesh.points @ A.T + 0.02 * rng.uniform(-1, 1, mesh.points.shape)
    body = supple.Body(mesh, "neo_hookean", quadrature=rule)
    state = body.prescribe(lambda p: p[:, 0] > -9, u).solve()
    psi, volume = state._values.psi, state._values.volume
    assert psi.shape == (len(mesh.cells), points)
    assert volume.sum() == pytest.approx(mesh.volume, rel=1e-12)
    assert (psi * volume).sum() == pytest.approx(supple.assemble(body, u)[0], rel=1e-13)
