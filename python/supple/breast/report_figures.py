"""Flat drawings as SVG: the clock face of the breast, and sections of the supine patient."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from supple.breast.result import closest_on_skin

if TYPE_CHECKING:
    from supple.breast.report import ReportData

Array = NDArray[np.float64]
SIZE = 320.0  #: edge of a drawing, px


def clock_face(data: ReportData) -> str:
    """The breast from the front, supine: nipple in the middle, tumour to scale, 12 to the head."""
    offset = 1e3 * (np.asarray(data.tumour["supine"]) - np.asarray(data.nipple["supine"]))
    radius = 1e3 * data.tumour_radius
    reach = 20.0 * np.ceil(max(40.0, np.hypot(offset[0], offset[2]) + radius + 5.0) / 20.0)
    scale = 118.0 / reach
    x, y = 160 + scale * offset[0], 160 - scale * offset[2]
    rings = "".join(
        f'<circle cx="160" cy="160" r="{scale * r:.1f}" class="ring"/>'
        f'<text x="163" y="{160 + scale * r - 3:.1f}" class="small">{r:.0f} mm</text>'
        for r in np.arange(20.0, reach + 1, 20.0 if reach <= 80 else 40.0)
    )
    hours = "".join(_hour(hour) for hour in range(1, 13))
    left_is = "outer" if data.result.tumour.breast == "left" else "inner"
    right_is = "inner" if left_is == "outer" else "outer"
    body = (
        f'<circle cx="160" cy="160" r="118" class="face"/>{rings}{hours}'
        f'<line x1="160" y1="160" x2="{x:.1f}" y2="{y:.1f}" class="lead"/>'
        '<circle cx="160" cy="160" r="5" class="nipple"/>'
        f'<circle cx="{x:.1f}" cy="{y:.1f}" r="{max(scale * radius, 4):.1f}" class="tumour"/>'
        '<text x="160" y="12" class="axis">S · head</text>'
        '<text x="160" y="318" class="axis">I · feet</text>'
        f'<text x="2" y="20" class="axis start">R · {right_is}</text>'
        f'<text x="318" y="20" class="axis end">L · {left_is}</text>'
    )
    return _svg(body, "Clock face of the breast, seen by a surgeon who faces the patient")


def _hour(hour: int) -> str:
    angle = np.radians(30.0 * hour)
    x, y = 160 + 131 * np.sin(angle), 164 - 131 * np.cos(angle)
    return f'<text x="{x:.1f}" y="{y:.1f}" class="hour">{hour}</text>'


def section(data: ReportData, axis: int) -> str:
    """The supine patient cut through the tumour's centre, front up; ``axis`` 2 axial, 0 sagittal.

    Axial: seen from the feet, the patient's left on the right. Sagittal: head on the left.
    """
    points = 1e3 * np.asarray(data.points["supine"], dtype=float)
    centre = 1e3 * np.asarray(data.tumour["supine"], dtype=float)
    across = 0 if axis == 2 else 2
    sign = 1.0 if axis == 2 else -1.0
    chest = points if data.chest_points is None else 1e3 * np.asarray(data.chest_points)
    layers = [("skin", points, data.skin), ("gland", points, data.gland)]
    layers += [("chest", chest, data.chest)]
    near = 110.0  # half the width shown, mm
    scale = SIZE / 2 / near
    foot = closest_on_skin(centre, points, data.skin)[1].on(points, data.skin)
    middle = centre[1] + 30.0

    def place(p: Array) -> Array:
        flat = np.stack([sign * (p[..., across] - centre[across]), p[..., 1] - middle], axis=-1)
        return 160.0 + scale * flat

    body = ""
    for name, nodes, triangles in layers:
        if triangles is not None and np.size(triangles):
            lines = place(_cut(nodes, np.asarray(triangles), axis, centre[axis]))
            path = "".join(f"M{a:.1f} {b:.1f}L{c:.1f} {d:.1f}" for (a, b), (c, d) in lines)
            body += f'<path d="{path}" class="{name}"/>'
    (x, y), (fx, fy) = place(centre), place(foot)
    names = ("R", "L") if axis == 2 else ("S", "I")
    body += (
        f'<line x1="{x:.1f}" y1="{y:.1f}" x2="{fx:.1f}" y2="{fy:.1f}" class="lead"/>'
        f'<circle cx="{x:.1f}" cy="{y:.1f}" r="{max(scale * 1e3 * data.tumour_radius, 3):.1f}" '
        'class="tumour"/>'
        f'<text x="4" y="24" class="axis start">{names[0]}</text>'
        f'<text x="316" y="24" class="axis end">{names[1]}</text>'
        '<text x="160" y="12" class="axis">A</text><text x="160" y="318" class="axis">P</text>'
        f'<path d="M12 306h{50 * scale:.1f}M12 302v8M{12 + 50 * scale:.1f} 302v8" class="bar"/>'
        '<text x="12" y="298" class="small">50 mm</text>'
    )
    plane = "Axial" if axis == 2 else "Sagittal"
    return _svg(body, f"{plane} section of the supine patient through the tumour")


def _cut(points: Array, triangles: NDArray[np.int64], axis: int, level: float) -> Array:
    """Segments (s, 2, 3) in which a plane meets triangles, in the unit of ``points``."""
    height = points[:, axis] - level
    height = np.where(height == 0, 1e-9, height)
    corners, above = points[triangles], height[triangles] > 0
    count = above.sum(axis=1)
    hit = (count == 1) | (count == 2)
    corners, value, above = corners[hit], height[triangles[hit]], above[hit]
    lone = np.where(above.sum(axis=1) == 1, above.argmax(axis=1), above.argmin(axis=1))
    row = np.arange(len(lone))
    ends = []
    for step in (1, 2):
        other = (lone + step) % 3
        share = value[row, lone] / (value[row, lone] - value[row, other])
        start = corners[row, lone]
        ends.append(start + share[:, None] * (corners[row, other] - start))
    return np.stack(ends, axis=1)


def _svg(body: str, label: str) -> str:
    return (
        f'<svg viewBox="0 0 {SIZE:.0f} {SIZE:.0f}" role="img" aria-label="{label}">'
        f"<title>{label}</title>{body}</svg>"
    )
