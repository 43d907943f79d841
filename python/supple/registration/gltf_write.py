"""A template as a glTF 2.0 document.

Source: Khronos Group (2021), glTF 2.0 specification, §3.6 (accessors), §3.7 (meshes, skins).
"""

from __future__ import annotations

import json
import struct
from typing import Any

import numpy as np
import numpy.typing as npt

from supple.registration.template import OnSurface, Template

Floats = npt.NDArray[np.float64]
Ints = npt.NDArray[np.int64]

#: Version of what stands in the mesh's extras under "supple".
LAYOUT = 1
FRAME = "m; x to the patient's left, y to the head, z to the front; LPS is (x, -z, y)"
_ARRAY, _ELEMENTS = 34962, 34963  # targets of buffer views


class _Numbers:
    """Arrays behind each other in one buffer, each in a view and an accessor of its own."""

    def __init__(self) -> None:
        self.data = bytearray()
        self.views: list[Any] = []
        self.accessors: list[Any] = []

    def add(self, array: npt.NDArray[Any], target: int | None = None, spans: bool = False) -> int:
        """The number of the accessor of rows (n, k); ``spans``: with its least and largest."""
        import pygltflib as gltf

        kinds = {"float32": gltf.FLOAT, "uint8": gltf.UNSIGNED_BYTE, "uint16": gltf.UNSIGNED_SHORT,
                 "uint32": gltf.UNSIGNED_INT}  # fmt: skip
        widths = {1: gltf.SCALAR, 3: gltf.VEC3, 4: gltf.VEC4, 16: gltf.MAT4}
        self.data += bytes(-len(self.data) % 4)
        raw = np.ascontiguousarray(array, dtype=array.dtype.newbyteorder("<")).tobytes()
        self.views.append(gltf.BufferView(buffer=0, byteOffset=len(self.data),
                                          byteLength=len(raw), target=target))  # fmt: skip
        self.data += raw
        self.accessors.append(gltf.Accessor(
            bufferView=len(self.views) - 1, componentType=kinds[array.dtype.name],
            count=len(array), type=widths[array.shape[1]],
            min=array.min(axis=0).tolist() if spans else None,
            max=array.max(axis=0).tolist() if spans else None,
        ))  # fmt: skip
        return len(self.accessors) - 1


def document(template: Template) -> Any:
    """The pygltflib document with its numbers as a binary blob."""
    import pygltflib as gltf

    numbers = _Numbers()
    mesh = _mesh(template, numbers)
    inverse = np.tile(np.eye(4), (len(template.bones), 1, 1))
    inverse[:, 3, :3] = -_turned(template.joints)  # matrices are stored by columns
    skin = gltf.Skin(
        joints=list(range(1, len(template.bones) + 1)), skeleton=1, name=template.name,
        inverseBindMatrices=numbers.add(inverse.reshape(-1, 16).astype(np.float32)),
    )  # fmt: skip
    result = gltf.GLTF2(
        asset=gltf.Asset(version="2.0", generator="supple", copyright=template.source or None),
        scene=0, scenes=[gltf.Scene(nodes=[0, 1])], meshes=[mesh], skins=[skin],
        nodes=[gltf.Node(mesh=0, skin=0, name=template.name), *_nodes(template)],
        materials=[gltf.Material(name="skin", doubleSided=True, alphaCutoff=None)],
        buffers=[gltf.Buffer(byteLength=len(numbers.data))],
        bufferViews=numbers.views, accessors=numbers.accessors,
    )  # fmt: skip
    result.set_binary_blob(bytes(numbers.data))
    return result


def packed(document: Any, embedded: bool) -> bytes:
    """The bytes of a .glb file, or those of a .gltf file with its buffer ``embedded``."""
    import pygltflib as gltf

    blob: bytes = document.binary_blob()
    if embedded:
        document.convert_buffers(gltf.BufferFormat.DATAURI)
        return bytes(document.gltf_to_json().encode("utf-8"))
    text = json.dumps(json.loads(document.gltf_to_json()), separators=(",", ":")).encode("utf-8")
    text += b" " * (-len(text) % 4)
    blob += bytes(-len(blob) % 4)
    length = 12 + 8 + len(text) + 8 + len(blob)
    head = struct.pack("<4sII", b"glTF", 2, length) + struct.pack("<I4s", len(text), b"JSON")
    return head + text + struct.pack("<I4s", len(blob), b"BIN\0") + blob


def _turned(points: Floats) -> Floats:
    """From LPS to y up and z to the front."""
    return np.asarray(points[..., [0, 2, 1]] * (1, 1, -1))


def _mesh(template: Template, numbers: _Numbers) -> Any:
    import pygltflib as gltf

    def vertices(array: Floats, spans: bool = True) -> int:
        return numbers.add(_turned(array).astype(np.float32), _ARRAY, spans)

    small = len(template.points) < 65536
    ids = template.triangles.reshape(-1, 1).astype(np.uint16 if small else np.uint32)
    attributes = {"POSITION": vertices(template.points),
                  "NORMAL": vertices(_normals(template), spans=False)}  # fmt: skip
    for k, (bones, weights) in enumerate(_influences(template.weights)):
        attributes[f"JOINTS_{k}"] = numbers.add(bones, _ARRAY)
        attributes[f"WEIGHTS_{k}"] = numbers.add(weights, _ARRAY)
    primitive = gltf.Primitive(
        attributes=gltf.Attributes(**attributes), indices=numbers.add(ids, _ELEMENTS), material=0,
        targets=[gltf.Attributes(POSITION=vertices(s)) for s in template.blendshapes],
    )  # fmt: skip
    return gltf.Mesh(
        name=template.name, primitives=[primitive], weights=[0.0] * len(template.blendshapes),
        extras={"targetNames": list(template.blendshape_names), "supple": _extras(template)},
    )  # fmt: skip


def _normals(template: Template) -> Floats:
    a, b, c = (template.points[template.triangles[:, i]] for i in range(3))
    normals = np.zeros_like(template.points)
    for i in range(3):
        np.add.at(normals, template.triangles[:, i], np.cross(b - a, c - a))
    lengths = np.linalg.norm(normals, axis=1, keepdims=True)
    return np.where(lengths > 0, normals / np.where(lengths > 0, lengths, 1), (0.0, -1.0, 0.0))


def _influences(weights: Floats) -> list[tuple[npt.NDArray[np.uint8], npt.NDArray[np.float32]]]:
    """Bones (n, 4) and weights (n, 4) in as many sets as the vertex of most bones needs."""
    order = np.argsort(-weights, axis=1, kind="stable")
    ranked = np.take_along_axis(weights, order, axis=1)
    sets = -(-int((ranked > 0).sum(axis=1).max()) // 4)
    padding = ((0, 0), (0, max(4 * sets - weights.shape[1], 0)))
    values = np.pad(ranked, padding)[:, : 4 * sets].astype(np.float32)
    bones = np.where(values > 0, np.pad(order, padding)[:, : 4 * sets], 0).astype(np.uint8)
    return [(bones[:, k : k + 4], values[:, k : k + 4]) for k in range(0, 4 * sets, 4)]


def _nodes(template: Template) -> list[Any]:
    """A node for each bone, at its joint as seen from its parent's."""
    import pygltflib as gltf

    joints = _turned(template.joints)
    parents = template.parents.tolist()
    nodes = []
    for k, bone in enumerate(template.bones):
        shift = joints[k] - (joints[parents[k]] if parents[k] >= 0 else 0.0)
        children = [i + 1 for i, parent in enumerate(parents) if parent == k]
        nodes.append(gltf.Node(name=bone.name, children=children, translation=shift.tolist()))
    return nodes


def _extras(template: Template) -> dict[str, Any]:
    """What glTF has no word for."""
    return {
        "layout": LAYOUT,
        "frame": FRAME,
        "source": template.source,
        "blendshapeBounds": template.blendshape_bounds.tolist(),
        "landmarks": {name: _marks(part) for name, part in template.landmarks.items()},
        "curves": {name: _marks(part) for name, part in template.curves.items()},
        "regions": {name: np.flatnonzero(mask).tolist() for name, mask in template.regions.items()},
        "mirror": template.mirror.tolist(),
    }


def _marks(part: OnSurface) -> dict[str, Any]:
    return {"triangle": part.triangle.tolist(), "barycentric": part.barycentric.tolist(),
            "closed": part.closed}  # fmt: skip
