"""The cell tables against Basix and against geometry that does not use the tables."""

from __future__ import annotations

import basix
import numpy as np
import pytest

from supple.kernels.cells import ELEMENTS, FACETS, NO_NODE

EVERY = ELEMENTS | FACETS
#: VTK's other nodes by the corners that they lie between. vtkCellType 22 to 25 and 28, 29, 32: the
#: faces of 29 (27 nodes) are -x, +x, -y, +y, -z, +z, those of 32 (18 nodes) its quadrilaterals.
VTK_EDGES = {
    "T2": [(0, 1), (1, 2), (2, 0)],
    "S2": [(0, 1), (1, 2), (2, 3), (3, 0)],
    "P2": [(0, 1), (1, 2), (0, 2), (0, 3), (1, 3), (2, 3)],
    "Q2": [
        *[(0, 1), (1, 2), (2, 3), (3, 0), (4, 5), (5, 6), (6, 7), (7, 4)],
        *[(0, 4), (1, 5), (2, 6), (3, 7)],
    ],
    "Pr2": [
        *[(0, 1), (1, 2), (2, 0), (3, 4), (4, 5), (5, 3), (0, 3), (1, 4), (2, 5)],
        *[(0, 1, 3, 4), (1, 2, 4, 5), (2, 0, 5, 3)],
    ],
}
VTK_EDGES["S2L"] = [*VTK_EDGES["S2"], (0, 1, 2, 3)]
VTK_EDGES["Q2L"] = [
    *VTK_EDGES["Q2"],
    *[(0, 3, 4, 7), (1, 2, 5, 6), (0, 1, 4, 5), (2, 3, 6, 7), (0, 1, 2, 3), (4, 5, 6, 7)],
    tuple(range(8)),
]
#: vtkTriQuadraticHexahedron::GetParametricCoords, nodes 20 to 26, and those of
#: vtkBiQuadraticQuadraticWedge, nodes 15 to 17.
VTK_PLACES = {
    "Q2L": {
        20: (0, 0.5, 0.5), 21: (1, 0.5, 0.5), 22: (0.5, 0, 0.5), 23: (0.5, 1, 0.5),
        24: (0.5, 0.5, 0), 25: (0.5, 0.5, 1), 26: (0.5, 0.5, 0.5),
    },
    "Pr2": {15: (0.5, 0, 0.5), 16: (0.5, 0.5, 0.5), 17: (0, 0.5, 0.5)},
}  # fmt: skip


def basix_nodes(element):
    """Basix' own node coordinates; serendipity by its geometry: vertices, then edge midpoints."""
    cell = basix.CellType[element.cell.name]
    if element.name not in ("Q2", "S2"):
        return basix.create_element(
            basix.ElementFamily.P, cell, element.degree, basix.LagrangeVariant.equispaced
        ).points
    vertices = basix.geometry(cell)
    middles = [vertices[list(edge)].mean(axis=0) for edge in basix.topology(cell)[1]]
    return np.vstack([vertices, middles])


def loops(element):
    """Nodes (k,) of each facet and how many of them are corners."""
    corners = {FACETS[name].nodes: FACETS[name].corners for name in element.facet_elements}
    for row in element.facets:
        own = row[row != NO_NODE]
        yield own, corners[len(own)]


def newell_normal(loop):
    """Normal of a polygon by Newell's sum over its edges."""
    following = np.roll(loop, -1, axis=0)
    return np.cross(loop, following).sum(axis=0) / 2


@pytest.mark.parametrize("name", EVERY)
def test_permuted_vtk_points_are_the_points_of_basix(name):
    """points[from_vtk] are Basix' nodes, exactly."""
    element = EVERY[name]
    np.testing.assert_array_equal(element.points[element.from_vtk], basix_nodes(element))


@pytest.mark.parametrize("name", EVERY)
def test_permutations_undo_each_other(name):
    """to_vtk after from_vtk is the identity, and both are permutations."""
    element = EVERY[name]
    every = np.arange(element.nodes)
    np.testing.assert_array_equal(np.sort(element.from_vtk), every)
    np.testing.assert_array_equal(element.from_vtk[element.to_vtk], every)


@pytest.mark.parametrize("name", VTK_EDGES)
def test_midside_nodes_lie_where_vtk_puts_them(name):
    """Node corners + i is the midpoint of VTK's edge, face or cell i."""
    element = EVERY[name]
    middles = [element.points[list(ends)].mean(axis=0) for ends in VTK_EDGES[name]]
    np.testing.assert_array_equal(element.points[element.corners :], middles)


@pytest.mark.parametrize("name", VTK_PLACES)
def test_nodes_on_faces_lie_at_vtks_parametric_coordinates(name):
    """As VTK states them, not by corners."""
    for node, place in VTK_PLACES[name].items():
        np.testing.assert_array_equal(ELEMENTS[name].points[node], place)


@pytest.mark.parametrize("name", ["Q1", "Q2", "Q2L"])
def test_hexahedron_corners_go_round_the_bottom_then_the_top(name):
    """VTK 12: counter-clockwise seen from above at z = 0, then the same at z = 1."""
    corners = ELEMENTS[name].points[:8]
    np.testing.assert_array_equal(corners[:, 2], [0, 0, 0, 0, 1, 1, 1, 1])
    np.testing.assert_array_equal(corners[:4, :2], corners[4:, :2])
    assert newell_normal(corners[:4])[2] == 1.0


@pytest.mark.parametrize("name", ["Pr1", "Pr2"])
def test_the_first_triangle_of_a_prism_turns_towards_the_second(name):
    """Gmsh's and meshio's wedge, and VTK's of 18 nodes: counter-clockwise seen from the top."""
    corners = ELEMENTS[name].points[:6]
    np.testing.assert_array_equal(corners[:, 2], [0, 0, 0, 1, 1, 1])
    np.testing.assert_array_equal(corners[:3, :2], corners[3:, :2])
    assert newell_normal(corners[:3])[2] == 0.5


@pytest.mark.parametrize("name", ELEMENTS)
def test_facet_nodes_close_the_cell_and_point_outward(name):
    """The facets' area vectors sum to zero, each points away from the centre; midpoints fit."""
    element = ELEMENTS[name]
    centre = element.points[: element.corners].mean(axis=0)
    total = np.zeros(3)
    for row, corners in loops(element):
        nodes = element.points[row]
        loop = nodes[:corners]
        normal = newell_normal(loop)
        assert normal @ (loop.mean(axis=0) - centre) > 0
        total += normal
        if element.degree == 2:
            middles = (loop + np.roll(loop, -1, axis=0)) / 2
            np.testing.assert_array_equal(nodes[corners : 2 * corners], middles)
            for node in nodes[2 * corners :]:
                np.testing.assert_array_equal(node, loop.mean(axis=0))
    np.testing.assert_allclose(total, 0, atol=1e-15)


@pytest.mark.parametrize("name", ELEMENTS)
def test_every_facet_node_is_on_the_facet_and_none_is_missing(name):
    """A facet holds exactly the cell's nodes in its plane."""
    element = ELEMENTS[name]
    for row, _ in loops(element):
        a, b, c = element.points[row[:3]]
        distance = (element.points - a) @ np.cross(b - a, c - a)
        np.testing.assert_array_equal(np.sort(row), np.flatnonzero(np.abs(distance) < 1e-14))


@pytest.mark.parametrize("name", ELEMENTS)
def test_facets_stay_outward_in_kernel_order(name):
    """(v1 − v0) × (v2 − v0) of Basix' vertices points out: the kernels' normal."""
    element = ELEMENTS[name]
    order = {FACETS[kind].nodes: FACETS[kind].from_vtk for kind in element.facet_elements}
    centre = element.points[: element.corners].mean(axis=0)
    for row, _ in loops(element):
        a, b, c = element.points[row[order[len(row)]][:3]]
        assert np.cross(b - a, c - a) @ (a - centre) > 0


@pytest.mark.parametrize("name", EVERY)
def test_shape_functions_are_those_of_a_partition_of_unity(name):
    """One at their own node, zero at the others, and they sum to one anywhere."""
    element = EVERY[name]
    np.testing.assert_allclose(element.values(element.points), np.eye(element.nodes), atol=1e-13)
    at = np.random.default_rng(1).uniform(0.05, 0.3, (5, element.cell.dim))
    np.testing.assert_allclose(element.values(at).sum(axis=1), 1, atol=1e-13)


@pytest.mark.parametrize("name", EVERY)
def test_shape_gradients_are_those_of_basix(name):
    """Same gradients as Basix' Lagrange element or, for serendipity, its span made nodal."""
    element = EVERY[name]
    cell = basix.CellType[element.cell.name]
    at = np.random.default_rng(1).uniform(0.05, 0.3, (5, element.cell.dim))
    if element.name in ("Q2", "S2"):
        moments = basix.create_element(
            basix.ElementFamily.serendipity,
            cell,
            2,
            basix.LagrangeVariant.legendre,
            basix.DPCVariant.legendre,
        )
        nodal = np.linalg.inv(moments.tabulate(0, basix_nodes(element))[0, :, :, 0])
        slopes = moments.tabulate(1, at)[1:, :, :, 0]
        expected = np.einsum("dqm,mn->qnd", slopes, nodal)
    else:
        lagrange = basix.create_element(
            basix.ElementFamily.P, cell, element.degree, basix.LagrangeVariant.equispaced
        )
        expected = np.moveaxis(lagrange.tabulate(1, at)[1:, :, :, 0], 0, 2)
    ours = element.gradients(at)[:, element.from_vtk]
    np.testing.assert_allclose(ours, expected, atol=1e-12)


@pytest.mark.parametrize("name", EVERY)
def test_meshio_knows_the_type_with_as_many_nodes(name):
    """meshio's cell type exists and has the element's number of nodes."""
    meshio = pytest.importorskip("meshio")
    block = meshio.CellBlock(EVERY[name].meshio, np.arange(EVERY[name].nodes)[None, :])
    assert block.dim == EVERY[name].cell.dim


def test_tables_are_read_only():
    """The tables are shared by every mesh, so nobody may change them."""
    with pytest.raises(ValueError, match="read-only"):
        ELEMENTS["Q2"].from_vtk[0] = 1
