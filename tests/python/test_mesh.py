"""Meshes: geometry against closed forms, and each fault refused in one sentence."""

from __future__ import annotations

from itertools import permutations

import numpy as np
import pytest

from supple.errors import InputError, MeshError
from supple.kernels.cells import ELEMENTS, FACETS
from supple.mesh import Mesh, Tag
from supple.mesh_topology import all_facets

SIZE = np.array([4.0, 1.5, 2.0])


def block(element):
    """A box with a corner that is not the origin, other counts on each axis, and four tags."""
    mesh = Mesh.box((4, 2, 3), SIZE, element, origin=(1.0, -2.0, 0.5))
    tags = {
        "base": Tag("facets", mesh.boundary(lambda p: p[:, 0] == 1.0)),
        "edge": Tag("facets", mesh.boundary((mesh.points[:, [0, 2]] == [1.0, 0.5]).any(axis=1))),
        "first": Tag("cells", np.arange(3)),
        "tip": Tag("points", mesh.nodes(lambda p: p[:, 0] == 5.0)),
    }
    return Mesh(mesh.points, mesh.cells, element, tags)


def loops(mesh, facets):
    """Which facets are of each kind, and their corners (k, corners, 3)."""
    for kind in (FACETS[name] for name in mesh.table.facet_elements):
        rows = (facets >= 0).sum(axis=1) == kind.nodes
        yield rows, mesh.points[facets[rows, : kind.corners]]


def facet_areas(mesh, facets):
    """Area vectors of flat facets by Newell's sum over the corners."""
    areas = np.zeros((len(facets), 3))
    for rows, loop in loops(mesh, facets):
        areas[rows] = np.cross(loop, np.roll(loop, -1, axis=1)).sum(axis=1) / 2
    return areas


@pytest.fixture(params=ELEMENTS)
def mesh(request):
    """The block in every element."""
    return block(request.param)


def test_box_has_the_volume_and_extents_of_the_box(mesh):
    """4 · 1.5 · 2 m³ and each cell an equal part of it; largest extent 4 m."""
    assert mesh.volume == pytest.approx(12.0, rel=1e-13)
    assert mesh.size == 4.0
    np.testing.assert_array_equal(mesh.points.min(axis=0), [1.0, -2.0, 0.5])
    np.testing.assert_allclose(mesh.points.max(axis=0), np.add(SIZE, [1.0, -2.0, 0.5]))
    assert len(mesh.cells) == 24 * {"P": 6, "Q": 1, "Pr": 2}[mesh.element.rstrip("12L")]
    parts = [Mesh(mesh.points[c], [np.arange(len(c))], mesh.element).volume for c in mesh.cells]
    np.testing.assert_allclose(parts, 12.0 / len(mesh.cells), rtol=1e-12)


def test_box_counts_nodes_as_its_grid_does(mesh):
    """Vertices 5·3·4; edges: three directions, diagonals of faces and blocks; faces; blocks."""
    x, y, z = 4, 2, 3
    vertices = (x + 1) * (y + 1) * (z + 1)
    straight = x * (y + 1) * (z + 1) + (x + 1) * y * (z + 1) + (x + 1) * (y + 1) * z
    flat, upright = x * y * (z + 1), x * (y + 1) * z + (x + 1) * y * z
    others = {
        "P2": straight + flat + upright + x * y * z,
        "Q2": straight,
        "Q2L": straight + flat + upright + x * y * z,
        "Pr2": straight + flat + upright + x * y * z,  # the last on the diagonal cut of each block
    }
    assert len(mesh.points) == vertices + others.get(mesh.element, 0)


def test_tetrahedra_go_round_the_diagonal():
    """Each of the six is a path 000 → 111 along the axes, one for each order of the axes."""
    mesh = Mesh.box((1, 1, 1), (1.0, 1.0, 1.0))
    found = {tuple(sorted(map(tuple, mesh.points[cell]))) for cell in mesh.cells}
    paths = {
        tuple(sorted(tuple(np.eye(3)[list(order[:k])].sum(axis=0)) for k in range(4)))
        for order in permutations(range(3))
    }
    assert found == paths


def test_boundary_is_closed_outward_and_has_the_area_of_the_box(mesh):
    """Area vectors sum to zero, each face's to its area along its outward axis."""
    facets = mesh.boundary()
    areas = facet_areas(mesh, facets)
    np.testing.assert_allclose(areas.sum(axis=0), 0, atol=1e-13)
    assert np.linalg.norm(areas, axis=1).sum() == pytest.approx(2 * (6 + 3 + 8))
    end = mesh.boundary(lambda p: np.isclose(p[:, 0], 5.0))
    np.testing.assert_allclose(facet_areas(mesh, end).sum(axis=0), [3, 0, 0], atol=1e-14)


def test_divergence_theorem_gives_the_volume(mesh):
    """∮ x·n da / 3 over the boundary's flat facets is the volume."""
    facets = mesh.boundary()
    centres = np.zeros((len(facets), 3))
    for rows, loop in loops(mesh, facets):
        centres[rows] = loop.mean(axis=1)
    assert (centres * facet_areas(mesh, facets)).sum() / 3 == pytest.approx(12.0, rel=1e-13)


@pytest.mark.parametrize("element", ["Pr1", "Pr2"])
def test_triangles_of_prisms_stand_beside_quadrilaterals(element):
    """Two triangles a block below and above, one quadrilateral a block on the sides; ends in -1."""
    mesh = block(element)
    table = mesh.table
    assert [FACETS[name].corners for name in table.facet_elements] == [3, 4]
    three, four = (FACETS[name].nodes for name in table.facet_elements)
    facets = mesh.boundary()
    filled = (facets >= 0).sum(axis=1)
    assert (filled == three).sum() == 2 * 2 * 4 * 2
    assert (filled == four).sum() == 2 * (4 * 3 + 2 * 3)
    assert (facets[filled == three, three:] == -1).all()
    top = mesh.boundary(lambda p: p[:, 2] == 2.5)
    assert len(top) == 2 * 4 * 2
    np.testing.assert_array_equal(top[:, three:], -1)
    assert (mesh.boundary(lambda p: p[:, 0] == 1.0) >= 0).all()


@pytest.mark.parametrize("element", ["P2", "Q2", "Q2L", "Pr2"])
def test_curved_cells_have_the_volume_of_their_map(element):
    """x + a y², y, z + b y x: det = 1 everywhere, so the volume stays; degree 2 maps are exact."""
    straight = Mesh.box((2, 2, 2), (1.0, 1.0, 1.0), element)
    x, y, z = straight.points.T
    curved = straight.moved(np.column_stack([x + 0.3 * y**2, y, z + 0.2 * x * y]))
    assert curved.volume == pytest.approx(1.0, rel=1e-13)


def test_quality_of_known_shapes():
    """Regular tetrahedron and cube 1; the unit corner by Liu and Joe's formula of its edges."""
    regular = np.array([[1, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1.0]])
    assert Mesh(regular, [[0, 2, 1, 3]], "P1").quality() == pytest.approx(1.0)
    assert Mesh.box((1, 1, 1), (2.0, 2.0, 2.0), "Q1").quality() == pytest.approx(1.0)
    triangle = np.array([[0, 0, 0], [1, 0, 0], [0.5, 3**0.5 / 2, 0]])
    prism = np.vstack([triangle, triangle + np.array([0, 0, 1])])
    assert Mesh(prism, [np.arange(6)], "Pr1").quality() == pytest.approx(1.0)
    # A prism of height h: 3 (h det)^(2/3) / (2 + h²), det and ‖·‖² of the regular one being 1, 3.
    low = Mesh(prism * [1, 1, 0.5], [np.arange(6)], "Pr1").quality()
    assert low == pytest.approx(3 * 0.5 ** (2 / 3) / 2.25)
    corner = ELEMENTS["P1"].points
    # Liu and Joe: 12 (3 V)^(2/3) / Σ l², V = 1/6, three edges of length 1 and three of √2.
    expected = 12 * 0.5 ** (2 / 3) / 9
    assert Mesh(corner, [[0, 1, 2, 3]], "P1").quality() == pytest.approx(expected)


def test_nodes_chosen_four_ways_are_the_same(mesh):
    """Callable, mask, ids in any order, and tag; a tag of facets stands for all their nodes."""
    expected = np.flatnonzero(mesh.points[:, 0] == 1.0)
    for where in (lambda p: p[:, 0] == 1.0, mesh.points[:, 0] == 1.0, expected[::-1], "base"):
        np.testing.assert_array_equal(mesh.nodes(where), expected)
    np.testing.assert_array_equal(mesh.nodes("first"), np.unique(mesh.cells[:3]))
    at_edge = (mesh.points[:, [0, 2]] == [1.0, 0.5]).any(axis=1)
    np.testing.assert_array_equal(mesh.nodes("edge"), np.flatnonzero(at_edge))
    for name in ("base", "edge"):
        np.testing.assert_array_equal(mesh.boundary(name), mesh.tags[name].ids)
    np.testing.assert_array_equal(mesh.cell_ids("first"), mesh.cell_ids([2, 0, 1]))


def test_facets_of_a_tag_are_turned_outward(mesh):
    """Tagged facets given inside out come back outward; an inner facet is no boundary."""
    backwards = {3: [0, 2, 1], 4: [0, 3, 2, 1], 6: [0, 2, 1, 5, 4, 3]}
    backwards |= {8: [0, 3, 2, 1, 7, 6, 5, 4], 9: [0, 3, 2, 1, 7, 6, 5, 4, 8]}
    outside = mesh.boundary(lambda p: p[:, 0] == 1.0)
    inward = backwards[outside.shape[1]]
    every = all_facets(mesh.cells, mesh.table)
    middle = every[(mesh.points[every, 0] == 2.0).all(axis=1)]
    tags = {"base": Tag("facets", np.vstack([outside[:, inward], middle]))}
    tagged = Mesh(mesh.points, mesh.cells, mesh.element, tags)
    np.testing.assert_array_equal(tagged.boundary("base"), outside)


@pytest.mark.parametrize(
    ("where", "error", "says"),
    [
        ("bose", MeshError, "did you mean 'base'"),
        ("zzz", MeshError, "'first', 'tip'"),
        (lambda p: p[:, 0] > 99, InputError, "no nodes chosen"),
        (lambda p: p[:, 0], InputError, "booleans"),
        ([], InputError, "no nodes chosen"),
        ([0, 10**6], InputError, "nodes 1000000, outside"),
        ([-1], InputError, "nodes -1, outside"),
        ([0.5], InputError, "integer ids"),
        (np.ones(3, bool), InputError, "must have shape"),
    ],
)
def test_nodes_that_cannot_be_chosen_say_why(where, error, says):
    """No silent empty support: each wrong `where` is an InputError."""
    with pytest.raises(error, match=says):
        block("P1").nodes(where)


def test_cells_and_facets_that_cannot_be_chosen_say_why():
    """A tag of another kind, and nodes without a whole facet."""
    mesh = block("P1")
    with pytest.raises(InputError, match="names points, where cells"):
        mesh.cell_ids("tip")
    with pytest.raises(InputError, match="no boundary facet"):
        mesh.boundary([0])


UNIT = ELEMENTS["P1"].points
TWO = np.vstack([UNIT, [1.0, 1.0, 1.0]])


@pytest.mark.parametrize(
    ("points", "cells", "says"),
    [
        (UNIT, [[0, 2, 1, 3]], "every cell is inverted"),
        (TWO, [[0, 1, 2, 3], [1, 2, 4, 3]], "cells 1 are inverted"),
        (UNIT * [1, 1, 0], [[0, 1, 2, 3]], "no volume"),
        (UNIT, [[0, 1, 2, 2]], "cells 0 name a node twice"),
        (TWO, [[0, 1, 2, 3], [1, 2, 3, 4], [3, 1, 2, 4]], "cells 2 repeat"),
        (TWO, [[0, 1, 2, 3]], r"1 of 5 nodes \(4\) belong to no cell"),
        (np.where(UNIT == 1, np.nan, UNIT), [[0, 1, 2, 3]], "points 1, 2, 3 hold NaN"),
        (UNIT, [[0, 1, 2, 4]], "outside 0 to 3"),
        (UNIT, [[0, 1, 2, -1]], "outside 0 to 3"),
        (UNIT, [[0.0, 1.0, 2.0, 3.0]], "integer"),
        (UNIT, [[0, 1, 2]], r"shape \(n, 4\)"),
        (UNIT, np.empty((0, 4), int), "at least one cell"),
        (UNIT[:, :2], [[0, 1, 2, 3]], r"shape \(n, 3\)"),
        (None, [[0, 1, 2, 3]], "points must"),
    ],
)
def test_a_wrong_mesh_is_refused_with_the_first_bad_ids(points, cells, says):
    """Every fault of a mesh in memory, each with its own sentence."""
    with pytest.raises(MeshError, match=says):
        Mesh(points, cells, "P1")


def test_overlapping_cells_are_refused():
    """Three tetrahedra on one facet cannot all lie beside it."""
    points = np.vstack([UNIT, [0.9, 1.0, 1.0], [1.0, 0.9, 1.0]])
    with pytest.raises(MeshError, match="share a facet"):
        Mesh(points, [[0, 1, 2, 3], [1, 2, 3, 4], [1, 2, 3, 5]], "P1")


@pytest.mark.parametrize("element", ["P2", "Q2", "Q2L", "Pr2"])
def test_a_midside_node_pulled_too_far_is_an_inverted_cell(element):
    """A midside node past 1/4 of its edge makes det < 0 at the corner (Barsoum's limit)."""
    mesh = Mesh.box((1, 1, 1), (1.0, 1.0, 1.0), element)
    middle = mesh.cells[0, mesh.table.corners]
    ends = mesh.points[mesh.cells[0, list(mesh.table.cell.edges[0])]]
    points = mesh.points.copy()
    points[middle] = 0.7 * ends[0] + 0.3 * ends[1]
    mesh.moved(points)
    points[middle] = 0.8 * ends[0] + 0.2 * ends[1]
    with pytest.raises(MeshError, match="inverted at a corner"):
        mesh.moved(points)


def test_wrong_tags_and_arguments_are_refused():
    """Tags out of range or off the mesh; an element, counts and sizes that make no sense."""
    cells = [[0, 1, 2, 3]]
    for tag, says in [
        (Tag("points", [4]), "outside 0 to 3"),
        (Tag("cells", [1]), "outside 0 to 0"),
        (Tag("facets", [[0, 1]]), r"shape \(n, 3\)"),
        ([1, 2], "supple.Tag"),
    ]:
        with pytest.raises(MeshError, match=says):
            Mesh(UNIT, cells, "P1", {"t": tag})
    with pytest.raises(MeshError, match="kind of a tag"):
        Tag("cell", [0])
    for wrong in ("P2", "Q2", "P1", "x"):
        with pytest.raises(MeshError, match=r"can be elevated|must be one of"):
            (block("P2") if wrong == "P2" else block("P1")).elevated(wrong)
    prism = ELEMENTS["Pr1"].points
    for rows, says in [
        ([[0, 2, 1, 3]], "facets of no cell"),
        ([[0, 2, 1]], r"shape \(n, 4\)"),
        ([[0, 2, -1, 1]], "must hold 3 or 4 nodes and then -1"),
        ([[0, 2, -1, -1]], "must hold 3 or 4 nodes"),
        ([[0, 2, 1, -2]], "outside 0 to 5"),
    ]:
        with pytest.raises(MeshError, match=says):
            Mesh(prism, [np.arange(6)], "Pr1", {"t": Tag("facets", rows)})
    with pytest.raises(MeshError, match=r"P1, P2, Q1, Q2, Q2L, Pr1, Pr2, got"):
        Mesh(UNIT, cells, "P3")
    for counts, size in [((0, 1, 1), (1, 1, 1)), ((1, 1), (1, 1, 1)), ((1, 1, 1), (1, -1, 1))]:
        with pytest.raises(MeshError):
            Mesh.box(counts, size)


def test_moved_keeps_cells_and_tags_and_leaves_the_first_mesh(mesh):
    """Twice the lengths, eight times the volume."""
    twice = mesh.moved(2 * mesh.points)
    assert twice.volume == pytest.approx(8 * mesh.volume)
    assert twice.cells is mesh.cells
    assert twice.tags is mesh.tags
    np.testing.assert_array_equal(twice.boundary(), mesh.boundary())
    assert mesh.size == 4.0
    with pytest.raises(MeshError, match="every cell is inverted"):
        mesh.moved(-mesh.points)
    with pytest.raises(MeshError, match="shape"):
        mesh.moved(mesh.points[:-1])


@pytest.mark.parametrize("element", ["P2", "Q2", "Q2L", "Pr2"])
def test_elevated_mesh_carries_the_tags_of_the_same_places(element):
    """Tags of degree 1 become those that the geometry gives at degree 2."""
    low = block(element.rstrip("2L") + "1")
    ours = low.elevated(element)
    direct = block(element)
    assert ours.element == element
    if element != "Q2L":
        assert low.elevated().element == element
    np.testing.assert_array_equal(ours.cells, direct.cells)
    for name, tag in direct.tags.items():
        np.testing.assert_array_equal(ours.tags[name].ids, tag.ids)


def test_arrays_are_read_only_copies(mesh):
    """Neither the caller's arrays nor the mesh's own can change it."""
    with pytest.raises(ValueError, match="read-only"):
        mesh.points[0] = 9
    with pytest.raises(ValueError, match="read-only"):
        mesh.boundary()[0] = 9
    with pytest.raises(AttributeError):
        mesh.points = 1
