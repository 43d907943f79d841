"""The 3-D scene as compact JSON: base64 arrays that the page's script hands to plotly.js."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from supple.breast.result import closest_on_skin
from supple.page import as_script, packed, thinned

if TYPE_CHECKING:
    from supple.breast.report import ReportData

Array = NDArray[np.float64]
Triangles = NDArray[np.int64]
NODES = {"skin": 15_000, "gland": 8_000, "chest": 8_000}  #: thinned for display beyond this
ENDS = ("prone", "supine")
SCAN = 8_000  #: so is a scan with more points


def scene_json(data: ReportData) -> str:
    """Layers in mm, poses, colour range; safe inside a script element."""
    poses = {pose: 1e3 * np.asarray(points, dtype=float) for pose, points in data.points.items()}
    moved = np.linalg.norm(poses["supine"] - poses["prone"], axis=1)
    scene: dict[str, Any] = {
        "skin": _surface(poses, data.skin, NODES["skin"], moved),
        "tumour": {pose: (1e3 * np.asarray(p)).tolist() for pose, p in data.tumour.items()},
        "nipple": {pose: (1e3 * np.asarray(p)).tolist() for pose, p in data.nipple.items()},
        "most": most_movement(data),
        "radius": 1e3 * data.tumour_radius,
    }
    _, foot = closest_on_skin(1e3 * np.asarray(data.tumour["supine"]), poses["supine"], data.skin)
    scene["foot"] = foot.on(poses["supine"], data.skin).tolist()
    if data.gland is not None:
        scene["gland"] = _surface(poses, data.gland, NODES["gland"])
    if data.chest is not None:
        still = poses
        if data.chest_points is not None:
            still = dict.fromkeys(poses, 1e3 * np.asarray(data.chest_points, dtype=float))
        scene["chest"] = _surface(still, data.chest, NODES["chest"])
    if data.scan is not None:
        scan = 1e3 * np.asarray(data.scan, dtype=float)
        scene["scan"] = packed(scan[:: max(1, -(-len(scan) // SCAN))], "<f4")
    return as_script(scene)


def most_movement(data: ReportData) -> float:
    """Top of the colour scale: the largest movement of the skin (mm), up to a multiple of 10."""
    nodes = np.unique(np.asarray(data.skin, dtype=np.int64))
    prone, supine = (np.asarray(data.points[pose], dtype=float)[nodes] for pose in ENDS)
    most = 1e3 * np.linalg.norm(supine - prone, axis=1).max()
    return float(10.0 * np.ceil(max(float(most), 1e-6) / 10.0))


def _surface(
    poses: dict[str, Array], triangles: ArrayLike, most: int, colour: Array | None = None
) -> dict[str, Any]:
    """Only the nodes that the triangles use, thinned to ``most``."""
    tri = np.asarray(triangles, dtype=np.int64)
    nodes, rows = np.unique(tri, return_inverse=True)
    tri = rows.reshape(-1, 3)
    if len(nodes) > most:
        keep, tri = thinned(poses["prone"][nodes], tri, most)
        nodes = nodes[keep]
    surface: dict[str, Any] = {pose: packed(points[nodes], "<f4") for pose, points in poses.items()}
    surface["triangles"] = packed(tri, "<u4")
    if colour is not None:
        surface["colour"] = packed(colour[nodes], "<f4")
    return surface
