"""One offline HTML file that tells a surgeon where the tumour is in the supine patient.

1. words       report_words: headline, tables, all text escaped
2. drawings    report_figures: clock face and sections through the tumour, SVG, also for print
3. scene       report_scene: surfaces in three poses, packed, drawn by plotly.js in the page
4. page        templates/report.{html,js}, filled and written aside (supple.page)
"""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike

from supple.breast.result import Result
from supple.errors import InputError
from supple.page import write_page

POSES = ("prone", "rest", "supine")


@dataclass(frozen=True)
class ReportData:
    """Plain arrays, m, LPS; every pose has the same numbering of points."""

    result: Result
    points: dict[str, ArrayLike]  #: pose ("prone", "rest", "supine") -> (n, 3)
    skin: ArrayLike  #: (t, 3) triangles
    tumour: dict[str, ArrayLike]  #: pose -> (3,) centre
    tumour_radius: float  #: m
    nipple: dict[str, ArrayLike]  #: pose -> (3,)
    gland: ArrayLike | None = None  #: (g, 3) triangles
    chest: ArrayLike | None = None  #: (c, 3) triangles of ``chest_points``, else of ``points``
    chest_points: ArrayLike | None = None  #: (k, 3), the same in every pose
    scan: ArrayLike | None = None  #: (s, 3) supine scan, aligned
    title: str = ""  #: image or case, as the user named it
    assumptions: dict[str, str] = field(default_factory=dict)  #: pose, density, … in words


def write_report(path: str | Path, data: ReportData) -> None:
    """Write the report as one HTML file that needs no network.

    Args:
        path: where to; written aside, then renamed.
        data: the prediction; the texts may hold any character, they are escaped.

    Raises:
        InputError: a pose is missing, or arrays disagree in shape or are not finite.
    """
    from supple.breast.report_figures import clock_face, section
    from supple.breast.report_scene import scene_json
    from supple.breast.report_words import words

    _check(data)
    parts = words(data) | {
        "scene": scene_json(data),
        "clock_face": clock_face(data),
        "axial": section(data, axis=2),
        "sagittal": section(data, axis=0),
    }
    write_page(path, "supple.breast", "report", parts)


def _check(data: ReportData) -> None:
    for name in ("points", "tumour", "nipple"):
        missing = [pose for pose in POSES if pose not in getattr(data, name)]
        if missing:
            raise InputError(f"{name} must hold prone, rest and supine, got no {missing[0]}.")
    shapes = {pose: np.shape(data.points[pose]) for pose in POSES}
    if len(set(shapes.values())) != 1 or len(shapes["prone"]) != 2 or shapes["prone"][1] != 3:
        raise InputError(f"points must be (n, 3) with one n in every pose, got {shapes}.")
    for name in ("points", "tumour", "nipple"):
        for pose in POSES:
            if not np.isfinite(np.asarray(getattr(data, name)[pose], dtype=float)).all():
                raise InputError(f"{name} must be finite, got NaN in {pose}; check the solution.")
    n = shapes["prone"][0]
    own = data.chest_points is None
    count = n if own else len(np.asarray(data.chest_points))
    for name, limit in (("skin", n), ("gland", n), ("chest", count)):
        triangles = getattr(data, name)
        if triangles is not None and np.size(triangles) and np.max(triangles) >= limit:
            raise InputError(f"{name} must name one of {limit} points, got {np.max(triangles)}.")
