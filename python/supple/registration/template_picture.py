"""A template as a picture: its drawing, its bones, and the shapes that it can take."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from supple.errors import InputError
from supple.registration.portrait import INK, MARK, PEN, needs_head, skin_colours
from supple.registration.skin import vertex_normals
from supple.registration.template import Template

Floats = npt.NDArray[np.float64]

#: Rows: what is across, towards the viewer, up.
_FRONT = np.array([[1.0, 0, 0], [0, -1, 0], [0, 0, 1]])
_LEFT = np.array([[0.0, 1, 0], [1, 0, 0], [0, 0, 1]])
#: Shapes that are shown, and how many a row.
_SHAPES, _ROW = 12, 6
#: Colours of bones; Okabe and Ito (2008).
_BONES = ("#E69F00", "#F0E442", "#56B4E9", "#009E73", "#D55E00", "#0072B2", "#CC79A7", "#999999",
          "#8B5A2B")  # fmt: skip


def draw_template(path: str | Path, template: Template) -> Path:
    """Write a PNG or SVG file.

    Raises:
        InputError: another ending.
    """
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    file = Path(path)
    if file.suffix not in (".png", ".svg"):
        raise InputError(f"a picture needs a name in .png or .svg, got {file.name}.")
    figure = Figure(figsize=(12, 9.5), dpi=90, layout="constrained")
    FigureCanvasAgg(figure)
    parts: Any = figure.subfigures(2, 1, height_ratios=(1.35, 1))
    top, below = parts
    figure.suptitle(f"{template.name}: {len(template.points)} vertices, {len(template.bones)} "
                    f"bones, {len(template.blendshapes)} blendshapes", fontsize=11)  # fmt: skip
    drawn, side, bones = top.subplots(1, 3)
    _drawn(drawn, template, _FRONT, "from the front")
    _drawn(side, template, _LEFT, "from her left")
    _rig(bones, template)
    shapes = shown_shapes(template)
    for axes, (title, coefficients) in zip(below.subplots(2, _ROW).flat, shapes, strict=False):
        _body(axes, template, template.points + np.tensordot(coefficients, template.blendshapes, 1))
        axes.set_title(title, fontsize=7, color=INK)
    for axes in below.axes:
        axes.set_axis_off()
    figure.savefig(file, metadata={"Date": None} if file.suffix == ".svg" else None)
    return file


def shown_shapes(template: Template) -> list[tuple[str, Floats]]:
    """Titles and coefficients (A,) of the largest shapes at a bound, pairs on both sides."""
    both: dict[str, list[int]] = {}
    for k, name in enumerate(template.blendshape_names):
        both.setdefault(name.removesuffix("_left").removesuffix("_right"), []).append(k)
    found = []
    for name, members in both.items():
        bounds = template.blendshape_bounds[members]
        end = 1 if np.abs(bounds[:, 1]).max() >= np.abs(bounds[:, 0]).max() else 0
        coefficients = np.zeros(len(template.blendshape_names))
        coefficients[members] = bounds[:, end]
        moved = np.tensordot(coefficients, template.blendshapes, axes=1)
        title = f"{name.replace('_', ' ')} {bounds[0, end]:+.2g}"
        found.append((float(np.linalg.norm(moved)), title, coefficients))
    largest = sorted(found, key=lambda item: -item[0])[:_SHAPES]
    return [(title, coefficients) for _, title, coefficients in largest]


def _body(
    axes: Any, template: Template, points: Floats, view: Floats = _FRONT,
    colours: Floats | None = None,
) -> Floats:  # fmt: skip
    """The skin from one side, mm; returns it seen so (n, 3)."""
    seen = 1e3 * points @ view.T
    shade = np.clip(
        vertex_normals(points, template.triangles) @ (view.T @ [-0.35, 0.75, 0.55]), 0, 1
    )
    a, b, c = (seen[template.triangles[:, k]][:, [0, 2]] for k in range(3))
    ahead = (b - a)[:, 0] * (c - a)[:, 1] - (b - a)[:, 1] * (c - a)[:, 0] > 0
    faces = template.triangles[ahead]
    faces = faces[np.argsort(seen[faces, 1].mean(axis=1))]
    if colours is None:
        axes.tripcolor(seen[:, 0], seen[:, 2], faces, 0.25 + 0.75 * shade, shading="gouraud",
                       cmap=skin_colours(), vmin=0.1, vmax=1.0)  # fmt: skip
    else:
        from matplotlib.collections import PolyCollection

        lit = (0.45 + 0.55 * shade[faces].mean(axis=1))[:, None]
        flat = np.clip(colours[faces].mean(axis=1) * lit, 0, 1)
        axes.add_collection(PolyCollection(list(seen[faces][:, :, [0, 2]]), facecolors=flat,
                                           edgecolors=flat, linewidths=0.3))  # fmt: skip
        axes.autoscale_view()
    axes.set_aspect("equal")
    axes.set_axis_off()
    return np.asarray(seen)


def _drawn(axes: Any, template: Template, view: Floats, title: str) -> None:
    """The skin with the drawing and the landmarks that face the viewer."""
    _body(axes, template, template.points, view)
    axes.set_title(title, fontsize=9)
    normals = vertex_normals(template.points, template.triangles)
    for name, place in template.curves.items():
        at = place.at(template.points, template.triangles)
        ahead = place.at(normals, template.triangles) @ view[1] > 0
        flat = np.where(ahead[:, None], 1e3 * at @ view[[0, 2]].T, np.nan)
        if place.closed:
            flat = np.vstack([flat, flat[:1]])
        axes.plot(*flat.T, color=PEN, linewidth=1.8)
        if needs_head(name, at) and np.isfinite(flat[-2:]).all():
            axes.annotate("", flat[-1], flat[-2],
                          arrowprops={"arrowstyle": "-|>", "color": PEN})  # fmt: skip
    for place in template.landmarks.values():
        if place.at(normals, template.triangles)[0] @ view[1] > 0:
            at = 1e3 * view[[0, 2]] @ place.at(template.points, template.triangles)[0]
            axes.plot(*at, "o", markersize=4, color=MARK, markeredgecolor="white")


def _rig(axes: Any, template: Template) -> None:
    """Which bones hold the skin, and their joints."""
    from matplotlib.colors import to_rgb

    rgb = np.array([to_rgb(_BONES[k % len(_BONES)]) for k in range(len(template.bones))])
    _body(axes, template, template.points, colours=template.weights @ rgb)
    axes.set_title("bones and their joints", fontsize=9)
    joints = 1e3 * template.joints @ _FRONT[[0, 2]].T
    for k, parent in enumerate(template.parents):
        if parent >= 0:
            axes.plot(*joints[[parent, k]].T, color=INK, linewidth=1.2)
    axes.plot(*joints.T, "o", color=INK, markersize=4)
