"""F, C, E, P, S, σ, ψ and J of a solved body: at points, in cells, at nodes."""

from __future__ import annotations

import numpy as np
import pytest

import supple
from supple.kernels.cells import ELEMENTS

A = np.array([[0.2, 0.1, -0.05], [0.0, -0.15, 0.1], [0.05, 0.0, 0.25]])
F = np.eye(3) + A
MU, LAMBDA = 3e3 / 2.6, 3e3 * 0.3 / (1.3 * 0.4)

ELASTIC = [pytest.param(e, marks=() if e in ("P1", "Q1") else pytest.mark.slow) for e in ELEMENTS]


def prescribed(mesh, A=A):
    """A neo-Hookean body with all its nodes given u = A X."""
    body = supple.Body(mesh, "neo_hookean", young=3e3, poisson=0.3)
    return body.prescribe(np.arange(len(mesh.points)), mesh.points @ A.T)


@pytest.mark.parametrize("element", ELASTIC)
@pytest.mark.parametrize("at", ["cells", "quadrature", "nodes"])
def test_fields_of_a_linear_displacement_are_those_of_the_textbook(element, at, distorted):
    """Neo-Hooke: P = μ (F - F⁻ᵀ) + λ ln J F⁻ᵀ, S = F⁻¹P, σ = P Fᵀ / J, ψ; the same everywhere."""
    state = prescribed(distorted(element, (2, 2, 1))).solve()
    J, inverse = np.linalg.det(F), np.linalg.inv(F)
    P = MU * (F - inverse.T) + LAMBDA * np.log(J) * inverse.T
    psi = MU / 2 * ((F * F).sum() - 3) - MU * np.log(J) + LAMBDA / 2 * np.log(J) ** 2
    expected = {
        "deformation_gradient": F,
        "right_cauchy_green": F.T @ F,
        "green_lagrange": (F.T @ F - np.eye(3)) / 2,
        "first_piola": P,
        "second_piola": inverse @ P,
        "cauchy": P @ F.T / J,
        "energy_density": psi,
        "volume_ratio": J,
    }
    for name, value in expected.items():
        found = getattr(state, name)(at=at)
        assert found.shape[found.ndim - np.ndim(value) :] == np.shape(value), name
        assert abs(found - value).max() < 1e-10 * np.abs(value).max(), name


@pytest.mark.parametrize("element", ["P2", "Q2L", "Pr2"])
@pytest.mark.slow
def test_nodes_get_a_field_that_the_element_can_hold(element):
    """A quadratic u on affine cells: F at a node is I + ∇u there, to rounding."""
    box = supple.Mesh.box((2, 2, 2), (1.0, 0.8, 0.5), element)
    B = 0.1 * np.random.default_rng(0).uniform(-1, 1, (3, 3, 3))
    B = B + B.transpose(0, 2, 1)
    u = np.einsum("ijk,nj,nk->ni", B, box.points, box.points)
    body = supple.Body(box, "neo_hookean").prescribe(np.arange(len(u)), u)
    found = body.solve().deformation_gradient(at="nodes")
    expected = np.eye(3) + 2 * np.einsum("ijk,nk->nij", B, box.points)
    np.testing.assert_allclose(found, expected, atol=1e-10)


@pytest.mark.parametrize("element", ["P1", "Q1"])
def test_node_values_converge_to_the_field(element):
    """σ of a sine displacement: the largest error at a node falls at least by 1.7 a halving."""
    errors = []
    for n in (4, 8):
        mesh = supple.Mesh.box((n, n, n), (1.0, 1.0, 1.0), element)
        u = 0.05 * np.sin(np.pi * mesh.points[:, [1, 2, 0]])
        body = supple.Body(mesh, "neo_hookean").prescribe(np.arange(len(u)), u)
        found = body.solve().deformation_gradient(at="nodes")
        slope = 0.05 * np.pi * np.cos(np.pi * mesh.points[:, [1, 2, 0]])
        expected = np.broadcast_to(np.eye(3), found.shape).copy()
        for i, j in enumerate((1, 2, 0)):
            expected[:, i, j] += slope[:, i]
        errors.append(np.sqrt(((found - expected) ** 2).mean()))
    assert errors[1] < errors[0] / 1.7, errors


def test_projection_keeps_the_integral():
    """∫ of the projected σ is the sum over the points, for a field with jumps: stiff and soft."""
    mesh = supple.Mesh.box((4, 2, 2), (2.0, 1.0, 1.0), "Q1")
    young = np.where(mesh.points[mesh.cells].mean(axis=1)[:, 0] < 1, 1e3, 5e3)
    body = supple.Body(mesh, "neo_hookean", young=young)
    body.fix(lambda x: x[:, 0] < 1e-9).traction(lambda x: x[:, 0] > 1.999, (200.0, 50.0, 0.0))
    state = body.solve()
    volume = state._values.volume
    total = np.einsum("cq,cqij->ij", volume, state.cauchy(at="quadrature"))
    shape = mesh.table.values(state._values.places)
    weight = np.zeros(len(mesh.points))
    np.add.at(weight, mesh.cells, volume @ shape)
    nodes = np.einsum("n,nij->ij", weight, state.cauchy(at="nodes"))
    np.testing.assert_allclose(nodes, total, rtol=1e-9, atol=1e-9 * abs(total).max())


def test_rest_shape_projects_over_the_rest_volume():
    """F from rest to loaded of an inverse solve is that of the forward solve, at the nodes too."""
    mesh = supple.Mesh.box((2, 2, 3), (1.0, 1.0, 1.5), "Q1")
    body = supple.Body(mesh, "neo_hookean", density=20.0).fix(lambda x: x[:, 2] < 1e-9)
    body.gravity((3.0, 0.0, -9.81))
    rest = body.rest_shape()
    back = body.on(rest.mesh).solve()
    for at in ("cells", "quadrature", "nodes"):
        one, other = rest.cauchy(at=at), back.cauchy(at=at)
        assert abs(one - other).max() < 1e-9 * abs(other).max(), at


def test_an_unknown_place_is_refused():
    state = prescribed(supple.Mesh.box((1, 1, 1), (1.0, 1.0, 1.0), "Q1")).solve()
    with pytest.raises(supple.InputError, match="nodes"):
        state.cauchy(at="corners")
