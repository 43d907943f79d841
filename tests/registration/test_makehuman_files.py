"""MakeHuman's folder spoilt, and its torso as other programs write it."""

from __future__ import annotations

import base64
import json
import shutil
from pathlib import Path

import numpy as np
import pytest

from supple.errors import InputError
from supple.registration.makehuman import torso
from supple.registration.template_file import read_template, write_template

#: Files that the torso is made from, and one line of each that spoils it.
_SPOILT = {
    "3dobjs/base.obj": ("g body\nf 1/1 2/2 3/3\n", "must have a group 'body' of quads"),
    "targets/breast/breast-trans-up.target": ("7 0.1 0.2\n", "must hold 4 numbers a line"),
    "targets/stomach/stomach-navel-in.target": ("99999 0 0 1\n", "must name vertices 0 to"),
    "rigs/default_weights.mhw": ("}{", "must be JSON with 'weights'"),
    "rigs/default.mhskel": ("}{", "must be JSON with 'joints'"),
}


@pytest.mark.slow
@pytest.mark.parametrize("name", _SPOILT)
def test_a_folder_that_is_not_makehuman_is_refused(shared, tmp_path, name):
    """A file missing, empty or spoilt is named, with what it must be."""
    folder = tmp_path / "makehuman"
    shutil.copytree(shared / "data/template_makehuman", folder, copy_function=_link)
    file = folder / name
    text = file.read_text()
    line, said = _SPOILT[name]
    for content, message in ((None, "no file at"), ("", "is empty"), (text + line, said)):
        file.unlink(missing_ok=True)
        if content is not None:
            file.write_text(content)
        with pytest.raises(InputError, match=message) as caught:
            torso(folder)
        assert Path(name).name in str(caught.value)


def _link(source: str, target: str) -> None:
    Path(target).symlink_to(source)


def test_bones_in_another_order_and_sparse_shapes_are_the_same_template(shared, tmp_path):
    """Blender writes bones as it likes and keeps of a shape only what moves; glTF 2.0 §3.6.2.3."""
    template = torso(shared / "data/template_makehuman", spacing=1.0)
    path = write_template(template, tmp_path / "torso.gltf")
    direct = read_template(path)
    content = json.loads(path.read_text())
    blob = bytearray(base64.b64decode(content["buffers"][0]["uri"].partition(",")[2]))
    _reorder(content, blob, np.random.default_rng(0).permutation(len(template.bones)))
    _thin(content, blob, content["meshes"][0]["primitives"][0]["targets"][0]["POSITION"])
    uri = "data:application/octet-stream;base64," + base64.b64encode(blob).decode()
    content["buffers"] = [{"uri": uri, "byteLength": len(blob)}]
    path.write_text(json.dumps(content))
    again = read_template(path)
    for name in ("points", "joints", "parents", "weights", "blendshapes"):
        np.testing.assert_array_equal(getattr(again, name), getattr(direct, name), name)


def _rows(content: dict, blob: bytearray, accessor: int, dtype: type, width: int) -> np.ndarray:
    view = content["bufferViews"][content["accessors"][accessor]["bufferView"]]
    shape = (content["accessors"][accessor]["count"], width)
    return np.frombuffer(blob, dtype, shape[0] * width, view["byteOffset"]).reshape(shape)


def _reorder(content: dict, blob: bytearray, order: np.ndarray) -> None:
    """The skin's bones in another order, everywhere that they are numbered."""
    skin = content["skins"][0]
    skin["joints"] = [skin["joints"][k] for k in order]
    matrices = _rows(content, blob, skin["inverseBindMatrices"], np.float32, 16)
    matrices[:] = matrices[order]
    for name, number in content["meshes"][0]["primitives"][0]["attributes"].items():
        if name.startswith("JOINTS"):
            joints = _rows(content, blob, number, np.uint8, 4)
            joints[:] = np.argsort(order)[joints]


def _thin(content: dict, blob: bytearray, accessor: int) -> None:
    """An accessor of vectors as a sparse one: the rows that are not zero."""
    values = _rows(content, blob, accessor, np.float32, 3).copy()
    few = np.flatnonzero(np.abs(values).any(axis=1))
    assert 0 < len(few) < len(values)
    views = content["bufferViews"]
    sparse = {"count": len(few)}
    for kind, raw in (("indices", few.astype(np.uint16)), ("values", values[few])):
        blob.extend(bytes(-len(blob) % 4))
        sparse[kind] = {"bufferView": len(views)}
        views.append({"buffer": 0, "byteOffset": len(blob), "byteLength": raw.nbytes})
        blob.extend(raw.tobytes())
    sparse["indices"]["componentType"] = 5123
    del content["accessors"][accessor]["bufferView"]
    content["accessors"][accessor]["sparse"] = sparse
