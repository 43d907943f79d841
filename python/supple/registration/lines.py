"""Lines as files: PLY edges, OBJ polylines, glTF line strips; mm, LPS, named in the file."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from supple.errors import InputError
from supple.files import replacing

if TYPE_CHECKING:
    from supple.registration.transfer import Carried

_SAID = ("unit mm", "frame LPS")
#: glTF is in metres, y up and +z to the front; columns of the matrix, one after the other.
_GLTF_FROM_LPS_MM = [1e-3, 0, 0, 0, 0, 0, -1e-3, 0, 0, 1e-3, 0, 0, 0, 0, 0, 1]


def write_lines(path: str | Path, lines: Mapping[str, Carried]) -> Path:
    """Write lines to a PLY, OBJ or GLB file, whole or not at all, in mm, LPS.

    PLY: vertices with ``on_scan`` 0 or 1, and edges. OBJ: an object of ``l`` elements each. GLB: a
    node of primitives of mode 1 (lines) each; its numbers are mm, LPS, and the root node's matrix
    turns them to glTF's metres with y up.

    Raises:
        InputError: another ending, or no folder.
    """
    writers = {".ply": _ply, ".obj": _obj, ".glb": _glb}
    file = Path(path)
    if file.suffix.lower() not in writers:
        raise InputError(f"path must end in .ply, .obj or .glb, got {file.name!r}.")
    with replacing(file) as aside:
        aside.write_bytes(writers[file.suffix.lower()](lines))
    return file


def _pairs(line: Carried, start: int = 0) -> list[tuple[int, int]]:
    """Ends of the line's edges, numbered from ``start``."""
    ends = [(k, k + 1) for k in range(start, start + len(line.points) - 1)]
    return [*ends, (start + len(line.points) - 1, start)] if line.closed else ends


def _ply(lines: Mapping[str, Carried]) -> bytes:
    vertices: list[str] = []
    edges: list[str] = []
    comments = [*_SAID]
    for name, line in lines.items():
        last = len(vertices) + len(line.points) - 1
        comments.append(f"line {name} vertices {len(vertices)} to {last}")
        edges += [f"{a} {b}" for a, b in _pairs(line, len(vertices))]
        vertices += [f"{x:.9g} {y:.9g} {z:.9g} {int(on)}" for (x, y, z), on in
                     zip(1e3 * line.points, line.on_scan, strict=True)]  # fmt: skip
    head = ["ply", "format ascii 1.0", *(f"comment {text}" for text in comments)]
    head += [f"element vertex {len(vertices)}", *(f"property double {axis}" for axis in "xyz")]
    head += ["property uchar on_scan", f"element edge {len(edges)}"]
    head += ["property int vertex1", "property int vertex2", "end_header"]
    return "\n".join([*head, *vertices, *edges, ""]).encode("ascii")


def _obj(lines: Mapping[str, Carried]) -> bytes:
    text, start = [f"# {said}" for said in _SAID], 1
    for name, line in lines.items():
        ids = [*range(start, start + len(line.points)), *([start] if line.closed else [])]
        text += [f"o {name}", *(f"v {x:.9g} {y:.9g} {z:.9g}" for x, y, z in 1e3 * line.points)]
        text.append("l " + " ".join(map(str, ids)))
        start += len(line.points)
    return "\n".join([*text, ""]).encode("ascii")


def _glb(lines: Mapping[str, Carried]) -> bytes:
    import pygltflib as g

    said = dict(part.split() for part in _SAID)
    root = g.Node(name="drawing", matrix=_GLTF_FROM_LPS_MM, extras=said, children=[])
    whole = g.GLTF2(asset=g.Asset(generator="Supple", extras=said), scene=0,
                    scenes=[g.Scene(nodes=[0])], nodes=[root])  # fmt: skip
    blob = b""
    for number, (name, line) in enumerate(lines.items()):
        blob += _add(whole, line, len(blob))
        lone = g.Primitive(attributes=g.Attributes(POSITION=number), mode=1)
        whole.meshes.append(g.Mesh(name=name, primitives=[lone]))
        whole.nodes.append(g.Node(name=name, mesh=number))
        root.children.append(number + 1)
    whole.buffers.append(g.Buffer(byteLength=len(blob)))
    whole.set_binary_blob(blob)
    return b"".join(whole.save_to_bytes())


def _add(whole: Any, line: Carried, start: int) -> bytes:
    """A view and an accessor more: both ends of each edge, one after the other; their bytes.

    Without indices, since readers that take such lines for strips then draw the same.
    """
    import pygltflib as g

    ends = (1e3 * line.points[np.array(_pairs(line)).ravel()]).astype("<f4")
    whole.bufferViews.append(g.BufferView(buffer=0, byteOffset=start, byteLength=ends.nbytes,
                                          target=g.ARRAY_BUFFER))  # fmt: skip
    whole.accessors.append(g.Accessor(
        bufferView=len(whole.bufferViews) - 1, componentType=g.FLOAT, count=len(ends), type=g.VEC3,
        min=ends.min(axis=0).tolist(), max=ends.max(axis=0).tolist(),
    ))  # fmt: skip
    return bytes(ends.tobytes())
