"""What goes from the template to a scan comes back to where it was."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh

from supple import InputError, Surface
from supple.registration.lines import write_lines
from supple.registration.template import OnSurface
from supple.registration.transfer import Carried, Transfer

from .plate import HEIGHT, WIDTH, cap, plate

#: m, out of reach.
AHEAD = np.array([0, 0.05, 0])


@pytest.fixture(scope="module")
def torso():
    return plate(40, bend=4.0)


def finer(surface: Surface) -> Surface:
    """The same surface in four triangles for each one: other points, other numbers."""
    points, triangles = trimesh.remesh.subdivide(surface.points, surface.triangles)
    return Surface(points, triangles[::-1])


def moved_places(torso, count=500, seed=3):
    rng = np.random.default_rng(seed)
    return OnSurface(rng.integers(len(torso.triangles), size=count),
                     rng.dirichlet(np.ones(3), size=count))  # fmt: skip


def test_there_and_back_is_exact_where_skin_and_scan_are_one_surface(torso, rotation):
    """The scan is the skin, turned and shifted, in other triangles: each way undoes the other."""
    points = torso.points @ rotation.T + [0.3, -0.2, 1.1]
    transfer = Transfer(torso, points, finer(Surface(points, torso.triangles)))
    places = moved_places(torso)
    there = transfer.to_scan(places)
    assert there.on_scan.all()
    assert there.offset.max() < 1e-9 * WIDTH
    back = transfer.to_template(there.points)
    assert back.within.all()
    again = back.places.at(torso.points, torso.triangles)
    assert np.abs(again - places.at(torso.points, torso.triangles)).max() < 1e-9 * WIDTH


def test_a_linear_map_goes_there_and_back_exactly(torso):
    """Linear in each triangle, so the interpolation between the corners is exact."""
    transfer = Transfer(torso, torso.points, finer(Surface(torso.points, torso.triangles)))
    values = torso.points @ [[1.0, 2.0], [0.5, -1.0], [-3.0, 0.2]] + 7
    on_scan, known = transfer.map_to_scan(values)
    assert known.all()
    back, known = transfer.map_to_template(on_scan)
    assert known.all()
    assert np.abs(back - values).max() < 1e-9


def test_points_off_the_skin_land_on_the_scan_at_their_distance():
    """The scan is the plane of the plate, 4 mm in front of it: every point goes straight ahead."""
    flat = plate(20, *[lambda r: 0 * r] * 2)
    scan = Surface(flat.points - [0, 4e-3, 0], flat.triangles)
    there = Transfer(flat, flat.points, scan).to_scan(moved_places(flat))
    straight = moved_places(flat).at(flat.points, flat.triangles) - [0, 4e-3, 0]
    assert np.abs(there.points - straight).max() < 1e-12
    assert there.offset == pytest.approx(4e-3)


def test_over_a_hole_and_out_of_reach_points_stay_on_the_skin_and_say_so(torso):
    """The scan lacks the middle 64 mm and more; what is over that is off it, beyond it is on it."""
    middle = np.abs(torso.points[torso.triangles][:, :, 0]).max(axis=1) < 0.04
    scan = Surface(torso.points, torso.triangles[~middle])
    transfer = Transfer(torso, torso.points, scan)
    places = moved_places(torso)
    there = transfer.to_scan(places)
    at = places.at(torso.points, torso.triangles)
    inside = np.abs(at[:, 0]) < 0.025
    assert not there.on_scan[inside].any()
    assert np.array_equal(there.points[~there.on_scan], at[~there.on_scan])
    assert there.on_scan[np.abs(at[:, 0]) > 0.05].all()
    far = Transfer(torso, torso.points, Surface(torso.points - AHEAD, torso.triangles))
    assert not far.to_scan(places).on_scan.any()
    values, known = far.map_to_scan(torso.points)
    assert not known.any()
    assert np.isnan(values).all()


def test_a_sheet_that_faces_the_other_way_is_not_the_skin(torso):
    behind = Surface(torso.points + AHEAD / 10, torso.triangles[:, ::-1])
    assert not Transfer(torso, torso.points, behind).to_scan(moved_places(torso)).on_scan.any()


def test_noise_of_the_scan_does_not_take_the_drawing_off_it(torso):
    rng = np.random.default_rng(1)
    fine = finer(finer(Surface(torso.points, torso.triangles)))
    scan = Surface(fine.points + rng.normal(scale=2e-3, size=fine.points.shape), fine.triangles)
    curves = Transfer(torso, torso.points, scan).curves()
    assert min(curve.on_scan.mean() for curve in curves.values()) > 0.98
    assert max(curve.offset.max() for curve in curves.values()) < 6e-3


def test_curves_are_as_dense_as_asked_and_lie_on_the_scan(torso):
    transfer = Transfer(torso, torso.points, Surface(torso.points, torso.triangles))
    curves = transfer.curves(spacing=1e-3)
    assert set(curves) == set(torso.curves)
    for name, curve in curves.items():
        assert curve.closed == torso.curves[name].closed
        assert np.linalg.norm(np.diff(curve.points, axis=0), axis=1).max() < 1.5e-3
        first = torso.curve_points()[name][0]
        assert np.abs(curve.points[0] - first).max() < 1e-12


def test_of_a_cloud_of_points_all_stays_on_the_skin(torso):
    transfer = Transfer(torso, torso.points, Surface(torso.points))
    assert not transfer.to_scan(moved_places(torso)).on_scan.any()
    with pytest.raises(InputError, match="no triangles"):
        transfer.map_to_template(np.zeros(len(torso.points)))


@pytest.mark.parametrize(
    ("call", "match"),
    [
        (lambda t: t.map_to_scan(np.zeros(3)), "one for each of the template's vertices"),
        (lambda t: t.map_to_template(np.zeros(3)), "one for each of the scan's points"),
        (lambda t: t.to_template(np.zeros((2, 2))), r"finite \(k, 3\)"),
        (lambda t: t.to_template([[np.nan, 0, 0]]), "finite"),
    ],
)
def test_arrays_of_another_shape_are_refused(torso, call, match):
    with pytest.raises(InputError, match=match):
        call(Transfer(torso, torso.points, Surface(torso.points, torso.triangles)))


def test_vertices_of_another_template_are_refused(torso):
    with pytest.raises(InputError, match="vertices"):
        Transfer(torso, torso.points[:-1], Surface(torso.points, torso.triangles))


SQUARE = np.array([[0, 0, 0], [0.1, 0, 0], [0.1, 0, 0.1], [0, 0, 0.1]])


@pytest.fixture
def lines():
    on = np.array([True, True, False, True])
    return {"loop": Carried(SQUARE, on, np.zeros(4), closed=True),
            "open": Carried(SQUARE[:3] + 1, on[:3], np.zeros(3))}  # fmt: skip


def test_ply_holds_the_edges_in_mm(lines, tmp_path):
    """Read by hand, as the header says: a closed line of 4 points has 4 edges."""
    text = write_lines(tmp_path / "d.ply", lines).read_text().splitlines()
    end = text.index("end_header")
    head = text[:end]
    assert {"comment unit mm", "comment frame LPS", "element vertex 7", "element edge 6",
            "comment line loop vertices 0 to 3"} <= set(head)  # fmt: skip
    vertices = np.array([line.split() for line in text[end + 1 : end + 8]], dtype=float)
    assert vertices[:4, :3] == pytest.approx(1e3 * SQUARE)
    assert vertices[:, 3].tolist() == [1, 1, 0, 1, 1, 1, 0]
    edges = [tuple(map(int, line.split())) for line in text[end + 8 :]]
    assert edges == [(0, 1), (1, 2), (2, 3), (3, 0), (4, 5), (5, 6)]


def test_obj_holds_polylines_in_mm(lines, tmp_path):
    text = write_lines(tmp_path / "d.obj", lines).read_text().splitlines()
    assert text[:2] == ["# unit mm", "# frame LPS"]
    assert [line for line in text if line[0] == "l"] == ["l 1 2 3 4 1", "l 5 6 7"]
    assert [line for line in text if line[0] == "o"] == ["o loop", "o open"]
    vertices = [list(map(float, line[2:].split())) for line in text if line[:2] == "v "]
    assert np.array(vertices[:4]) == pytest.approx(1e3 * SQUARE)


def test_glb_holds_lines_that_stand_upright_in_metres(lines, tmp_path):
    """Read by trimesh, which applies the root's matrix: y up, +z to the front, m."""
    scene = trimesh.load(write_lines(tmp_path / "d.glb", lines))
    paths = dict(zip(scene.graph.nodes_geometry, scene.dump(), strict=True))
    loop = next(part for name, part in paths.items() if "loop" in name)
    expected = SQUARE[:, [0, 2, 1]] * [1, 1, -1]
    assert loop.length == pytest.approx(0.4, rel=1e-6)
    corners = np.unique(np.round(loop.vertices, 6), axis=0)
    assert np.abs(corners - expected[np.lexsort(expected.T[::-1])]).max() < 1e-6
    import pygltflib

    held = pygltflib.GLTF2().load(tmp_path / "d.glb")
    assert [mesh.primitives[0].mode for mesh in held.meshes] == [1, 1]
    assert held.asset.extras == {"unit": "mm", "frame": "LPS"}


def test_lines_of_another_format_are_refused(lines, tmp_path):
    with pytest.raises(InputError, match=r"\.ply, \.obj or \.glb"):
        write_lines(tmp_path / "d.stl", lines)
    assert list(tmp_path.iterdir()) == []


def test_the_plate_is_as_wide_as_it_says():
    assert np.ptp(plate(20, cap(), cap()).points, axis=0)[[0, 2]] == pytest.approx([WIDTH, HEIGHT])
