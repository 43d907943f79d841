"""Scans from files: unit and frame found and said; what is wrong is mended and said, or refused.

The body is an ellipse of 0.32 m by 0.22 m that two breasts bulge from, 0.5 m high, open above and
below: closed forms say which way its skin looks.
"""

from __future__ import annotations

import base64
import json
import struct
import time
import zlib

import numpy as np
import pytest

from supple.errors import InputError, MeshError
from supple.registration.scan_clean import clean, seen_from, tidy
from supple.registration.scan_file import read_scan
from supple.surface import Surface


def body(around=90, up=60, part=1.0, shrink=0.0):
    """Points (n, 3) m and outward triangles (t, 3); ``part`` of the turn, its middle in front."""
    angle = np.linspace(-np.pi, np.pi, around, endpoint=part < 1) * part - np.pi / 2
    z = np.linspace(0, 0.5, up)
    a, h = (g.ravel() for g in np.meshgrid(angle, z))
    x, y = (0.16 - shrink) * np.cos(a), (0.11 - shrink) * np.sin(a)
    for side in (-1, 1):
        y = y - 0.05 * np.exp(-((x - 0.08 * side) ** 2 + (h - 0.3) ** 2) / 0.04**2) * (y < 0)
    i, j = np.meshgrid(np.arange(up - 1), np.arange(around - (part < 1)), indexing="ij")
    k = (j + 1) % around
    p, q, r, s = i * around + j, i * around + k, (i + 1) * around + k, (i + 1) * around + j
    triangles = np.concatenate([np.stack([p, q, r], -1), np.stack([p, r, s], -1)]).reshape(-1, 3)
    return np.stack([x, y, h], axis=1), triangles


def outward(surface):
    """Share of the area whose normal looks away from the axis x = y = 0."""
    middle = surface.points[surface.triangles].mean(axis=1) * [1, 1, 0]
    out = np.einsum("td,td->t", surface.normals, middle) > 0
    return surface.areas[out].sum() / surface.areas.sum()


def ply(path, points, triangles, comments=()):
    """An ASCII PLY file, written here."""
    lines = ["ply", "format ascii 1.0", *(f"comment {c}" for c in comments)]
    lines += [f"element vertex {len(points)}", *(f"property double {a}" for a in "xyz")]
    lines += [f"element face {len(triangles)}", "property list uchar int vertex_indices"]
    lines += ["end_header", *(" ".join(map(repr, p)) for p in points.tolist())]
    lines += ["3 " + " ".join(map(str, t)) for t in triangles.tolist()]
    path.write_text("\n".join(lines) + "\n")
    return path


@pytest.mark.parametrize(("unit", "scale"), [("m", 1.0), ("mm", 1e3), ("cm", 1e2), ("dm", 1e1)])
def test_the_unit_is_found_from_the_size_and_said(tmp_path, unit, scale):
    """A body of 0.5 m spans 0.5, 5, 50 or 500 of its file's numbers."""
    points, triangles = body()
    scan = read_scan(ply(tmp_path / "s.ply", points * scale, triangles))
    assert scan.unit == unit
    np.testing.assert_allclose(scan.surface.points, points, atol=1e-12)
    assert f"The unit is {unit}, found from its size: the scan spans 0.50 m." in scan.said


def test_a_unit_that_the_size_contradicts_is_refused(tmp_path):
    """Metres called mm, and mm called m; what would fit is named."""
    points, triangles = body()
    file = ply(tmp_path / "s.ply", points, triangles)
    with pytest.raises(InputError, match=r"0\.5 mm .*unit='m'"):
        read_scan(file, unit="mm")
    big = ply(tmp_path / "b.ply", points * 1e3, triangles)
    with pytest.raises(InputError, match=r"500 m .*unit='mm'"):
        read_scan(big, unit="m")
    with pytest.raises(InputError, match="in no unit"):
        read_scan(ply(tmp_path / "c.ply", points * 1e-3, triangles))


def test_a_part_of_a_torso_is_asked_for_more(tmp_path):
    """0.1 m in the unit that its comment names: more of the body is what lacks, not a unit."""
    points, triangles = body()
    file = ply(tmp_path / "s.ply", points * 200, triangles, ["unit mm"])
    with pytest.raises(InputError, match=r"spans 100 mm .*; scan the front .*in cm \(1.00 m\)"):
        read_scan(file)


def test_inches_are_asked_for_never_guessed(tmp_path):
    """A torso of 0.5 m is 19.7 in, which may be 19.7 cm."""
    points, triangles = body()
    file = ply(tmp_path / "s.ply", points / 0.0254, triangles)
    with pytest.raises(InputError, match=r"--unit cm .*or --unit in"):
        read_scan(file)
    np.testing.assert_allclose(read_scan(file, unit="in").surface.points, points, atol=1e-12)


def test_a_comment_names_unit_and_frame(tmp_path):
    """What Surface.write says in its header is believed; RAS is turned by diag(-1, -1, 1)."""
    points, triangles = body()
    scan = read_scan(Surface(points, triangles).write(tmp_path / "s.ply", unit="cm"))
    assert scan.unit == "cm"
    assert "The frame is LPS, as the file's comment says." in scan.said
    for comment in ("frame RAS", "SPACE=RAS"):
        scan = read_scan(ply(tmp_path / "r.ply", points * [-1, -1, 1], triangles, [comment]))
        np.testing.assert_allclose(scan.surface.points, points, atol=1e-15)
        assert any("RAS" in s for s in scan.said)


def stl(path, points, triangles, title):
    """A binary STL file: 80 bytes, a count, and 50 bytes a triangle."""
    data = struct.pack("<80sI", title, len(triangles))
    for t in points[triangles].astype("<f4"):
        data += struct.pack("<3f", 0, 0, 0) + t.tobytes() + b"\0\0"
    path.write_bytes(data)
    return path


def test_slicers_stl_header_names_the_frame(tmp_path):
    """3D Slicer writes SPACE=RAS into the 80 bytes before the triangles."""
    points, triangles = body(30, 20)
    scan = read_scan(stl(tmp_path / "s.stl", points * [-1e3, -1e3, 1e3], triangles, b"SPACE=RAS"))
    assert scan.unit == "mm"
    assert outward(scan.surface) == 1.0
    assert scan.surface.points[:, 1].min() < -0.14  # the breasts are in front
    assert len(scan.surface.points) == len(points)


def glb(path, points, triangles, matrix):
    """A binary glTF 2.0 file of one mesh on a node with a matrix (4, 4)."""
    xyz, ids = points.astype("<f4").tobytes(), triangles.astype("<u4").tobytes()
    scene = {
        "asset": {"version": "2.0"},
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0, "matrix": matrix.T.ravel().tolist()}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1}]}],
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "count": len(points), "type": "VEC3",
             "min": points.min(0).tolist(), "max": points.max(0).tolist()},
            {"bufferView": 1, "componentType": 5125, "count": triangles.size, "type": "SCALAR"},
        ],
        "bufferViews": [
            {"buffer": 0, "byteLength": len(xyz)},
            {"buffer": 0, "byteOffset": len(xyz), "byteLength": len(ids)},
        ],
        "buffers": [{"byteLength": len(xyz) + len(ids)}],
    }  # fmt: skip
    text = json.dumps(scene).encode()
    text += b" " * (-len(text) % 4)
    body = struct.pack("<II", len(text), 0x4E4F534A) + text
    body += struct.pack("<II", len(xyz + ids), 0x004E4942) + xyz + ids
    path.write_bytes(struct.pack("<4sII", b"glTF", 2, 12 + len(body)) + body)
    return path


def test_gltf_is_turned_from_y_up_with_its_nodes_applied(tmp_path):
    """glTF: +y up, +z to the front, so the subject's left is +x; a node shifts by (1, 2, 3) m."""
    points, triangles = body(40, 30)
    in_gltf = points[:, [0, 2, 1]] * [1, 1, -1]
    shift = np.eye(4)
    shift[:3, 3] = 1, 2, 3
    scan = read_scan(glb(tmp_path / "s.glb", in_gltf, triangles, shift))
    np.testing.assert_allclose(scan.surface.points, points + np.array([1, -3, 2]), atol=1e-6)
    assert "The unit is m, as glTF defines: the scan spans 0.50 m." in scan.said
    assert any("y-up" in s for s in scan.said)


def vtk_ascii(points, triangles):
    xyz = "\n".join(" ".join(map(repr, p)) for p in points.tolist())
    faces = "\n".join("3 " + " ".join(map(str, t)) for t in triangles.tolist())
    return (
        f"# vtk DataFile Version 3.0\n3D Slicer output. SPACE=RAS\nASCII\nDATASET POLYDATA\n"
        f"POINTS {len(points)} double\n{xyz}\n\nPOLYGONS {len(triangles)} {4 * len(triangles)}\n"
        f"{faces}\n"
    ).encode()


def vtk_binary(points, triangles):
    offsets = np.arange(len(triangles) + 1) * 3
    return (
        b"# vtk DataFile Version 5.1\n3D Slicer output. SPACE=RAS\nBINARY\nDATASET POLYDATA\n"
        + f"POINTS {len(points)} double\n".encode() + points.astype(">f8").tobytes()
        + f"\nPOLYGONS {len(offsets)} {triangles.size}\nOFFSETS vtktypeint64\n".encode()
        + offsets.astype(">i8").tobytes() + b"\nCONNECTIVITY vtktypeint64\n"
        + triangles.astype(">i8").tobytes() + b"\n"
    )  # fmt: skip


@pytest.mark.parametrize("data", [vtk_ascii, vtk_binary])
def test_legacy_vtk_polygons_of_both_versions_are_read(tmp_path, data):
    """Version 3 counts corners in the list, version 5.1 has offsets; the title names the frame."""
    points, triangles = body(30, 20)
    (tmp_path / "s.vtk").write_bytes(data(points * [-1, -1, 1], triangles))
    scan = read_scan(tmp_path / "s.vtk")
    np.testing.assert_allclose(scan.surface.points, points, atol=1e-15)
    np.testing.assert_array_equal(scan.surface.triangles, triangles)


def _packed(array, way):
    data = array.tobytes()
    if way == "plain":
        return base64.b64encode(struct.pack("<I", len(data)) + data).decode()
    half = (len(data) // 2 + 7) // 8 * 8
    blocks = [zlib.compress(data[:half]), zlib.compress(data[half:])]
    head = struct.pack("<5I", 2, half, len(data) - half, *map(len, blocks))
    if way == "zlib":
        return base64.b64encode(head).decode() + base64.b64encode(b"".join(blocks)).decode()
    return head + b"".join(blocks)


@pytest.mark.parametrize("way", ["ascii", "plain", "zlib", "raw"])
def test_vtp_arrays_of_every_encoding_are_read(tmp_path, way):
    """Quadrilaterals in ASCII, base64, base64 of zlib blocks, and raw appended zlib blocks."""
    points, triangles = body(30, 20)
    half = len(triangles) // 2  # triangles p q r and p r s are one quadrilateral p q r s
    quads = np.column_stack([triangles[:half], triangles[half:, 2]])
    arrays = [points, quads.astype("<i8"), 4 * np.arange(1, half + 1, dtype="<i8")]
    names = ["Points", "connectivity", "offsets"]
    kinds = ["Float64", "Int64", "Int64"]
    entries, appended = [], b""
    for array, name, kind in zip(arrays, names, kinds, strict=True):
        head = f'<DataArray type="{kind}" Name="{name}" NumberOfComponents="{array.ndim}" '
        if way == "raw":
            entries.append(f'{head} format="appended" offset="{len(appended)}"/>')
            appended += _packed(array, way)
        elif way == "ascii":
            text = " ".join(map(repr, array.ravel().tolist()))
            entries.append(f'{head} format="ascii">{text}</DataArray>')
        else:
            entries.append(f'{head} format="binary">{_packed(array, way)}</DataArray>')
    packing = 'compressor="vtkZLibDataCompressor"' if way in ("zlib", "raw") else ""
    text = (
        f'<VTKFile type="PolyData" version="0.1" byte_order="LittleEndian" {packing}><PolyData>'
        f'<Piece NumberOfPoints="{len(points)}" NumberOfPolys="{half}"><Points>{entries[0]}'
        f"</Points><Polys>{entries[1]}{entries[2]}</Polys></Piece></PolyData>"
    ).encode()
    text += b'<AppendedData encoding="raw">_' * (way == "raw") + appended
    text += b"</AppendedData>" * (way == "raw") + b"</VTKFile>"
    (tmp_path / "s.vtp").write_bytes(text)
    surface = read_scan(tmp_path / "s.vtp").surface
    np.testing.assert_array_equal(surface.points, points)
    assert outward(surface) == 1.0
    assert len(surface.triangles) == len(triangles)


def test_an_xml_scan_that_declares_entities_is_refused(tmp_path):
    text = '<!DOCTYPE x [<!ENTITY a "aaaa">]><VTKFile type="PolyData">&a;</VTKFile>'
    (tmp_path / "s.vtp").write_text(text)
    with pytest.raises(MeshError, match="declares XML entities"):
        read_scan(tmp_path / "s.vtp")


def test_a_good_scan_is_handed_back_as_it_is():
    surface = Surface(*body())
    assert clean(surface) == (surface, [])
    half = Surface(*body(part=0.5))
    assert clean(half) == (half, [])


@pytest.mark.parametrize("part", [1.0, 0.5, 0.3])
def test_a_scan_inside_out_is_turned_whole_or_in_part(part):
    """All around, half, or 0.3 of the way round: the skin ends up looking away from the axis."""
    points, triangles = body(part=part)
    surface, said = clean(Surface(points, triangles[:, ::-1]))
    assert outward(surface) == 1.0
    assert said == ["The triangles faced inward: turned inside out."]


@pytest.mark.parametrize("noise", [0.0, 2e-3])
def test_a_scan_in_many_pieces_is_turned_as_a_whole_or_not_at_all(noise):
    """50 patches that hang together nowhere: a flat or hollow one does not turn by itself."""
    points, triangles = body()
    column, row = triangles[:, 0] % 90, triangles[:, 0] // 90
    patches = triangles[(column % 9 > 0) & (row % 12 > 0)]
    points = points + np.random.default_rng(0).normal(0, noise, points.shape)
    surface, said = clean(Surface(points, patches))
    np.testing.assert_array_equal(surface.triangles, patches)
    assert len(said) == 1
    assert "The scan is in 50 pieces" in said[0]
    turned, said = clean(Surface(points, patches[:, ::-1]))
    assert said[0] == "The triangles faced inward: turned inside out."
    np.testing.assert_allclose(turned.normals, surface.normals, atol=1e-9)


@pytest.mark.parametrize("share", [0.1, 0.5, 0.9])
def test_triangles_turned_at_random_are_made_to_agree(share):
    points, triangles = body(part=0.5)
    wrong = np.random.default_rng(3).random(len(triangles)) < share
    triangles[wrong] = triangles[wrong][:, [1, 0, 2]]
    surface, said = clean(Surface(points, triangles))
    assert outward(surface) == 1.0
    assert any("disagreed with their neighbours" in s for s in said)


@pytest.mark.parametrize("noise", [0.0, 1e-3])
@pytest.mark.parametrize("part", [1.0, 0.5])
@pytest.mark.parametrize("way", ["thickened", "thickened inside out", "two pieces", "two alike"])
def test_of_two_walls_the_outer_is_kept(way, part, noise):
    """An inner wall 6 mm inside the outer, joined by a rim or apart, facing in or out."""
    points, triangles = body(part=part)
    inner, _ = body(part=part, shrink=6e-3)
    n = len(points)
    both = np.vstack([points, inner])
    both += np.random.default_rng(0).normal(0, noise, both.shape)
    inward = triangles if way == "two alike" else triangles[:, ::-1]
    faces = [triangles, inward + n]
    if way.startswith("thickened"):
        low, high = np.arange(89), np.arange(89) + n
        faces += [np.stack([low, high, high + 1], -1), np.stack([low, high + 1, low + 1], -1)]
    every = np.vstack(faces)
    surface, said = clean(Surface(both, every[:, ::-1] if "inside out" in way else every))
    assert any("inner and an outer wall" in s for s in said), said
    kept = np.sqrt((surface.points[:, 0] / 0.16) ** 2 + (surface.points[:, 1] / 0.11) ** 2)
    assert (kept > 0.97).mean() > 0.97
    assert 0.97 < len(surface.triangles) / len(triangles) < 1.05
    assert outward(surface) > 0.9


def test_a_body_with_thin_parts_is_no_two_walled_scan():
    """An arm 60 mm thick beside the body, and a plate of 10 mm at its back, are parts of it."""
    points, triangles = body()
    arm = points[:, [0, 1, 2]] * [0.1875, 0.27, 1.0] + [0.25, 0, 0]
    every = np.vstack([points, arm])
    surface, said = clean(Surface(every, np.vstack([triangles, triangles + len(points)])))
    assert len(surface.triangles) == 2 * len(triangles)
    assert not any("wall" in s for s in said)


def test_points_that_are_no_numbers_are_dropped_up_to_a_hundredth(tmp_path):
    points, triangles = body()
    points[[10, 500]] = np.nan
    points[77, 1] = np.inf
    scan = read_scan(ply(tmp_path / "s.ply", points, triangles))
    assert "3 points that are NaN or infinite are left out." in scan.said
    assert len(scan.surface.points) == len(points) - 3
    assert outward(scan.surface) == 1.0
    points[:60] = np.nan
    with pytest.raises(InputError, match="more than 1%"):
        tidy(points, triangles)


def test_seams_doubles_and_flat_triangles_are_mended():
    """Every triangle with corners of its own, as STL and textures have them: welded again."""
    points, triangles = body()
    apart = points[triangles].reshape(-1, 3)
    surface, said = clean(Surface(apart, np.arange(len(apart)).reshape(-1, 3)))
    assert len(surface.points) == len(points)
    assert len(surface.triangles) == len(triangles)
    assert any("joined" in s for s in said)
    _, faces, said = tidy(points, np.vstack([triangles, [[0, 0, 1]]]))
    assert len(faces) == len(triangles)
    assert said == ["1 triangles without area are left out."]


def test_points_that_a_cut_left_behind_are_no_skin(tmp_path):
    """Faces deleted in an editor, their points not: half a body must be read as half of one."""
    points, triangles = body()
    kept = triangles[points[triangles].mean(axis=1)[:, 1] > np.median(points[:, 1])]
    scan = read_scan(ply(tmp_path / "s.ply", points, kept))
    held = len(np.unique(kept))
    assert len(scan.surface.points) == held
    assert len(scan.surface.triangles) == len(kept)
    lost, every = len(points) - held, len(points)
    assert f"{lost} points of {every} are in no triangle: left out." in scan.said


def test_objects_of_an_obj_share_its_points_and_lose_none(tmp_path):
    """Two objects over one list of points, as scanners and Blender write them: nothing is loose."""
    points, triangles = body()
    half = len(triangles) // 2
    lines = ["v {} {} {}".format(*(1e3 * p)) for p in points]
    for name, some in (("a", triangles[:half]), ("b", triangles[half:])):
        lines += [f"o {name}", f"usemtl {name}"]
        lines += ["f {} {} {}".format(*(1 + t)) for t in some]
    (tmp_path / "s.obj").write_text("\n".join(lines))
    scan = read_scan(tmp_path / "s.obj")
    assert len(scan.surface.points) == len(points)
    assert len(scan.surface.triangles) == len(triangles)
    assert not any("left out" in s for s in scan.said)


@pytest.mark.parametrize("order", ["<", ">"])
def test_a_ply_of_triangles_quads_and_pentagons_is_read(tmp_path, order):
    """Half of the tube's quads are whole, two a pentagon and a triangle; a flag before each face.

    The file has the body's area; one that lost its end is refused.
    """
    points, triangles = body()
    below, above = np.split(triangles, 2)  # p q r and p r s of each quad, around and then up
    some = len(below) // 2
    (p, q, r), s, (_, on, far) = below[0], above[0, 2], below[1]
    faces = [[p, q, on, far, r], [p, r, s],
             *np.column_stack([below[2:some], above[2:some, 2]]).tolist(),
             *below[some:].tolist(), *above[some:].tolist()]  # fmt: skip
    form = "little" if order == "<" else "big"
    head = (f"ply\nformat binary_{form}_endian 1.0\nelement vertex {len(points)}\n"
            "property double x\nproperty double y\nproperty double z\nproperty uchar red\n"
            f"element face {len(faces)}\nproperty uchar flags\n"
            "property list uchar int vertex_indices\nend_header\n")  # fmt: skip
    rows = b"".join(struct.pack(order + "3dB", *p, 200) for p in points)
    rows += b"".join(struct.pack(f"{order}BB{len(f)}i", 7, len(f), *f) for f in faces)
    (file := tmp_path / "scan.ply").write_bytes(head.encode() + rows)
    surface = read_scan(file).surface
    assert len(surface.points) == len(points)
    assert surface.areas.sum() == pytest.approx(Surface(points, triangles).areas.sum(), rel=1e-3)
    file.write_bytes((head.encode() + rows)[:-9])
    with pytest.raises(MeshError, match="save it as PLY again"):
        read_scan(file)


def test_a_cloud_with_few_triangles_stays_a_cloud(tmp_path):
    points, triangles = body()
    scan = read_scan(ply(tmp_path / "s.ply", points, triangles[:20]))
    assert len(scan.surface.points) == len(points)
    assert len(scan.surface.triangles) == 0
    assert any("taken as a cloud of points" in s for s in scan.said)


def test_a_cloud_stays_a_cloud(tmp_path):
    points, _ = body()
    scan = read_scan(
        ply(tmp_path / "s.ply", np.vstack([points, points[:5]]), np.empty((0, 3), int))
    )
    assert len(scan.surface.triangles) == 0
    assert len(scan.surface.points) == len(points)


def test_empty_tiny_and_unreadable_scans_are_refused(tmp_path):
    (tmp_path / "e.ply").write_text("")
    with pytest.raises(InputError, match="is empty"):
        read_scan(tmp_path / "e.ply")
    points, triangles = body(10, 10)
    with pytest.raises(InputError, match="fewer than the 200"):
        read_scan(ply(tmp_path / "s.ply", points, triangles))
    with pytest.raises(InputError, match="fewer than the 200"):
        clean(Surface(points, triangles))
    (tmp_path / "g.ply").write_text("hello")
    with pytest.raises(MeshError, match="save it as PLY"):
        read_scan(tmp_path / "g.ply")
    with pytest.raises(MeshError, match="must be one of"):
        read_scan(ply(tmp_path / "s.xyz", points, triangles))
    with pytest.raises(InputError, match="convert it to metres"):
        clean(Surface(body()[0] * 1e3, body()[1]))
    for suffix in ("vtk", "vtp", "glb", "stl", "obj", "vtu"):
        (tmp_path / f"g.{suffix}").write_text("hello")
        with pytest.raises(InputError):
            read_scan(tmp_path / f"g.{suffix}")


def test_the_back_alone_is_told_by_the_way_it_looks():
    """A half turn of an ellipse looks to -y in front, to +y behind; all around to nowhere."""
    front, back = Surface(*body(part=0.5)), body(part=0.5)
    assert seen_from(front)[1] < -0.5
    assert seen_from(Surface(back[0] * [-1, -1, 1], back[1]))[1] > 0.5
    assert np.linalg.norm(seen_from(Surface(*body()))) < 0.01


def test_cleaning_100000_points_takes_a_fraction_of_a_second():
    """CPU seconds, best of three; 200,000 triangles."""
    surface = Surface(*body(400, 250))
    seconds = []
    for _ in range(3):
        start = time.process_time()
        clean(surface)
        seconds.append(time.process_time() - start)
    assert min(seconds) < 0.2, seconds


def test_the_visible_human_is_read_in_lps_as_it_is(shared):
    """A closed glTF body of 1.67 m: feet down, nothing to mend, its nose and toes in front."""
    scan = read_scan(shared / "data" / "skin_vhf" / "VH_F_Skin_v1.1.glb")
    assert scan.unit == "m"
    assert len(scan.said) == 2
    points = scan.surface.points
    np.testing.assert_allclose(np.ptp(points, axis=0), [0.967, 0.329, 1.667], atol=1e-3)
    feet = points[points[:, 2] < points[:, 2].min() + 0.05]
    assert np.ptp(feet[:, 1]) > 0.15
    assert feet[:, 1].min() < np.median(points[:, 1]) - 0.05  # toes point to -y
