"""A library's non-rigid registration on the same scans: trimesh's, after Amberg (2007).

It gets what ours has to find: the template already in the rigid pose that fits the true landmarks
best, and only the skin of the scan, no clutter. Its settings are its defaults, which need the
package rtree (`pip install rtree`).
"""

from __future__ import annotations

import time
from typing import Any

import numpy as np


def row(case: Any, known: Any) -> dict[str, Any]:
    """A row of the table, of `trimesh.registration.nricp_amberg`."""
    import trimesh

    from supple.registration.rigid import fit_rigid
    from supple.studies import torso_cases, torso_score
    from supple.surface import Surface

    scan, template = torso_cases.scan_of(case, known), known[case.fitted]
    keep = scan.skin[scan.surface.triangles].all(axis=1)
    target = trimesh.Trimesh(scan.surface.points, scan.surface.triangles[keep], process=False)
    R, t = fit_rigid(*_landmarks(template, scan))
    start = template.points @ R.T + t
    source = trimesh.Trimesh(start, template.triangles, process=False)
    wall = time.perf_counter()
    points = np.asarray(trimesh.registration.nricp_amberg(source, target))
    seconds = time.perf_counter() - wall
    off, past = torso_score.distances(Surface(points, template.triangles), scan.truth.points)
    marks = template.landmark_points(points)
    apart = {name: 1e3 * float(np.linalg.norm(marks[name] - point))
             for name, point in scan.truth.landmarks.items() if name in marks}  # fmt: skip
    surface, worst = 1e3 * float(off[~past].mean()), max(apart.values())
    return {
        "key": f"peer {case.key}", "of": case.key, "peer": "trimesh nricp_amberg",
        "surface": surface, "landmark": float(np.mean(list(apart.values()))), "worst_mm": worst,
        "failed": not (surface <= torso_score.SURFACE_BAR and worst <= torso_score.LANDMARK_BAR),
        "seconds": seconds,
    }  # fmt: skip


def _landmarks(template: Any, scan: Any) -> tuple[np.ndarray, np.ndarray]:
    """Those of the template, and the true ones of the scan, both (k, 3) m."""
    own = template.landmark_points()
    names = [name for name in own if name in scan.truth.landmarks]
    return (np.array([own[name] for name in names]),
            np.array([scan.truth.landmarks[name] for name in names]))  # fmt: skip
