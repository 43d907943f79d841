"""Templates in glTF 2.0 files, held against the specification read byte by byte."""

from __future__ import annotations

import json
import struct
from pathlib import Path

import numpy as np
import pytest

from supple.errors import InputError, MeshError
from supple.registration import template as parts
from supple.registration.posture import Posture, posed
from supple.registration.template_file import read_template, write_template

_SIZES = {5121: "B", 5123: "<u2", 5125: "<u4", 5126: "<f4"}
_WIDTHS = {"SCALAR": 1, "VEC3": 3, "VEC4": 4, "MAT4": 16}


def little(seed: int = 3) -> parts.Template:
    """A ball with everything that a template has; five bones act on one of its vertices."""
    rng = np.random.default_rng(seed)
    rings, round_ = 5, 8
    polar, turn = np.meshgrid(np.linspace(0.3, 2.8, rings), np.arange(round_) / round_ * 2 * np.pi)
    x, y = np.sin(polar) * np.sin(turn), np.sin(polar) * np.cos(turn)
    points = 0.2 * np.stack([x, y, np.cos(polar)], axis=-1).transpose(1, 0, 2).reshape(-1, 3)
    ids = np.arange(rings * round_).reshape(rings, round_)
    a, b = ids[:-1], np.roll(ids[:-1], -1, axis=1)
    c, d = ids[1:], np.roll(ids[1:], -1, axis=1)
    triangles = np.vstack([np.stack(t, -1).reshape(-1, 3) for t in ((a, b, c), (b, d, c))])
    n = len(points)
    mirror = ids[:, (-np.arange(round_)) % round_].ravel()
    weights = rng.random((n, len(parts.BONES))) ** 3 * (rng.random((n, len(parts.BONES))) < 0.3)
    weights[:, 0] += 0.1
    weights[0] = np.where(np.arange(len(parts.BONES)) < 5, 0.2, 0.0)
    marks = {name: parts.OnSurface(np.array([k]), np.array([[0.2, 0.3, 0.5]]))
             for k, name in enumerate(parts.LANDMARKS)}  # fmt: skip
    at, shares = rng.integers(len(triangles), size=6), rng.dirichlet((1, 1, 1), 6)
    curves = {name: parts.OnSurface(at, shares, "breast" in name) for name in parts.CURVES}
    bones = [parts.Bone(name, up, tuple(rng.normal(size=3) * 0.1)) for name, up in parts.BONES]
    return parts.Template(
        points, triangles, tuple(bones),
        weights / weights.sum(axis=1, keepdims=True), 0.01 * rng.normal(size=(3, n, 3)),
        ("a_left", "a_right", "b"), np.array([(-1, 1 / 3), (-0.1, 0.7), (0, 1)]), marks, curves,
        {name: rng.random(n) < 0.4 for name in parts.REGIONS}, mirror, "little", "made here; CC0",
    )  # fmt: skip


class Raw:
    """A .glb file by §4.4 and §3.6 of the specification, without a library."""

    def __init__(self, path: Path) -> None:
        data = path.read_bytes()
        magic, self.version, self.length = struct.unpack("<4sII", data[:12])
        size, kind = struct.unpack("<I4s", data[12:20])
        assert (magic, kind, size % 4) == (b"glTF", b"JSON", 0)
        assert self.length == len(data)
        self.json = json.loads(data[20 : 20 + size])
        bin_size, bin_kind = struct.unpack("<I4s", data[20 + size : 28 + size])
        assert (bin_kind, bin_size % 4) == (b"BIN\0", 0)
        self.blob = data[28 + size :]
        assert len(self.blob) == bin_size

    def array(self, number: int) -> np.ndarray:
        accessor = self.json["accessors"][number]
        view = self.json["bufferViews"][accessor["bufferView"]]
        dtype, width = np.dtype(_SIZES[accessor["componentType"]]), _WIDTHS[accessor["type"]]
        begin = view["byteOffset"] + accessor.get("byteOffset", 0)
        flat = np.frombuffer(self.blob, dtype, accessor["count"] * width, begin)
        return flat.reshape(-1, width)


@pytest.fixture
def written(tmp_path: Path) -> tuple[parts.Template, Raw]:
    template = little()
    return template, Raw(write_template(template, tmp_path / "little.glb"))


@pytest.mark.parametrize("ending", ["glb", "gltf"])
def test_a_template_comes_back_within_float32(tmp_path, ending):
    """Half a unit in float32's last place is 6e-8 of a number's size; JSON keeps all digits."""
    template = little()
    again = read_template(write_template(template, tmp_path / f"little.{ending}"))
    for name in ("points", "joints", "weights", "blendshapes"):
        there, back = getattr(template, name), getattr(again, name)
        assert np.abs(there - back).max() <= 6e-8 * np.abs(there).max(), name
    for name in ("triangles", "mirror", "blendshape_bounds", "parents"):
        np.testing.assert_array_equal(getattr(template, name), getattr(again, name), name)
    assert again.blendshape_names == template.blendshape_names
    assert [b.name for b in again.bones] == [b.name for b in template.bones]
    assert (again.name, again.source) == (template.name, template.source)
    for kind in ("landmarks", "curves"):
        for name, part in getattr(template, kind).items():
            back = getattr(again, kind)[name]
            np.testing.assert_array_equal(part.triangle, back.triangle)
            np.testing.assert_array_equal(part.barycentric, back.barycentric)
            assert part.closed == back.closed
    for name, mask in template.regions.items():
        np.testing.assert_array_equal(mask, again.regions[name])


def test_a_template_that_was_read_is_written_unchanged(tmp_path):
    """Float32 to float64 and back is exact; only weights, whose sum is made 1, may move."""
    first = read_template(write_template(little(), tmp_path / "a.glb"))
    second = read_template(write_template(first, tmp_path / "b.glb"))
    for name in ("points", "joints", "blendshapes"):
        np.testing.assert_array_equal(getattr(first, name), getattr(second, name), name)
    np.testing.assert_allclose(first.weights, second.weights, atol=6e-8)


def test_views_and_accessors_are_those_of_the_specification(written):
    """§3.6.2.4: starts are multiples of 4; least and largest of POSITION are those of the data."""
    _, raw = written
    assert raw.version == 2
    for view in raw.json["bufferViews"]:
        assert view["byteOffset"] % 4 == 0
        assert view["byteOffset"] + view["byteLength"] <= raw.json["buffers"][0]["byteLength"]
    primitive = raw.json["meshes"][0]["primitives"][0]
    for attributes in (primitive["attributes"], *primitive["targets"]):
        accessor = raw.json["accessors"][attributes["POSITION"]]
        data = raw.array(attributes["POSITION"])
        np.testing.assert_array_equal(np.float32(accessor["min"]), data.min(axis=0))
        np.testing.assert_array_equal(np.float32(accessor["max"]), data.max(axis=0))
    normals = raw.array(primitive["attributes"]["NORMAL"])
    np.testing.assert_allclose(np.linalg.norm(normals, axis=1), 1, atol=1e-6)
    assert len(raw.json["meshes"][0]["extras"]["targetNames"]) == len(primitive["targets"])


def test_skin_attributes_are_those_of_the_specification(written):
    """§3.7.3.3: sums of 1, unused bones 0, no bone twice at a vertex; five bones take two sets."""
    _, raw = written
    attributes = raw.json["meshes"][0]["primitives"][0]["attributes"]
    bones = np.hstack([raw.array(attributes[f"JOINTS_{k}"]) for k in range(2)])
    weights = np.hstack([raw.array(attributes[f"WEIGHTS_{k}"]) for k in range(2)])
    np.testing.assert_allclose(weights.sum(axis=1), 1, atol=5e-7)
    assert (bones[weights == 0] == 0).all()
    for row, used in zip(bones, weights > 0, strict=True):
        assert len(set(row[used])) == used.sum()
    assert "JOINTS_2" not in attributes


def test_bones_are_a_tree_at_rest_in_the_bind_pose(written):
    """§3.7.3.2: a node has one parent; global transform times inverse bind matrix is 1."""
    template, raw = written
    nodes, skin = raw.json["nodes"], raw.json["skins"][0]
    children = [child for node in nodes for child in node.get("children", [])]
    assert len(children) == len(set(children)) == len(template.bones) - 1
    inverse = raw.array(skin["inverseBindMatrices"]).reshape(-1, 4, 4).transpose(0, 2, 1)
    above = {child: k for k, node in enumerate(nodes) for child in node.get("children", [])}
    for bone, (joint, matrix) in enumerate(zip(skin["joints"], inverse, strict=True)):
        assert nodes[joint]["name"] == template.bones[bone].name
        assert not {"rotation", "scale", "matrix"} & nodes[joint].keys()
        place, at = np.zeros(3), joint
        while at is not None:
            place, at = place + nodes[at]["translation"], above.get(at)
        np.testing.assert_allclose(matrix @ [*place, 1], [0, 0, 0, 1], atol=1e-7)


def test_a_viewer_that_follows_the_specification_shows_the_posed_skin(written):
    """§3.7.3.3: morph, then sum weights · (global joint transform · inverse bind) · vertex."""
    from scipy.spatial.transform import Rotation

    template, raw = written
    rng = np.random.default_rng(5)
    bones = len(template.bones)
    posture = Posture(Rotation.random(bones, random_state=1).as_matrix(),
                      rng.normal(size=(bones, 3)) * 0.1, rng.uniform(0.8, 1.2, (bones, 3)),
                      np.array([0.3, -0.1, 0.9]))  # fmt: skip
    turn = np.array([[1.0, 0, 0], [0, 0, 1], [0, -1, 0]])  # LPS → y up, z to the front
    primitive = raw.json["meshes"][0]["primitives"][0]
    attributes = primitive["attributes"]
    vertices = raw.array(attributes["POSITION"]).astype(float)
    for share, target in zip(posture.blend, primitive["targets"], strict=True):
        vertices = vertices + share * raw.array(target["POSITION"])
    matrices = raw.array(raw.json["skins"][0]["inverseBindMatrices"])
    inverse = matrices.reshape(-1, 4, 4).transpose(0, 2, 1)
    moved = np.zeros_like(vertices)
    for k in range(2):
        joints, weights = (raw.array(attributes[f"{kind}_{k}"]) for kind in ("JOINTS", "WEIGHTS"))
        for bone in range(bones):
            transform = np.eye(4)
            transform[:3, :3] = turn @ (posture.rotations[bone] * posture.scales[bone]) @ turn.T
            transform[:3, 3] = turn @ (template.joints[bone] + posture.translations[bone])
            skinned = np.c_[vertices, np.ones(len(vertices))] @ (transform @ inverse[bone]).T
            share = np.where(joints == bone, weights, 0).sum(axis=1, keepdims=True)
            moved += share * skinned[:, :3]
    np.testing.assert_allclose(moved, posed(template, posture) @ turn.T, atol=5e-7)


@pytest.mark.parametrize("ending", ["glb", "gltf"])
def test_another_reader_sees_the_same_surface(tmp_path, ending):
    """Trimesh reads the same triangles, y up and z to the front, outward."""
    import trimesh

    template = little()
    scene = trimesh.load(write_template(template, tmp_path / f"a.{ending}"), process=False)
    (mesh,) = scene.dump()
    expected = template.points[:, [0, 2, 1]] * (1, 1, -1)
    np.testing.assert_allclose(mesh.vertices, expected, atol=1e-7)
    np.testing.assert_array_equal(mesh.faces, template.triangles)


def _primitive(g: dict) -> dict:
    return g["meshes"][0]["primitives"][0]


def _extras(g: dict) -> dict:
    return g["meshes"][0]["extras"]["supple"]


def _nipple(g: dict) -> dict:
    return _extras(g)["landmarks"]["nipple_left"]


_FAULTS = {
    "skin": (lambda g: (g.pop("skins"), g["nodes"][0].pop("skin")), "must have a skin with bones"),
    "no weights": (lambda g: _primitive(g)["attributes"].pop("WEIGHTS_0"), "WEIGHTS_0, got none"),
    "no joints": (lambda g: [_primitive(g)["attributes"].pop(f"JOINTS_{k}") for k in (0, 1)],
                  "must have JOINTS_0"),
    "one set of weights": (lambda g: [_primitive(g)["attributes"].pop(f"{k}_0")
                                      for k in ("JOINTS", "WEIGHTS")], "whose sum is 1"),
    "no extras": (lambda g: g["meshes"][0].pop("extras"), "must carry landmarks"),
    "other layout": (lambda g: _extras(g).update(layout=99), "of layout 1"),
    "no landmarks": (lambda g: _extras(g)["landmarks"].clear(), "landmarks must name"),
    "a landmark off the skin": (lambda g: _nipple(g).update(triangle=[10**6]), "nipple_left"),
    "a landmark below zero": (lambda g: _nipple(g).update(triangle=[-1]), "nipple_left"),
    "two shares": (lambda g: _nipple(g).update(barycentric=[[0.5, 0.5]]), "three shares"),
    "bounds": (lambda g: _extras(g)["blendshapeBounds"].pop(), "blendshape_bounds"),
    "names": (lambda g: g["meshes"][0]["extras"]["targetNames"].pop(), "blendshapes"),
    "mirror": (lambda g: _extras(g)["mirror"].pop(), "mirror"),
    "region": (lambda g: _extras(g)["regions"].update(back=[10**6]), "IndexError"),
    "rows": (lambda g: g["accessors"][2].update(count=7), "must hold JOINTS_0 for 40, got 7"),
    "width": (lambda g: g["accessors"][0].update(type="VEC4"), "must hold POSITION as VEC3"),
    "beyond the end": (lambda g: g["bufferViews"][0].update(byteOffset=10**6), "cut off"),
    "no such accessor": (lambda g: _primitive(g).update(indices=10**6), "must have triangles"),
    "lines": (lambda g: _primitive(g).update(mode=1), "must be of triangles"),
    "two meshes": (lambda g: g["meshes"].append(g["meshes"][0]), "one mesh of one part"),
    "version 1": (lambda g: g["asset"].update(version="1.0"), "must be glTF 2.0"),
    "no asset": (lambda g: g.pop("asset"), "must be glTF 2.0"),
    "numbers elsewhere": (lambda g: g["buffers"][0].update(uri="a.bin"), "must hold its numbers"),
    "cut off": (lambda g: g["buffers"][0].update(uri=g["buffers"][0]["uri"][:-2001]), "cut off"),
    "a bone that is no node": (lambda g: g["skins"][0]["joints"].__setitem__(3, 99), "a node for"),
    "no bind matrices": (lambda g: g["skins"][0].pop("inverseBindMatrices"), "inverse bind"),
    "a child before its parent": (
        lambda g: (g["skins"][0]["joints"].reverse(), g["nodes"][1].pop("name")), "parents before"),
}  # fmt: skip


@pytest.mark.parametrize("fault", _FAULTS)
def test_a_faulty_file_is_refused_with_what_is_wrong(tmp_path, fault):
    """Each fault, put in one at a time, is named; never a template that only looks whole."""
    path = write_template(little(), tmp_path / "a.gltf")
    edit, said = _FAULTS[fault]
    content = json.loads(path.read_text())
    edit(content)
    path.write_text(json.dumps(content))
    with pytest.raises(InputError, match=said) as caught:
        read_template(path)
    assert "a.gltf" in str(caught.value)


@pytest.mark.parametrize("share", [0.01, 0.3, 0.9, 0.9999])
def test_a_file_that_is_cut_off_is_refused(tmp_path, share):
    """The header of a .glb file says its length."""
    path = write_template(little(), tmp_path / "a.glb")
    data = path.read_bytes()
    path.write_bytes(data[: int(share * len(data))])
    with pytest.raises(MeshError, match="cut off"):
        read_template(path)


@pytest.mark.parametrize(
    ("name", "data", "said"),
    [
        ("a.glb", b"", "empty"),
        ("a.glb", b"ply\nformat ascii 1.0\n", "must begin as a .glb file does"),
        ("a.gltf", b"solid stl", "must be glTF 2.0"),
        ("a.gltf", b"\xff\xfe\x00", "must be glTF 2.0"),
        ("a.gltf", b"[1, 2]", "must be glTF 2.0"),
        ("a.gltf", b'{"asset": {"version": "2.0"}}', "must hold its numbers"),
        ("a.glb", struct.pack("<4sII", b"glTF", 1, 20) + bytes(8), "got version 1"),
        ("a.obj", b"v 0 0 0", "must end in .glb or .gltf"),
    ],
)
def test_what_is_no_template_is_refused(tmp_path, name, data, said):
    (tmp_path / name).write_bytes(data)
    with pytest.raises(InputError, match=said):
        read_template(tmp_path / name)


def test_files_that_are_not_there_are_said(tmp_path):
    """Reading from no file, writing into no folder or to another ending."""
    with pytest.raises(InputError, match="no file at"):
        read_template(tmp_path / "a.glb")
    with pytest.raises(InputError, match="no folder"):
        write_template(little(), tmp_path / "none" / "a.glb")
    with pytest.raises(InputError, match="must end in"):
        write_template(little(), tmp_path / "a.ply")
    assert not list(tmp_path.iterdir())
