"""Loads: closed surfaces, areas at rest and loaded, follower tangents, direct against inverse."""

from __future__ import annotations

import numpy as np
import pytest

import supple
from supple import assembly
from supple.kernels.cells import ELEMENTS

A = np.array([[0.2, 0.1, -0.05], [0.0, -0.1, 0.1], [0.05, 0.0, 0.15]])


def everywhere(p):
    return p[:, 0] > -9


def displaced(points, seed=1):
    rng = np.random.default_rng(seed)
    return points @ A.T + 0.02 * rng.uniform(-1, 1, points.shape)


def loads_only(mesh):
    """A body whose own stiffness is negligible beside the loads of the tests."""
    return supple.Body(mesh, "neo_hookean", young=1e-12, poisson=0.3)


def facet_area(mesh, points):
    """Area of the flat side x = 1 of ``mesh`` where its points are ``points``, by triangles."""
    facets = mesh.boundary(lambda p: p[:, 0] > 1 - 1e-9)  # of prisms, quadrilaterals
    corners = points[facets[:, : 3 if mesh.table.cell.is_simplex else 4]]
    fan = [(0, 1, 2)] if mesh.table.cell.is_simplex else [(0, 1, 2), (0, 2, 3)]
    return sum(
        np.linalg.norm(
            np.cross(corners[:, j] - corners[:, i], corners[:, k] - corners[:, i]), axis=1
        ).sum()
        / 2
        for i, j, k in fan
    )


@pytest.mark.parametrize("element", ELEMENTS)
def test_pressure_on_a_closed_surface_has_no_resultant(element, distorted):
    """∮ p n da = 0 on any closed surface, moved or not."""
    mesh = distorted(element, (2, 1, 1))
    body = loads_only(mesh).pressure(everywhere, 50.0)
    for u in (np.zeros_like(mesh.points), displaced(mesh.points)):
        force = supple.assemble(body, u)[1]
        assert abs(force).max() > 1
        assert abs(force.sum(axis=0)).max() < 1e-12 * abs(force).max()


@pytest.mark.parametrize("element", ELEMENTS)
def test_pressure_is_the_slope_of_pressure_times_volume(element, distorted, assert_slope):
    """Work of a pressure p on a closed surface is -p dV: R·d = p dV/dd, V of the curved cells."""
    mesh = distorted(element, (2, 1, 1))
    body = loads_only(mesh).pressure(everywhere, 50.0)
    u = displaced(mesh.points)
    d = np.random.default_rng(2).uniform(-1, 1, u.shape)
    slope = (supple.assemble(body, u)[1] * d).sum()
    assert_slope(lambda x: 50.0 * mesh.moved(mesh.points + x).volume, slope, u, d, 1e-3)


@pytest.mark.parametrize("load", ["pressure", "traction"])
@pytest.mark.parametrize("inverse", [False, True])
@pytest.mark.parametrize("element", ELEMENTS)
def test_tangent_of_a_load_that_moves_is_its_derivative(
    element, inverse, load, distorted, assert_slope
):
    """Follower pressure, traction per loaded area; in the inverse, traction and gravity at rest."""
    from scipy.sparse import csr_array

    mesh = distorted(element, (2, 1, 1))
    body = supple.Body(mesh, "neo_hookean", young=1e-3, density=900.0).gravity((1.0, -9.0, 2.0))
    if load == "pressure":
        body.pressure(everywhere, 50.0)
    else:
        body.traction(everywhere, (10.0, -20.0, 30.0), per="rest" if inverse else "loaded")
    system = assembly.system(body, inverse).system
    u = displaced(mesh.points).ravel()
    d = np.random.default_rng(2).uniform(-1, 1, u.size)
    K = csr_array(system.tangent(u), shape=(u.size, u.size))
    assert_slope(lambda x: system.residual(x, 1.0), K @ d, u, d, 1e-3)


@pytest.mark.parametrize("per", ["rest", "loaded"])
@pytest.mark.parametrize("element", ELEMENTS)
def test_traction_sums_to_its_area(element, per):
    """t times the area of the side, at rest or as it is now, in either direction of the solve."""
    t = np.array([3.0, -4.0, 5.0])
    mesh = supple.Mesh.box((2, 2, 2), (1.0, 1.0, 1.0), element)
    u = mesh.points @ A.T
    area = {"rest": 1.0, "loaded": facet_area(mesh, mesh.points + u)}[per]
    body = loads_only(mesh).traction(lambda p: p[:, 0] > 1 - 1e-9, t, per=per)
    np.testing.assert_allclose(-supple.assemble(body, u)[1].sum(axis=0), t * area, rtol=1e-10)
    inverse = assembly.system(body.on(mesh.moved(mesh.points + u)), True).system
    force = -inverse.residual(-u.ravel(), 1.0).reshape(-1, 3)
    np.testing.assert_allclose(force.sum(axis=0), t * area, rtol=1e-10)


@pytest.mark.parametrize("element", ELEMENTS)
def test_weight_sums_to_the_mass(element, distorted):
    """ρ V g, ρ and V at rest, in both directions; ρ V g of the loaded shape where ρ is of that."""
    g, rho = np.array([1.0, -9.0, 2.0]), 900.0
    mesh = distorted(element, (2, 1, 1))
    body = supple.Body(mesh, "neo_hookean", young=1e-12, density=rho).gravity(g)
    u = displaced(mesh.points)
    loaded = mesh.moved(mesh.points + u)
    weight = {"rest": rho * mesh.volume * g, "loaded": rho * loaded.volume * g}
    np.testing.assert_allclose(-supple.assemble(body, u)[1].sum(axis=0), weight["rest"], rtol=1e-9)
    for density_of, expected in weight.items():
        system = assembly.system(body.on(loaded), True, density_of).system
        force = -system.residual(-u.ravel(), 1.0).reshape(-1, 3)
        np.testing.assert_allclose(force.sum(axis=0), expected, rtol=1e-9)


@pytest.mark.parametrize("element", ELEMENTS)
def test_everything_on_the_loaded_shape_is_the_direct_problem_read_backwards(element, distorted):
    """Law, skin, gravity, tractions, pressure and nodal forces: the very same nodal residual."""
    rest = distorted(element, (2, 1, 1))
    body = supple.Body(rest, "neo_hookean", young=1e3, density=900.0).gravity((1.0, -9.0, 2.0))
    body.skin(everywhere, "neo_hookean", thickness=2e-2, young=5e3).pressure(everywhere, 50.0)
    body.traction(everywhere, (10.0, -20.0, 30.0))
    body.traction(everywhere, (5.0, 5.0, 0.0), per="loaded")
    body.force([0, 3], (1.0, 2.0, 3.0))
    u = displaced(rest.points)
    direct = supple.assemble(body, u)[1]
    system = assembly.system(body.on(rest.moved(rest.points + u)), True).system
    inverse = system.residual(-u.ravel(), 1.0).reshape(-1, 3)
    np.testing.assert_allclose(inverse, direct, atol=1e-11 * abs(direct).max(), rtol=0)


@pytest.mark.parametrize("element", ["Pr1", "Pr2"])
def test_skin_values_of_prisms_follow_their_facets(element):
    """Thickness and modulus one a facet, triangles and quadrilaterals mixed: energies add up."""
    mesh = supple.Mesh.box((2, 1, 1), (1.0, 0.8, 0.5), element)
    u = mesh.points @ np.diag([0.3, 0.2, 0.25])
    every = mesh.boundary()
    count = len(every)
    thickness, young = np.linspace(1e-3, 4e-3, count), np.linspace(5e3, 1e3, count)

    def energy(where, **values):
        body = supple.Body(mesh, "neo_hookean", young=1e-12, poisson=0.3)
        return supple.assemble(body.skin(where, "neo_hookean", **values), u)[0]

    alone = []
    for row, h, modulus in zip(every, thickness, young, strict=True):
        tagged = supple.Mesh(
            mesh.points, mesh.cells, element, {"one": supple.Tag("facets", row[None])}
        )
        body = supple.Body(tagged, "neo_hookean", young=1e-12, poisson=0.3)
        body.skin("one", "neo_hookean", thickness=h, young=modulus)
        alone.append(supple.assemble(body, u)[0])
    found = energy(everywhere, thickness=thickness, young=young)
    assert found == pytest.approx(sum(alone), rel=1e-12)
    assert abs(energy(everywhere, thickness=thickness[::-1], young=young) / found - 1) > 1e-3


@pytest.mark.parametrize("element", ["Pr1", "Pr2"])
def test_traction_on_the_ends_of_prisms_sums_to_triangles_and_quadrilaterals(element):
    """Sides x = 1 (quadrilaterals) and z = 0.5 (triangles) in one load: both areas count once."""
    t = np.array([3.0, -4.0, 5.0])
    mesh = supple.Mesh.box((2, 1, 1), (1.0, 0.8, 0.5), element)
    nodes = (mesh.points[:, 0] > 1 - 1e-9) | (mesh.points[:, 2] > 0.5 - 1e-9)
    assert len(np.unique((mesh.boundary(nodes) >= 0).sum(axis=1))) == 2
    force = supple.assemble(loads_only(mesh).traction(nodes, t), np.zeros_like(mesh.points))[1]
    np.testing.assert_allclose(-force.sum(axis=0), t * (0.8 * 0.5 + 0.8), rtol=1e-12)
