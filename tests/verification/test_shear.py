"""Simple and generalised shear of a unit cube, there and back, against closed forms.

Simple: x = X + γ Y e1. Generalised: x = X + k Y² e1, so γ = 2 k Y (Mazier 2022, §3.6; the fields
are those of the scripts published with it, fenics-inverseFEM). Both keep every volume: with
F = I + γ e1⊗e2, B = F Fᵀ, one finds by hand

    B = I + γ² e1⊗e1 + γ (e1⊗e2 + e2⊗e1)      tr B = tr B⁻¹ = 3 + γ²
    B⁻¹ = I + γ² e2⊗e2 - γ (e1⊗e2 + e2⊗e1)    2 E = γ² e2⊗e2 + γ (e1⊗e2 + e2⊗e1)

and from these the energies, stresses and the forces that hold them, as written in `LAWS`. Three
things in those scripts are not to be copied. Their C_01 multiplies I1 and C_10 multiplies I2,
against custom. They state no body force, without which generalised shear is no equilibrium: its
shear stress grows with Y. And their inverse problem is the derivative of ∫ψ dv by u', which is not
the balance of σ: homogeneous shear solves both, generalised shear does not.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pytest

import supple

MU, LAMBDA = 3e3 / 2.6, 3e3 * 0.3 / (1.3 * 0.4)
C1, C2 = 400.0, 100.0
TOP = LAMBDA / 2 + MU


@dataclass(frozen=True)
class Law:
    """Closed forms in γ; σ by its entries 11, 22, 33, 12; b by its factors of dγ/dY."""

    parameters: dict
    energy: callable  # ψ, Pa
    stress: callable  # (σ11, σ22, σ33, σ12), Pa
    force: callable  # (b1, b2) / γ', N/m³ · m: minus the slopes of σ12 and σ22 by γ


LAWS = {
    "neo_hookean": Law(
        {"young": 3e3, "poisson": 0.3},
        lambda g: MU * g**2 / 2,
        lambda g: (MU * g**2, 0 * g, 0 * g, MU * g),
        lambda g: (-MU + 0 * g, 0 * g),
    ),
    "saint_venant_kirchhoff": Law(
        {"young": 3e3, "poisson": 0.3},
        lambda g: LAMBDA * g**4 / 8 + MU * (g**2 / 2 + g**4 / 4),
        lambda g: (
            (TOP + MU) * g**2 + TOP * g**4, TOP * g**2, LAMBDA * g**2 / 2, MU * g + TOP * g**3,
        ),
        lambda g: (-MU - 3 * TOP * g**2, -2 * TOP * g),
    ),
    "mooney_rivlin": Law(
        {"c1": C1, "c2": C2, "bulk": 1e4},
        lambda g: (C1 + C2) * g**2,
        lambda g: (
            (4 * C1 + 2 * C2) / 3 * g**2, -(2 * C1 + 4 * C2) / 3 * g**2, 2 * (C2 - C1) / 3 * g**2,
            2 * (C1 + C2) * g,
        ),
        lambda g: (-2 * (C1 + C2) + 0 * g, 4 / 3 * (C1 + 2 * C2) * g),
    ),
}  # fmt: skip


def cauchy(law, gamma):
    """σ (..., 3, 3), Pa, at shears γ (...)."""
    s11, s22, s33, s12 = LAWS[law].stress(np.asarray(gamma, float))
    zero = np.zeros_like(s11)
    return np.stack([s11, s12, zero, s12, s22, zero, zero, zero, s33], -1).reshape(*s11.shape, 3, 3)


def box(element, n=2):
    return supple.Mesh.box((n, n, n), (1.0, 1.0, 1.0), element)


def shear(mesh, power, k):
    """u = k Y^power e1 at the nodes of the rest shape."""
    return k * mesh.points[:, 1, None] ** power * np.array([1.0, 0.0, 0.0])


def solved(body, mesh, u, inverse):
    """The state and the displacement from rest to loaded that was found (n, 3)."""
    tight = {"rtol": 1e-14}
    if inverse:
        rest = body.on(mesh.moved(mesh.points + u)).rest_shape(**tight)
        return rest, -rest.u
    state = body.solve(**tight)
    return state, state.u


def require_exact(law, found, u_found, u):
    """u, and at quadrature points F = I + γ e1⊗e2, σ(γ) and ψ(γ), to 1e-12."""
    assert abs(u_found - u).max() < 1e-12 * abs(u).max()
    F = found.deformation_gradient(at="quadrature")
    gamma = F[..., 0, 1]
    sheared = np.eye(3) + gamma[..., None, None] * np.outer([1, 0, 0], [0, 1, 0])
    assert abs(F - sheared).max() < 1e-12 * abs(gamma).max()
    sigma, psi = cauchy(law, gamma), LAWS[law].energy(gamma)
    assert abs(found.cauchy(at="quadrature") - sigma).max() < 1e-12 * abs(sigma).max()
    assert abs(found.energy_density(at="quadrature") - psi).max() < 1e-12 * psi.max()


def held_by_tractions(body, mesh, u, law, gamma):
    """Faces X = 0, 1 and Y = 0 held; on the top and on Z = 0, 1 dead tractions P N, P = σ F⁻ᵀ."""
    F = np.eye(3) + gamma * np.outer([1, 0, 0], [0, 1, 0])
    P = cauchy(law, gamma) @ np.linalg.inv(F).T
    sides = np.flatnonzero(np.isin(mesh.points[:, 0], [0, 1]) | (mesh.points[:, 1] == 0))
    body.prescribe(sides, u[sides])
    for axis, end in ((1, 1), (2, 0), (2, 1)):
        nodes = np.flatnonzero(mesh.points[:, axis] == end)
        body.traction(nodes, P[:, axis] * (1 if end else -1))


def every_law_and_element():
    """Slow where no other test needs the kernels."""
    for law in LAWS:
        for element in ("P1", "P2", "Q1", "Q2"):
            known = law == "neo_hookean" or element in ("P1", "Q1")
            yield pytest.param(law, element, marks=[] if known else pytest.mark.slow)


@pytest.mark.parametrize("support", ["boundary", "tractions"])
@pytest.mark.parametrize("inverse", [False, True], ids=["direct", "inverse"])
@pytest.mark.parametrize(("law", "element"), list(every_law_and_element()))
def test_simple_shear_is_exact(law, element, inverse, support):
    """u = γ Y e1 lies in every space; σ is the same everywhere, the energy ψ(γ) times 1 m³."""
    gamma, mesh = 0.4, box(element)
    u, body = shear(mesh, 1, gamma), supple.Body(mesh, law, **LAWS[law].parameters)
    if support == "tractions":
        held_by_tractions(body, mesh, u, law, gamma)
    else:
        outside = np.unique(mesh.boundary())
        body.prescribe(outside, u[outside])
    found, u_found = solved(body, mesh, u, inverse)
    require_exact(law, found, u_found, u)
    sigma = cauchy(law, gamma)
    assert abs(found.cauchy() - sigma).max() < 1e-12 * abs(sigma).max()
    if support == "boundary" and not inverse:  # nothing but the stored energy
        assert found.energy == pytest.approx(LAWS[law].energy(gamma), rel=1e-12)


def nodal_forces(mesh, b):
    """∫ b(X) φ dX (n, 3), N, on affine cells: Gauss points of degree 9, collapsed on tetrahedra."""
    table = mesh.table
    g, w = np.polynomial.legendre.leggauss(5)
    r, s, t = (a.ravel() for a in np.meshgrid(*[(g + 1) / 2] * 3, indexing="ij"))
    weight = np.prod(np.meshgrid(*[w / 2] * 3, indexing="ij"), axis=0).ravel()
    if table.cell.is_simplex:
        weight *= (1 - s) * (1 - t) ** 2
        r, s = r * (1 - s) * (1 - t), s * (1 - t)
    xi = np.stack([r, s, t], 1)

    def monomials(at):
        return np.prod(at[:, None, :] ** table.powers, axis=2)

    phi = monomials(xi) @ np.linalg.inv(monomials(table.points))
    X = np.einsum("qa,cai->cqi", phi, mesh.points[mesh.cells])
    axes = [0, 1, 2, 3] if table.cell.is_simplex else [0, 1, 3, 4]  # a corner, then along each ξ
    corner = mesh.points[mesh.cells[:, axes]]
    volume = np.linalg.det(corner[:, 1:] - corner[:, :1])
    loads = np.einsum("q,c,cqi,qa->cai", weight, volume, b(X), phi)
    forces = np.zeros_like(mesh.points)
    np.add.at(forces, mesh.cells, loads)
    return forces


def generalised(law, mesh, k):
    """A body under the body force of k Y² e1, its whole boundary held where it must go."""
    u, body = shear(mesh, 2, k), supple.Body(mesh, law, quadrature=6, **LAWS[law].parameters)

    def b(X):
        b1, b2 = LAWS[law].force(2 * k * X[..., 1])
        return 2 * k * np.stack([b1, b2, 0 * b1], axis=-1)

    outside = np.unique(mesh.boundary())
    body.prescribe(outside, u[outside]).force(np.arange(len(u)), nodal_forces(mesh, b))
    return u, body


@pytest.mark.slow
@pytest.mark.parametrize("inverse", [False, True], ids=["direct", "inverse"])
@pytest.mark.parametrize("element", ["P2", "Q2"])
@pytest.mark.parametrize("law", LAWS)
@pytest.mark.parametrize("k", [0.3, 1.0])
def test_generalised_shear_is_exact_on_quadratic_elements(law, element, inverse, k):
    """u = k Y² e1 with its body force; the loaded shape's cells are curved, exactly."""
    mesh = box(element)
    u, body = generalised(law, mesh, k)
    found, u_found = solved(body, mesh, u, inverse)
    require_exact(law, found, u_found, u)


@pytest.mark.parametrize("inverse", [False, True], ids=["direct", "inverse"])
@pytest.mark.parametrize("element", ["P2", "Q2"])
def test_neo_hookean_generalised_shear_needs_a_uniform_weight_alone(element, inverse):
    """b = -2 k μ e1 everywhere and free faces Z = 0, 1 (σ e3 = 0); the pinned rule is exact."""
    k, rho, mesh = 0.3, 1000.0, box(element)
    u = shear(mesh, 2, k)
    body = supple.Body(mesh, "neo_hookean", density=rho, **LAWS["neo_hookean"].parameters)
    faces = np.flatnonzero(np.isin(mesh.points[:, 0], [0, 1]) | np.isin(mesh.points[:, 1], [0]))
    body.prescribe(faces, u[faces]).gravity((-2 * k * MU / rho, 0.0, 0.0))
    body.traction(np.flatnonzero(mesh.points[:, 1] == 1), (2 * k * MU, 0.0, 0.0))
    found, u_found = solved(body, mesh, u, inverse)
    require_exact("neo_hookean", found, u_found, u)


@pytest.mark.slow
@pytest.mark.parametrize("inverse", [False, True], ids=["direct", "inverse"])
@pytest.mark.parametrize("element", ["P1", "Q1"])
@pytest.mark.parametrize("law", LAWS)
def test_generalised_shear_converges_where_it_is_not_in_the_space(law, element, inverse):
    """P1 and Q1 hold no Y²: σ under the top, where its error is largest, is first order in h.

    The nodes are exact where σ12 is linear in γ, so that u1 solves a linear equation in Y alone;
    where it is not they are off by order h².
    """
    k, off, nodal = 0.3, [], []
    for n in (4, 8):
        mesh = box(element, n)
        u, body = generalised(law, mesh, k)
        found, u_found = solved(body, mesh, u, inverse)
        top = (mesh.points[mesh.cells, 1] == 1).any(axis=1)
        off.append(abs(found.cauchy()[top] - cauchy(law, 2 * k)).max())
        nodal.append(abs(u_found - u).max())
    assert 1.8 < off[0] / off[1] < 2.2
    if law == "saint_venant_kirchhoff":
        assert 3.2 < nodal[0] / nodal[1] < 4.8
    else:
        assert max(nodal) < 1e-12
