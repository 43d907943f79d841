"""The synthetic patient's files: every length a millimetre, every frame named."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from supple.breast.phantom_anatomy import Array
from supple.breast.phantom_mesh import Index

_MM = 1e3


def write_image(path: Path, voxels: NDArray[Any], origin: Array, spacing: Array) -> None:
    """MetaImage with axes along L, P and S; ``voxels`` (z, y, x), origin and spacing (3,) m."""
    import SimpleITK

    image = SimpleITK.GetImageFromArray(voxels)
    image.SetOrigin([float(v) * _MM for v in origin])
    image.SetSpacing([float(v) * _MM for v in spacing])
    SimpleITK.WriteImage(image, str(path), useCompression=voxels.dtype == np.uint8)


def write_ply(path: Path, points: Array, triangles: Index, comment: str) -> None:
    """Binary PLY with float32 ``points`` (v, 3), given in m and written in mm."""
    header = [
        "ply",
        "format binary_little_endian 1.0",
        f"comment {comment}",
        "comment unit mm",
        f"element vertex {len(points)}",
        *(f"property float {axis}" for axis in "xyz"),
        f"element face {len(triangles)}",
        "property list uchar int vertex_indices",
        "end_header",
        "",
    ]
    faces = np.empty(len(triangles), dtype=[("count", "u1"), ("ids", "<i4", 3)])
    faces["count"], faces["ids"] = 3, triangles
    with path.open("wb") as file:
        file.write("\n".join(header).encode("ascii"))
        file.write((points * _MM).astype("<f4").tobytes())
        file.write(faces.tobytes())


def write_case(path: Path, centre: Array, diameter: float, labels: bool) -> None:
    """case.toml beside the other files; tumour ``centre`` (3,) m LPS prone, ``diameter`` m."""
    name = 'labels = "labels.mha"' if labels else '# labels = "labels.mha"'
    place = ", ".join(f"{v * _MM:.2f}" for v in centre)
    lines = [
        "# A synthetic patient: lengths in mm, frame LPS.",
        "[image]",
        'file = "prone.mha"',
        name,
        "",
        "[tumour]",
        f"centre_mm = [{place}]",
        f"diameter_mm = {diameter * _MM:.1f}",
        "",
        "[scan]",
        'file = "supine.ply"',
        'unit = "mm"',
        "",
        "[pose]",
        'image = "prone"',
        'target = "supine"',
        "",
    ]
    path.write_text("\n".join(lines), encoding="utf-8")


def write_truth(path: Path, truth: dict[str, Any]) -> None:
    """truth.json."""
    path.write_text(json.dumps(truth, indent=2) + "\n", encoding="utf-8")
