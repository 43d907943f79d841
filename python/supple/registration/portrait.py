"""The patient from the front with the drawing on her, as one picture: PNG or SVG.

Seen along the body's own axes, whatever the pose; the patient's right is on the left.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from supple.errors import InputError
from supple.registration.skin import vertex_normals
from supple.registration.transfer import Carried
from supple.surface import Surface

Floats = npt.NDArray[np.float64]

#: Colours of the drawing, of landmarks, and of words; Okabe and Ito (2008) and near.
PEN, MARK, INK = "#7a1fa2", "#0b5c8a", "#14232e"
#: From shade to light, of the scan.
_SKIN = ("#5b4a42", "#a98a78", "#e3c8b6", "#f7e9de")
#: The picture's width, inches, and dots an inch.
_WIDTH, _DPI = 8.0, 110
#: Height of the title and of a line of the warning, inches, and that line's length in letters.
_TITLE, _LINE, _LETTERS = 0.4, 0.17, 104
#: What is shown around the registered skin, and the scale bar, m.
_MARGIN, _BAR = 0.03, 0.05


@dataclass(frozen=True, eq=False)
class Portrait:
    """What is drawn; all m, in one frame.

    Attributes:
        scan: the surface; points alone are drawn as dots.
        skin: (n, 3) the registered template: the picture shows as much as it spans.
        frame: (3, 3) rows: unit vectors to the patient's left, to the front, up.
        curves: the drawing on the scan.
        landmarks: name → (3,).
        title: above the picture.
        warning: in red below the title, a sentence a line; empty where the fit is trustworthy.
    """

    scan: Surface
    skin: Floats
    frame: Floats
    curves: Mapping[str, Carried]
    landmarks: Mapping[str, Floats]
    title: str = ""
    warning: str = ""


def draw_portrait(path: str | Path, portrait: Portrait) -> Path:
    """Draw the front view and write it.

    Raises:
        InputError: the file's name ends in neither .png nor .svg.
    """
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    file = Path(path)
    if file.suffix not in (".png", ".svg"):
        raise InputError(f"a picture needs a name in .png or .svg, got {file.name}.")
    low, high = _box(portrait)
    wide, tall = high - low
    words = _lines(portrait.warning)
    above = _TITLE + _LINE * len(words) + 0.1
    figure = Figure(figsize=(_WIDTH, _WIDTH * tall / wide + above), dpi=_DPI)
    FigureCanvasAgg(figure)
    axes = figure.add_axes((0, 0, 1, _WIDTH * tall / wide / figure.get_figheight()))
    axes.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]), aspect="equal")
    axes.set_axis_off()
    _scan(axes, portrait, low, high)
    _drawing(axes, portrait)
    _signs(figure, axes, portrait.title, words, low)
    figure.savefig(file, metadata={"Date": None} if file.suffix == ".svg" else None)
    return file


def skin_colours() -> Any:
    """Colour map of lit skin, from shade (0) to light (1)."""
    from matplotlib.colors import LinearSegmentedColormap

    return LinearSegmentedColormap.from_list("skin", _SKIN)


def needs_head(name: str, points: Floats) -> bool:
    """Whether a curve is an arrow that is drawn without barbs: straight to its end."""
    if "arrow" not in name or len(points) < 8:
        return False
    far = np.linalg.norm(points[-1] - points[0])
    return bool(far > 0.9 * np.linalg.norm(np.diff(points, axis=0), axis=1).sum())


def _flat(points: Floats, frame: Floats) -> Floats:
    """Across and up (…, 2), mm."""
    return np.asarray(1e3 * points @ frame[[0, 2]].T)


def _box(portrait: Portrait) -> tuple[Floats, Floats]:
    seen = _flat(portrait.skin, portrait.frame)
    return seen.min(axis=0) - 1e3 * _MARGIN, seen.max(axis=0) + 1e3 * _MARGIN


def _scan(axes: Any, portrait: Portrait, low: Floats, high: Floats) -> None:
    """What faces the front within the box, from back to front, lit from above and one side."""
    scan, frame = portrait.scan, portrait.frame
    flat, depth = _flat(scan.points, frame), scan.points @ frame[1]
    colours = skin_colours()
    inside: Any = ((flat > low) & (flat < high)).all(axis=1)
    if not len(scan.triangles):
        shown = np.flatnonzero(inside)
        shown = shown[np.argsort(depth[shown])]
        axes.scatter(*flat[shown].T, c=depth[shown], cmap=colours, s=1.0, linewidths=0)
        return
    light = np.array([-0.35, 0.75, 0.55]) @ frame
    normals = vertex_normals(scan.points, scan.triangles)
    shade = 0.25 + 0.75 * np.clip(normals @ (light / np.linalg.norm(light)), 0, 1)
    faces = scan.triangles[inside[scan.triangles].all(axis=1)]
    a, b, c = (flat[faces[:, k]] for k in range(3))
    faces = faces[(b - a)[:, 0] * (c - a)[:, 1] - (b - a)[:, 1] * (c - a)[:, 0] > 0]
    faces = faces[np.argsort(depth[faces].mean(axis=1))]
    if len(faces):
        axes.tripcolor(*flat.T, faces, shade, shading="gouraud", cmap=colours, vmin=0.1, vmax=1.0)


def _drawing(axes: Any, portrait: Portrait) -> None:
    """Curves, thin and dotted where they are on no scan; landmarks with their names."""
    for name, curve in portrait.curves.items():
        flat = _flat(curve.points, portrait.frame)
        on: Any = curve.on_scan
        if curve.closed:
            flat, on = np.vstack([flat, flat[:1]]), np.append(on, on[:1])
        off = np.where(on[:, None], np.nan, flat)
        axes.plot(*off.T, color=PEN, linewidth=1.2, linestyle=":")
        axes.plot(*np.where(on[:, None], flat, np.nan).T, color=PEN, linewidth=2.6,
                  solid_capstyle="round")  # fmt: skip
        if needs_head(name, curve.points):
            axes.annotate("", flat[-1], flat[-8], arrowprops={
                "arrowstyle": "-|>", "color": PEN, "mutation_scale": 26, "shrinkA": 0, "shrinkB": 0,
                "lw": 0})  # fmt: skip
    for name, point in portrait.landmarks.items():
        at = _flat(point, portrait.frame)
        axes.plot(*at, "o", markersize=5, color=MARK, markeredgecolor="white", markeredgewidth=0.8)
        words = name.replace("_left", "").replace("_right", "").replace("breast_", "")
        axes.annotate(words.replace("_", " "), at, (5, 4), textcoords="offset points",
                      fontsize=7, color=MARK, bbox=_PAPER)  # fmt: skip


_PAPER = {"boxstyle": "round,pad=0.15", "facecolor": "white", "edgecolor": "none", "alpha": 0.65}


def _lines(text: str) -> list[str]:
    from textwrap import wrap

    return [part for line in text.splitlines() for part in wrap(line, _LETTERS)]


def _signs(figure: Any, axes: Any, title: str, warning: list[str], low: Floats) -> None:
    """Sides, a scale bar, the title, and what is wrong."""
    for x, letter, side in ((0.02, "R", "left"), (0.98, "L", "right")):
        axes.text(x, 0.97, letter, transform=axes.transAxes, fontsize=22, weight="bold",
                  color=INK, ha=side, va="top", bbox=_PAPER)  # fmt: skip
    x, y, bar = low[0] + 12, low[1] + 12, 1e3 * _BAR
    axes.plot([x, x, x, x + bar, x + bar, x + bar], [y - 3, y + 3, y, y, y - 3, y + 3],
              color=INK, linewidth=1.8)  # fmt: skip
    axes.text(x + bar / 2, y + 4, f"{bar:.0f} mm", fontsize=9, color=INK, ha="center")
    axes.text(0.98, 0.015, "seen from the front; R and L are the patient's; research use only",
              transform=axes.transAxes, fontsize=7, color=INK, ha="right", bbox=_PAPER)  # fmt: skip
    inch = 1 / figure.get_figheight()
    figure.text(0.02, 1 - 0.08 * inch, title, fontsize=12, weight="bold", color=INK, va="top")
    for row, line in enumerate(warning):
        figure.text(0.02, 1 - (_TITLE + row * _LINE) * inch, line, fontsize=8.5, weight="bold",
                    color="#b3122b", va="top")  # fmt: skip
