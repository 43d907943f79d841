"""The 3-D scene of the page: turned upright, mm; base64 arrays for plotly.js."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from supple.page import as_script, packed, thinned
from supple.registration.portrait import needs_head

if TYPE_CHECKING:
    from supple.registration.report import ReportData

Floats = npt.NDArray[np.float64]

#: The scan is thinned for display to so many points.
SCAN = 25_000


def scene(data: ReportData) -> dict[str, str]:
    """The part ``scene`` of the page: layers in mm in the body's frame (left, back, up)."""
    r = data.registration
    whole: dict[str, Any] = {
        "scan": _scan(data),
        "skin": {
            "points": packed(_upright(data, r.points), "<f4"),
            "triangles": packed(r.template.triangles, "<u4"),
            "values": None if r.covariance is None else packed(1e3 * r.sd, "<f4"),
        },
        "curves": [
            {"name": _plain(name), "closed": c.closed, "arrow": needs_head(name, c.points),
             "points": _upright(data, c.points).round(2).tolist(), "on": c.on_scan.tolist()}
            for name, c in data.curves.items()
        ],
        "landmarks": [
            {"name": _plain(name), "point": _upright(data, c.points)[0].round(2).tolist(),
             "on": bool(c.on_scan[0]), "given": name in data.given}
            for name, c in data.landmarks.items()
        ],
        "most": {"sd": _most(None if r.covariance is None else 1e3 * r.sd),
                 "distance": _most(1e3 * np.abs(r.distance[r.used]))},
    }  # fmt: skip
    return {"scene": as_script(whole)}


def _scan(data: ReportData) -> dict[str, Any]:
    """The scan where it was used, thinned; each point with its distance to the skin, mm."""
    scan, r = data.scan, data.registration
    points = _upright(data, scan.points)
    triangles = scan.triangles[r.used[scan.triangles].all(axis=1)]
    nodes = np.unique(triangles) if len(triangles) else np.flatnonzero(r.used)
    new = np.zeros(len(points), dtype=np.int64)
    new[nodes] = np.arange(len(nodes))
    keep, faces = thinned(points[nodes], new[triangles], SCAN)
    distance = 1e3 * np.abs(r.distance[nodes[keep]])
    return {
        "points": packed(points[nodes[keep]], "<f4"),
        "triangles": packed(faces, "<u4") if len(triangles) else None,
        "values": packed(distance, "<f4"),
    }


def _upright(data: ReportData, points: Floats) -> Floats:
    """Points (k, 3) m of the scan in mm along the body's left, back and up."""
    from supple.registration.report import body_frame

    frame = body_frame(data.registration) * [[1], [-1], [1]]
    return np.asarray(1e3 * points @ frame.T)


def _most(values: Floats | None) -> float:
    """Top of a colour scale, mm: what 98 % stay below, up to a whole number."""
    if values is None or not len(values):
        return 1.0
    return float(max(np.ceil(np.percentile(values, 98)), 1.0))


def _plain(name: str) -> str:
    return name.replace("_", " ")
