"""Mesh files: what is written reads back, groups become tags, damaged files are refused."""

from __future__ import annotations

import numpy as np
import pytest

from supple.errors import InputError, MeshError
from supple.kernels.cells import ELEMENTS, FACETS
from supple.mesh import Mesh, Tag

UNIT = ELEMENTS["P1"].points
TWO = np.vstack([UNIT, [1.0, 1.0, 1.0]])
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


def test_vtu_round_trip_keeps_everything_and_names_frame_and_unit(mesh, tmp_path):
    """Points to the bit, cells, every tag, data under its name; no file is left aside."""
    path = mesh.write(
        tmp_path / "m.vtu",
        point_data={"displacement [m]": mesh.points},
        cell_data={"J": np.ones(len(mesh.cells)), "stress [Pa]": np.ones((len(mesh.cells), 3, 3))},
    )
    back = Mesh.read(path)
    np.testing.assert_array_equal(back.points, mesh.points)
    np.testing.assert_array_equal(back.cells, mesh.cells)
    assert back.element == mesh.element
    assert back.tags.keys() == mesh.tags.keys()
    for name, tag in mesh.tags.items():
        assert back.tags[name].kind == tag.kind
        np.testing.assert_array_equal(back.tags[name].ids, tag.ids)
    text = path.read_text(encoding="utf-8")
    assert 'Name="frame: LPS"' in text
    assert 'Name="unit: m"' in text
    assert [p.name for p in tmp_path.iterdir()] == ["m.vtu"]
    with pytest.raises(InputError, match="says that it is in m"):
        Mesh.read(path, unit="mm")


def test_wrong_data_writes_no_file(mesh, tmp_path):
    """One value too few, words, another suffix, a folder that is not there."""
    short = np.ones(len(mesh.points) - 1)
    for data, name in [
        ({"a": short}, "m.vtu"),
        ({"a": ["x"] * len(mesh.points)}, "m.vtu"),
        ({}, "m.stl"),
        ({}, "no/m.vtu"),
    ]:
        with pytest.raises(InputError):
            mesh.write(tmp_path / name, point_data=data)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("file_format", ["gmsh22", "gmsh", "vtk", "abaqus", "medit"])
def test_common_formats_read_back_to_the_same_mesh(tmp_path, file_format):
    """Written by meshio in mm, read in m, for each element that the format holds."""
    meshio = pytest.importorskip("meshio")
    suffix = {"gmsh22": "msh", "gmsh": "msh", "vtk": "vtk", "abaqus": "inp", "medit": "mesh"}
    # meshio writes Gmsh's prism of 18 nodes in its own order: see the test of Gmsh's order below.
    known = {
        "gmsh22": [e for e in ELEMENTS if e != "Pr2"],
        "vtk": ELEMENTS,
        "medit": ("P1", "Q1", "Pr1"),
    }
    for element in known.get(file_format, ("P1", "Q1")):
        mesh = block(element)
        path = tmp_path / f"{element}.{suffix[file_format]}"
        raw = meshio.Mesh(mesh.points * 1e3, [(mesh.table.meshio, mesh.cells)])
        raw.write(path, file_format=file_format)
        back = Mesh.read(path, unit="mm")
        assert back.element == element
        np.testing.assert_array_equal(back.cells, mesh.cells)
        np.testing.assert_allclose(back.points, mesh.points, rtol=1e-12)


#: Gmsh reference manual, "Node ordering": corners that each node after them lies between.
GMSH_ORDER = {
    "Q2L": (12, [
        *[(0, 1), (0, 3), (0, 4), (1, 2), (1, 5), (2, 3), (2, 6), (3, 7), (4, 5), (4, 7)],
        *[(5, 6), (6, 7), (0, 1, 2, 3), (0, 1, 4, 5), (0, 3, 4, 7), (1, 2, 5, 6), (2, 3, 6, 7)],
        *[(4, 5, 6, 7), (0, 1, 2, 3, 4, 5, 6, 7)],
    ]),
    "Pr2": (13, [
        *[(0, 1), (0, 2), (0, 3), (1, 2), (1, 4), (2, 5), (3, 4), (3, 5), (4, 5)],
        *[(0, 1, 3, 4), (0, 2, 3, 5), (1, 2, 4, 5)],
    ]),
}  # fmt: skip


@pytest.mark.parametrize("element", GMSH_ORDER)
def test_a_file_in_gmshs_own_order_is_read_right(element, tmp_path):
    """One cell written by hand under x + 0.3 y², y, z + 0.2 x y (det 1): volume 1, or 1/2."""
    kind, between = GMSH_ORDER[element]
    corners = ELEMENTS[element].points[: ELEMENTS[element].corners]
    places = np.vstack([corners, [corners[list(c)].mean(axis=0) for c in between]])
    x, y, z = places.T
    points = np.column_stack([x + 0.3 * y**2, y, z + 0.2 * x * y])
    lines = [f"{i} {p[0]!r} {p[1]!r} {p[2]!r}" for i, p in enumerate(points.tolist(), 1)]
    cell = " ".join(str(i) for i in range(1, len(points) + 1))
    path = tmp_path / "g.msh"
    path.write_text(
        "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n"
        + "\n".join([str(len(points)), *lines])
        + f"\n$EndNodes\n$Elements\n1\n1 {kind} 2 1 1 {cell}\n$EndElements\n"
    )
    mesh = Mesh.read(path, unit="m")
    assert mesh.element == element
    assert mesh.volume == pytest.approx(1.0 if element == "Q2L" else 0.5, rel=1e-13)
    back = mesh.points[mesh.cells[0]]
    ours = ELEMENTS[element].points
    np.testing.assert_allclose(back[:, 1], ours[:, 1], atol=1e-15)
    np.testing.assert_allclose(back[:, 0], ours[:, 0] + 0.3 * ours[:, 1] ** 2, atol=1e-15)


#: Parametric coordinates of vtkWedge (type 13), vtkBiQuadraticQuadraticWedge (32) and
#: vtkTriQuadraticHexahedron (29); the first turns the other way round than the second.
VTK_CELLS = {
    "Pr1": (13, [(0, 0, 0), (0, 1, 0), (1, 0, 0), (0, 0, 1), (0, 1, 1), (1, 0, 1)]),
    "Pr2": (32, [
        *[(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (0, 1, 1)],
        *[(0.5, 0, 0), (0.5, 0.5, 0), (0, 0.5, 0), (0.5, 0, 1), (0.5, 0.5, 1), (0, 0.5, 1)],
        *[(0, 0, 0.5), (1, 0, 0.5), (0, 1, 0.5), (0.5, 0, 0.5), (0.5, 0.5, 0.5), (0, 0.5, 0.5)],
    ]),
    "Q2L": (29, [
        *[(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)],
        *[(0.5, 0, 0), (1, 0.5, 0), (0.5, 1, 0), (0, 0.5, 0)],
        *[(0.5, 0, 1), (1, 0.5, 1), (0.5, 1, 1), (0, 0.5, 1)],
        *[(0, 0, 0.5), (1, 0, 0.5), (1, 1, 0.5), (0, 1, 0.5)],
        *[(0, 0.5, 0.5), (1, 0.5, 0.5), (0.5, 0, 0.5), (0.5, 1, 0.5), (0.5, 0.5, 0)],
        *[(0.5, 0.5, 1), (0.5, 0.5, 0.5)],
    ]),
}  # fmt: skip


@pytest.mark.parametrize("element", VTK_CELLS)
def test_a_file_in_vtks_own_order_is_read_right_and_written_so(element, tmp_path):
    """One cell at VTK's parametric coordinates, by hand: volume 1/2 or 1; our VTU says the same."""
    kind, places = VTK_CELLS[element]
    count = len(places)
    path = tmp_path / "v.vtk"
    path.write_text(
        "# vtk DataFile Version 3.0\nby hand\nASCII\nDATASET UNSTRUCTURED_GRID\n"
        + f"POINTS {count} double\n"
        + "\n".join(" ".join(map(str, p)) for p in places)
        + f"\nCELLS 1 {count + 1}\n{count} {' '.join(map(str, range(count)))}\n"
        + f"CELL_TYPES 1\n{kind}\n"
    )
    mesh = Mesh.read(path, unit="m")
    assert mesh.element == element
    assert mesh.volume == pytest.approx(1.0 if element == "Q2L" else 0.5, rel=1e-14)
    np.testing.assert_array_equal(mesh.points[mesh.cells[0]], ELEMENTS[element].points)
    text = mesh.write(tmp_path / "v.vtu").read_text(encoding="utf-8")
    assert "binary" in text  # so look at what meshio's writer is handed by its reader's inverse
    np.testing.assert_array_equal(Mesh.read(tmp_path / "v.vtu").cells, mesh.cells)


GMSH22 = """$MeshFormat
2.2 0 8
$EndMeshFormat
$PhysicalNames
3
2 1 "base"
3 1 "fat"
3 2 "gland"
$EndPhysicalNames
$Nodes
6
1 9 9 9
2 0 0 0
3 1 0 0
4 0 1 0
5 0 0 1
6 1 1 1
$EndNodes
$Elements
4
1 15 2 7 1 2 2
2 2 2 1 1 2 4 3
3 4 2 1 1 2 3 4 5
4 4 2 2 2 3 4 5 6
$EndElements
"""


def test_physical_groups_become_tags_and_unused_nodes_go(tmp_path):
    """Names where the file has them, numbers elsewhere; ids follow the nodes that are kept."""
    path = tmp_path / "g.msh"
    path.write_text(GMSH22)
    mesh = Mesh.read(path, unit="m")
    assert len(mesh.points) == 5
    assert {name: (tag.kind, tag.ids.tolist()) for name, tag in mesh.tags.items()} == {
        "base": ("facets", [[0, 2, 1]]),
        "fat": ("cells", [0]),
        "gland": ("cells", [1]),
        "7": ("points", [0]),
    }
    assert facet_areas(mesh, mesh.boundary("base")).tolist() == [[0, 0, -0.5]]


def test_cell_data_become_tags_and_shared_names_are_told_apart(tmp_path):
    """Integer data "tissue" gives "tissue=1"; a number used for facets and cells alike splits."""
    meshio = pytest.importorskip("meshio")
    raw = meshio.Mesh(
        TWO,
        [("tetra", [[0, 1, 2, 3], [1, 2, 3, 4]]), ("triangle", [[0, 2, 1]])],
        cell_data={"gmsh:physical": [[1, 1], [1]], "tissue": [[1, 2], [1]]},
    )
    raw.write(tmp_path / "m.vtu")
    tags = Mesh.read(tmp_path / "m.vtu", unit="m").tags
    assert {name: tag.kind for name, tag in tags.items()} == {
        "1": "cells",
        "1 (facets)": "facets",
        "tissue=1": "cells",
        "tissue=2": "cells",
        "tissue=1 (facets)": "facets",
    }
    np.testing.assert_array_equal(tags["tissue=2"].ids, [1])


GMSH1 = """$NOD
4
1 0 0 0
20 1 0 0
3 0 1 0
4 0 0 1
$ENDNOD
$ELM
2
1 2 5 5 3 1 3 20
2 4 9 9 4 1 20 3 4
$ENDELM
"""


def test_gmsh1_is_read_with_sparse_node_numbers(tmp_path):
    """The unit tetrahedron, its base tagged 5 and its volume 9."""
    path = tmp_path / "m.msh"
    path.write_text(GMSH1)
    mesh = Mesh.read(path, unit="cm")
    assert mesh.volume == pytest.approx(1e-6 / 6)
    assert mesh.tags["5"].ids.tolist() == [[0, 2, 1]]
    assert mesh.tags["9"].kind == "cells"


def test_gmsh1_knows_prisms(tmp_path):
    """Gmsh's type 6: volume 1/2, the triangle below tagged 5 and a side tagged 6, a row each."""
    nodes = "".join(f"{i} {p[0]} {p[1]} {p[2]}\n" for i, p in enumerate(ELEMENTS["Pr1"].points))
    path = tmp_path / "m.msh"
    path.write_text(
        f"$NOD\n6\n{nodes}$ENDNOD\n$ELM\n3\n1 2 5 5 3 0 2 1\n2 3 6 6 4 0 1 4 3\n"
        "3 6 9 9 6 0 1 2 3 4 5\n$ENDELM\n"
    )
    mesh = Mesh.read(path, unit="m")
    assert (mesh.element, mesh.volume) == ("Pr1", pytest.approx(0.5))
    assert mesh.tags["5"].ids.tolist() == [[0, 2, 1, -1]]
    assert mesh.tags["6"].ids.tolist() == [[0, 1, 4, 3]]
    assert facet_areas(mesh, mesh.boundary("5")).tolist() == [[0, 0, -0.5]]
    assert mesh.nodes("5").tolist() == [0, 1, 2]


@pytest.mark.parametrize(
    ("old", "new", "says"),
    [
        ("$ENDELM\n", "$ENDELM\n\n//+\n", r"goes on after \$ENDELM, at line 14"),
        ("$ENDELM\n", "", "no complete .ELM"),
        ("\n2\n1 2", "\n3\n1 2", "no complete .ELM"),
        ("4 0 0 1\n", "4 0 0\n", "number and x y z"),
        ("1 20 3 4\n", "1 20 3 8\n", "unknown node"),
        ("1 20 3 4\n", "1 20 3\n", "cut short"),
        ("2 4 9 9 4", "2 11 9 9 4", "type other"),
    ],
)
def test_a_damaged_gmsh1_file_is_refused(tmp_path, old, new, says):
    """Strict where hands have been at work."""
    path = tmp_path / "m.msh"
    assert old in GMSH1
    path.write_text(GMSH1.replace(old, new))
    with pytest.raises(MeshError, match=says):
        Mesh.read(path, unit="m")


def test_files_that_are_no_volume_mesh_are_refused(tmp_path, capfd):
    """Missing, empty, nonsense, surface only, two kinds of volume cell; nothing is printed."""
    meshio = pytest.importorskip("meshio")
    (tmp_path / "empty.vtu").touch()
    (tmp_path / "words.msh").write_text("these are words\n")
    (tmp_path / "words.xyz").write_text("these are words\n")
    good = block("P1").write(tmp_path / "good.vtu")
    (tmp_path / "cut.vtu").write_bytes(good.read_bytes()[:900])
    meshio.Mesh(UNIT, [("triangle", [[0, 1, 2]])]).write(tmp_path / "surface.vtu")
    for name in ("missing", "empty", "words.msh", "words.xyz", "cut", "surface"):
        path = tmp_path / (name if "." in name else f"{name}.vtu")
        with pytest.raises(InputError, match=name):
            Mesh.read(path, unit="m")
    corners = np.vstack([ELEMENTS["Q1"].points, UNIT + 3])
    cells = [("hexahedron", [np.arange(8)]), ("tetra", [np.arange(8, 12)])]
    meshio.Mesh(corners, cells).write(tmp_path / "mixed.vtu")
    with pytest.raises(MeshError, match="mixes volume cells"):
        Mesh.read(tmp_path / "mixed.vtu", unit="m")
    assert len(Mesh.read(tmp_path / "mixed.vtu", unit="m", element="P1").cells) == 1
    with pytest.raises(InputError, match="does not name its unit"):
        Mesh.read(tmp_path / "mixed.vtu")
    assert capfd.readouterr() == ("", "")


@pytest.mark.parametrize(
    ("name", "element", "cells"),
    [("beam_p1_9", "P1", 192), ("beam_p2_18", "P2", 2550), ("beam_q2_24", "Q2", 1127)],
)
def test_sonics_beams_are_80_by_15_by_15_mm_with_base_and_top(shared, name, element, cells):
    """Volume 18,000 mm³; tag 1 is the base z = 0, tag 2 the top z = 80 mm, 225 mm² each."""
    path = shared / "data" / "beam_sonics" / f"{name}.vtu"
    mesh = Mesh.read(path, unit="mm")
    assert (mesh.element, len(mesh.cells)) == (element, cells)
    assert mesh.volume == pytest.approx(18000e-9, rel=1e-12)
    for tag, height, side in (("1", 0.0, -1), ("2", 0.08, 1)):
        np.testing.assert_allclose(mesh.points[mesh.nodes(tag), 2], height, atol=1e-12)
        total = facet_areas(mesh, mesh.boundary(tag)).sum(axis=0)
        np.testing.assert_allclose(total, [0, 0, side * 225e-6], atol=1e-15)


def test_the_liver_is_read_and_its_damaged_copy_refused(shared):
    """181 nodes, 596 tetrahedra; the copy goes on after its end."""
    folder = shared / "data" / "liver_sofa"
    mesh = Mesh.read(folder / "liver.msh", unit="m")
    assert (len(mesh.points), len(mesh.cells)) == (181, 596)
    with pytest.raises(MeshError, match=r"after \$ENDELM, at line 784"):
        Mesh.read(folder / "liver_with_trailing_text.msh", unit="m")
