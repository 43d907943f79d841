"""A template from a glTF 2.0 document, every part checked before it is believed."""

from __future__ import annotations

import base64
import binascii
import json
import struct
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from supple.errors import InputError, MeshError
from supple.registration.gltf_write import LAYOUT
from supple.registration.template import BONES, Bone, OnSurface, Template

Floats = npt.NDArray[np.float64]
Ints = npt.NDArray[np.int64]

_DTYPES = {5120: "i1", 5121: "u1", 5122: "<i2", 5123: "<u2", 5125: "<u4", 5126: "<f4"}
_WIDTHS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4, "MAT4": 16}
_AGAIN = "write it again with supple template make"


def opened(file: Path) -> tuple[Any, bytes]:
    """The pygltflib document of a .glb or .gltf file, and its numbers.

    Raises:
        InputError: no glTF 2.0.
        MeshError: cut off.
    """
    import pygltflib

    data = file.read_bytes()
    text, blob = _chunks(data, file) if file.suffix.lower() == ".glb" else (data, None)
    try:
        version = str(json.loads(text)["asset"]["version"])
        document = pygltflib.GLTF2.gltf_from_json(text.decode("utf-8"))
    except (ValueError, KeyError, TypeError, AttributeError):
        raise InputError(f"{file} must be glTF 2.0, got no such JSON; {_AGAIN}.") from None
    if not version.startswith("2."):
        raise InputError(f"{file} must be glTF 2.0, got version {version}; export it as 2.0.")
    return document, _embedded(document, file) if blob is None else blob


def _chunks(data: bytes, file: Path) -> tuple[bytes, bytes]:
    """JSON and binary part of a .glb file; specification §4.4."""
    if data[:4] != b"glTF" or len(data) < 20:
        raise InputError(f"{file} must begin as a .glb file does, got {data[:4]!r}; {_AGAIN}.")
    version, length = struct.unpack("<II", data[4:12])
    if version != 2:
        raise InputError(f"{file} must be glTF 2.0, got version {version}; export it as 2.0.")
    if length > len(data):
        raise MeshError(f"{file} must hold {length} bytes, got {len(data)}: it is cut off; copy it "
                        "again.")  # fmt: skip
    parts = {b"JSON": b"", b"BIN\0": b""}
    at = 12
    while at + 8 <= length:
        size, kind = struct.unpack("<I4s", data[at : at + 8])
        parts.setdefault(kind, b"")
        parts[kind] = parts[kind] or data[at + 8 : at + 8 + size]
        at += 8 + size
    return parts[b"JSON"], parts[b"BIN\0"]


def _embedded(document: Any, file: Path) -> bytes:
    """The numbers of a .gltf file, which must stand in the file itself."""
    uri = getattr(document.buffers[0], "uri", None) if document.buffers else None
    head, comma, body = (uri or "").partition(",")
    if not (head.startswith("data:") and head.endswith(";base64") and comma):
        raise InputError(f"{file} must hold its numbers itself, as a base64 URI, got "
                         f"{(uri or 'none')[:40]!r}; export it embedded, or as .glb.")  # fmt: skip
    try:
        return base64.b64decode(body, validate=True)
    except binascii.Error:
        raise MeshError(f"{file} must hold base64 numbers; it is cut off: copy it again.") from None


class _Reader:
    """Arrays of a document by the numbers of their accessors."""

    def __init__(self, document: Any, blob: bytes, file: Path) -> None:
        self.document, self.blob, self.file = document, blob, file

    def array(self, number: int | None, kind: str, width: str, rows: int | None = None) -> Any:
        """The (n, k) array of an accessor, which must be of ``width`` and have ``rows`` rows."""
        accessors = self.document.accessors
        if number is None or not 0 <= number < len(accessors):
            raise InputError(f"{self.file} must have {kind}, got none; {_AGAIN}.")
        a = accessors[number]
        if a.type != width or a.componentType not in _DTYPES:
            raise MeshError(f"{self.file} must hold {kind} as {width}, got {a.type}; {_AGAIN}.")
        if a.count < 1 or rows not in (None, a.count):
            raise MeshError(f"{self.file} must hold {kind} for {rows}, got {a.count}; {_AGAIN}.")
        array = np.zeros((a.count, _WIDTHS[width]), _DTYPES[a.componentType])
        if a.bufferView is not None:
            array = self._rows(a, a.componentType, a.count, _WIDTHS[width], kind)
        if a.sparse is not None:
            few, ids = a.sparse.count, a.sparse.indices
            at = self._rows(ids, ids.componentType, few, 1, kind).ravel()
            array[at] = self._rows(a.sparse.values, a.componentType, few, _WIDTHS[width], kind)
        whole = array.dtype.kind in "iu" and a.normalized
        return array.astype(np.float64) / np.iinfo(array.dtype).max if whole else array

    def _rows(self, place: Any, component: int, count: int, columns: int, kind: str) -> Any:
        """The (count, columns) array at the view and offset that ``place`` names."""
        view, dtype = self.document.bufferViews[place.bufferView], np.dtype(_DTYPES[component])
        row = columns * dtype.itemsize
        stride = view.byteStride or row
        begin = (view.byteOffset or 0) + (place.byteOffset or 0)
        end = begin + stride * (count - 1) + row
        if count < 1 or begin < 0 or stride < row or end > len(self.blob):
            raise MeshError(f"{self.file} must hold {end} bytes for {kind}, got {len(self.blob)}: "
                            "it is cut off; copy it again.")  # fmt: skip
        steps = (stride, dtype.itemsize)
        return np.ndarray((count, columns), dtype, self.blob, begin, steps).copy()


def template(document: Any, blob: bytes, file: Path) -> Template:
    """The template in a document."""
    try:
        return _template(document, _Reader(document, blob, file))
    except (KeyError, TypeError, ValueError, IndexError, AttributeError) as error:
        raise MeshError(f"{file} must hold a whole template, got a fault in its drawing or numbers "
                        f"({type(error).__name__}: {error}); {_AGAIN}.") from None  # fmt: skip


def _template(document: Any, reader: _Reader) -> Template:
    mesh, skin, primitive = _parts(document, reader.file)
    attributes = _dict(primitive.attributes)
    points = _lps(reader.array(attributes.get("POSITION"), "POSITION", "VEC3"))
    n, extras = len(points), mesh.extras["supple"]
    bones, order = _bones(document, skin, reader)
    triangles = reader.array(primitive.indices, "triangles", "SCALAR").astype(np.int64)
    shapes = [_lps(reader.array(target.get("POSITION"), "a morph target", "VEC3", n))
              for target in map(_dict, primitive.targets or [])]  # fmt: skip
    bounds = np.array(extras["blendshapeBounds"], dtype=np.float64).reshape(-1, 2)
    regions = {name: _mask(ids, n) for name, ids in extras["regions"].items()}
    mirror = np.array(extras["mirror"], dtype=np.int64)
    if mirror.shape != (n,):
        raise ValueError(f"mirror has shape {mirror.shape} for {n} vertices")
    weights = _weights(attributes, len(bones), n, reader)[:, order]
    try:
        return Template(
            points, triangles.reshape(-1, 3), bones, weights, np.array(shapes).reshape(-1, n, 3),
            tuple(mesh.extras.get("targetNames", ())), bounds, _marked(extras["landmarks"]),
            _marked(extras["curves"]), regions, mirror,
            mesh.name or "torso", str(extras["source"]),
        )  # fmt: skip
    except InputError as error:
        raise type(error)(f"{reader.file}: {error}") from None


def _parts(document: Any, file: Path) -> tuple[Any, Any, Any]:
    """Its one mesh, that mesh's skin and primitive."""
    if len(document.meshes) != 1 or len(document.meshes[0].primitives) != 1:
        raise InputError(f"{file} must hold one mesh of one part, got {len(document.meshes)} "
                         f"meshes; {_AGAIN}.")  # fmt: skip
    mesh, primitive = document.meshes[0], document.meshes[0].primitives[0]
    carriers = [node for node in document.nodes if node.mesh == 0 and node.skin is not None]
    if not carriers or not 0 <= carriers[0].skin < len(document.skins):
        raise InputError(f"{file} must have a skin with bones, got a bare mesh; {_AGAIN}.")
    if primitive.mode not in (None, 4):
        raise InputError(f"{file} must be of triangles, got mode {primitive.mode}; {_AGAIN}.")
    extras = (mesh.extras or {}).get("supple")
    if not isinstance(extras, dict) or extras.get("layout") != LAYOUT:
        raise InputError(f"{file} must carry landmarks and curves as extras of layout {LAYOUT}, "
                         f"got none; {_AGAIN}.")  # fmt: skip
    return mesh, document.skins[carriers[0].skin], primitive


def _dict(attributes: Any) -> dict[str, Any]:
    return attributes if isinstance(attributes, dict) else vars(attributes)


def _lps(points: npt.NDArray[Any]) -> Floats:
    return np.asarray(points.astype(np.float64)[:, [0, 2, 1]] * (1, -1, 1))


def _bones(document: Any, skin: Any, reader: _Reader) -> tuple[tuple[Bone, ...], list[int]]:
    """Names and parents from the nodes, joints from the bind pose, wherever the nodes stand.

    They come in the order of BONES if they bear those names, else in the file's; beside them,
    the number of each in the file.
    """
    count = len(skin.joints)
    matrices = reader.array(skin.inverseBindMatrices, "inverse bind matrices", "MAT4", count)
    inverse = matrices.astype(np.float64).reshape(-1, 4, 4).transpose(0, 2, 1)
    if not (np.isfinite(inverse).all() and (abs(np.linalg.det(inverse)) > 1e-12).all()):
        raise MeshError(f"{reader.file} must hold bind matrices that can be inverted; {_AGAIN}.")
    if not all(0 <= joint < len(document.nodes) for joint in skin.joints):
        raise MeshError(f"{reader.file} must have a node for each bone; {_AGAIN}.")
    names = [document.nodes[joint].name or f"bone_{joint}" for joint in skin.joints]
    ours = [name for name, _ in BONES]
    order = [names.index(n) for n in ours] if sorted(names) == sorted(ours) else [*range(count)]
    joints = [skin.joints[k] for k in order]
    above = {child: k for k, node in enumerate(document.nodes) for child in node.children or ()}
    result = []
    for k, at in zip(order, _lps(np.linalg.inv(inverse)[order, :3, 3]), strict=True):
        x, y, z = at.tolist()
        up = above.get(skin.joints[k])
        result.append(Bone(names[k], joints.index(up) if up in joints else -1, (x, y, z)))
    return tuple(result), order


def _weights(attributes: dict[str, Any], bones: int, n: int, reader: _Reader) -> Floats:
    """All sets added up, each row's sum made 1."""
    weights = np.zeros((n, bones))
    sets = [k for k in range(64) if attributes.get(f"JOINTS_{k}") is not None]
    if not sets:
        raise InputError(f"{reader.file} must have JOINTS_0 and WEIGHTS_0, got none; {_AGAIN}.")
    for k in sets:
        ids = reader.array(attributes[f"JOINTS_{k}"], f"JOINTS_{k}", "VEC4", n).astype(np.int64)
        values = reader.array(attributes.get(f"WEIGHTS_{k}"), f"WEIGHTS_{k}", "VEC4", n)
        if ids.min() < 0 or ids.max() >= bones:
            raise MeshError(f"{reader.file} must name bones 0 to {bones - 1} in JOINTS_{k}, got "
                            f"{ids.max()}; {_AGAIN}.")  # fmt: skip
        np.add.at(weights, (np.arange(n)[:, None], ids), values.astype(np.float64))
    total = weights.sum(axis=1, keepdims=True)
    if not (np.isfinite(weights).all() and weights.min() >= 0 and (abs(total - 1) < 1e-3).all()):
        raise MeshError(f"{reader.file} must hold weights ≥ 0 whose sum is 1 at each vertex, got "
                        f"sums from {total.min():.3g} to {total.max():.3g}; {_AGAIN}.")  # fmt: skip
    return np.asarray(weights / total)


def _marked(parts: dict[str, Any]) -> dict[str, OnSurface]:
    return {name: _on_surface(name, part) for name, part in parts.items()}


def _on_surface(name: str, part: dict[str, Any]) -> OnSurface:
    triangle = np.array(part["triangle"], dtype=np.int64)
    share = np.array(part["barycentric"], dtype=np.float64)
    if share.shape != (len(triangle), 3) or not (abs(share.sum(axis=1) - 1) < 1e-9).all():
        raise ValueError(f"{name} needs three shares a triangle that sum to 1")
    if (triangle < 0).any():
        raise ValueError(f"{name} names triangle {triangle.min()}")
    return OnSurface(triangle, share, bool(part["closed"]))


def _mask(ids: list[int], n: int) -> npt.NDArray[np.bool_]:
    mask = np.zeros(n, dtype=bool)
    mask[np.array(ids, dtype=np.int64)] = True
    return mask
