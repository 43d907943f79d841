"""Surfaces and scans: what is read is what was written, and what is wrong is refused."""

from __future__ import annotations

import numpy as np
import pytest

from supple.errors import InputError, MeshError
from supple.surface import Surface

# A tetrahedron of 100 mm edges along the axes, outward.
POINTS = np.array([[0, 0, 0], [0.1, 0, 0], [0, 0.1, 0], [0, 0, 0.1]])
TRIANGLES = np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]])


def test_areas_and_normals_of_a_right_tetrahedron():
    """Legs 0.1 m: 5e-3 m² thrice, √3/2 · 1e-2 m² once; the area vectors sum to zero."""
    surface = Surface(POINTS, TRIANGLES)
    np.testing.assert_allclose(surface.areas, [5e-3, 5e-3, 3**0.5 / 2 * 1e-2, 5e-3])
    np.testing.assert_allclose(surface.normals[2], 3**-0.5)
    np.testing.assert_allclose(surface.areas @ surface.normals, 0, atol=1e-17)
    assert surface.size == 0.1


@pytest.mark.parametrize("unit", ["mm", "m", "cm"])
def test_ply_round_trip_in_any_unit_names_unit_and_frame(tmp_path, unit):
    """Metres in, the file's unit on disk, metres out to rounding."""
    path = Surface(POINTS, TRIANGLES).write(tmp_path / "s.ply", unit=unit)
    back = Surface.read(path, unit=unit)
    np.testing.assert_allclose(back.points, POINTS, rtol=1e-15)
    np.testing.assert_array_equal(back.triangles, TRIANGLES)
    header = path.read_bytes().split(b"end_header")[0].decode()
    assert f"comment unit {unit}" in header
    assert "comment frame LPS" in header
    assert [p.name for p in tmp_path.iterdir()] == ["s.ply"]


def test_values_of_points_are_a_scalar_property_in_the_file(tmp_path):
    """Read back by trimesh, to the last bit; the surface reads as it does without them."""
    trimesh = pytest.importorskip("trimesh")
    surface = Surface(POINTS, TRIANGLES)
    sd = [0.1, 2.0, np.pi, 4.0]
    file = surface.write(tmp_path / "s.ply", values={"sd": sd})
    kept = trimesh.load(file, process=False).metadata["_ply_raw"]["vertex"]["data"]
    assert kept["sd"].ravel().tolist() == sd
    np.testing.assert_allclose(Surface.read(file).points, surface.points, atol=1e-15)
    with pytest.raises(InputError, match=r"values must be \(4,\)"):
        surface.write(tmp_path / "t.ply", values={"sd": sd[:3]})


def test_ascii_files_of_each_format_are_the_same_surface(tmp_path):
    """A triangle pair as OBJ (texture seams, one quadrilateral), OFF, STL, PLY with extra data."""
    obj = (
        "v 0 0 0\nv 100 0 0\nv 100 100 0\nv 0 100 0\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nvt .5 .5\n"
        "f 1/1 2/2 3/3\nf 1/5 3/4 4/1\n"
    )
    off = "OFF\n4 2 0\n0 0 0\n100 0 0\n100 100 0\n0 100 0\n3 0 1 2\n3 0 2 3\n"
    ply = (
        "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\n"
        "property float z\nproperty uchar red\nelement face 1\n"
        "property list uchar int vertex_index\nend_header\n"
        "0 0 0 9\n100 0 0 9\n100 100 0 9\n0 100 0 9\n4 0 1 2 3\n"
    )
    corners = [(0, 0, 0), (100, 0, 0), (100, 100, 0), (0, 0, 0), (100, 100, 0), (0, 100, 0)]
    loops = [
        "facet normal 0 0 1\nouter loop\n"
        + "".join(f"vertex {x} {y} {z}\n" for x, y, z in corners[i : i + 3])
        + "endloop\nendfacet\n"
        for i in (0, 3)
    ]
    stl = "solid s\n" + "".join(loops) + "endsolid s\n"
    for suffix, text in (("obj", obj), ("off", off), ("ply", ply), ("stl", stl)):
        path = tmp_path / f"s.{suffix}"
        path.write_text(text)
        surface = Surface.read(path)
        assert (len(surface.points), len(surface.triangles)) == (4, 2), suffix
        np.testing.assert_allclose(surface.areas.sum(), 0.01)
        np.testing.assert_allclose(surface.normals, [[0, 0, 1]] * 2, atol=1e-15)


def test_a_point_cloud_must_be_asked_for(tmp_path):
    """Points alone are refused with the way out, and then accepted."""
    path = Surface(POINTS).write(tmp_path / "cloud.ply")
    with pytest.raises(MeshError, match="points_only=True"):
        Surface.read(path)
    cloud = Surface.read(path, points_only=True)
    assert cloud.triangles.shape == (0, 3)
    np.testing.assert_allclose(cloud.points, POINTS, rtol=1e-15)


def test_metres_read_as_millimetres_are_noticed_and_the_reverse(tmp_path):
    """A body of 0.1 to 1 in the file is in metres, one of 100 to 1000 is in millimetres."""
    path = Surface(POINTS, TRIANGLES).write(tmp_path / "s.ply", unit="m")
    with pytest.raises(InputError, match="pass unit='m'"):
        Surface.read(path, unit="mm")
    path = Surface(POINTS, TRIANGLES).write(tmp_path / "s.ply", unit="mm")
    with pytest.raises(InputError, match="pass unit='mm'"):
        Surface.read(path, unit="m")


def test_triangles_without_area_are_left_out_on_reading(tmp_path):
    """A scan's collapsed triangle disappears; given in memory it is refused by number."""
    path = tmp_path / "s.off"
    path.write_text("OFF\n4 2 0\n0 0 0\n100 0 0\n0 100 0\n50 50 0\n3 0 1 2\n3 1 3 2\n")
    assert len(Surface.read(path).triangles) == 1
    with pytest.raises(MeshError, match="triangles 1 have no area"):
        Surface(POINTS, [[0, 1, 2], [1, 1, 3]])


@pytest.mark.parametrize(
    ("points", "triangles", "says"),
    [
        (np.where(POINTS == 0.1, np.nan, POINTS), TRIANGLES, "NaN"),
        (POINTS[:, :2], TRIANGLES, r"\(n, 3\)"),
        (np.empty((0, 3)), np.empty((0, 3), int), r"\(n, 3\)"),
        (POINTS, TRIANGLES + 1, "outside 0 to 3"),
        (POINTS, TRIANGLES.astype(float), "integer"),
    ],
)
def test_wrong_arrays_are_refused(points, triangles, says):
    """Each fault has its own sentence."""
    with pytest.raises(MeshError, match=says):
        Surface(points, triangles)


def test_wrong_files_are_refused(tmp_path):
    """Missing, empty, truncated, nonsense, NaN, unknown format, unknown unit, no folder."""
    good = Surface(POINTS, TRIANGLES).write(tmp_path / "good.ply")
    cut = tmp_path / "cut.ply"
    cut.write_bytes(good.read_bytes()[:-20])
    (tmp_path / "empty.ply").touch()
    (tmp_path / "words.ply").write_text("this is no surface\n")
    (tmp_path / "nan.off").write_text("OFF\n3 1 0\nnan 0 0\n100 0 0\n0 100 0\n3 0 1 2\n")
    (tmp_path / "s.xyz").write_text("0 0 0\n")
    for name in ("missing.ply", "empty.ply", "cut.ply", "words.ply", "nan.off", "s.xyz"):
        with pytest.raises(InputError, match=name.replace("nan.off", "NaN")):
            Surface.read(tmp_path / name)
    with pytest.raises(InputError, match="did you mean"):
        Surface.read(good, unit="mn")
    with pytest.raises(InputError, match="no folder"):
        Surface(POINTS).write(tmp_path / "nowhere" / "s.ply")
    with pytest.raises(InputError, match=r"\.ply"):
        Surface(POINTS).write(tmp_path / "s.stl")


def test_arrays_are_read_only_copies():
    """Changing the caller's array changes nothing, and the surface's own cannot be changed."""
    points = POINTS.copy()
    surface = Surface(points, TRIANGLES)
    points[0] = 9
    np.testing.assert_array_equal(surface.points, POINTS)
    with pytest.raises(ValueError, match="read-only"):
        surface.points[0] = 9
