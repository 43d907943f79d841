"""Bodies as pictures: boundaries shaded by light, coloured by a field, with cells marked.

Drawn by matplotlib without a display, so a command can leave a PNG wherever it runs; for looking
around open the VTU files in ParaView.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from .boundary_triangles import triangles_of, unit_normals
from .errors import InputError
from .mesh import Mesh
from .overlap import owners

Floats = npt.NDArray[np.float64]
Ints = npt.NDArray[np.int64]

#: Unmarked and marked cells, and what is drawn to compare with; Okabe and Ito (2008).
_PLAIN, _MARKED, _GHOST = (0.62, 0.72, 0.82), (0.84, 0.37, 0.0), (0.35, 0.35, 0.35)
_LIGHT = np.array([0.3, -0.6, 0.74])


@dataclass(frozen=True, eq=False)
class Panel:
    """One body of a picture.

    Attributes:
        mesh: what is drawn, as `Mesh.placed` or `Mesh.moved` gives it.
        title: above it.
        values: (n,) of nodes or (c,) of cells, drawn as colours; None for one colour.
        label: what they are, with their unit.
        marked: ids of cells that stand out.
        ghost: another shape, drawn as a thin net around this one.
    """

    mesh: Mesh
    title: str = ""
    values: npt.ArrayLike | None = None
    label: str = ""
    marked: Sequence[int] = ()
    ghost: Mesh | None = None


def draw(
    path: str | Path,
    panels: Sequence[Panel],
    title: str = "",
    view: tuple[float, float] = (15.0, -70.0),
) -> Path:
    """Draw panels side by side at one scale, z up, lengths in mm, and write a PNG or SVG file.

    Args:
        title: above all of them.
        view: elevation above the x–y plane and azimuth about z, degrees.

    Raises:
        InputError: the file's name ends otherwise, or no panels.
    """
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure
    from matplotlib.layout_engine import ConstrainedLayoutEngine

    file = Path(path)
    if file.suffix not in (".png", ".svg") or not panels:
        raise InputError(f"a picture needs panels and a name in .png or .svg, got {file.name}.")
    layout = ConstrainedLayoutEngine(w_pad=0.12)
    figure = Figure(figsize=(3.7 * len(panels) + 0.3, 3.8), dpi=100, layout=layout)
    FigureCanvasAgg(figure)
    box = _box(panels)
    for number, panel in enumerate(panels, start=1):
        axes: Any = figure.add_subplot(
            1, len(panels), number, projection="3d", computed_zorder=False
        )
        _dress(axes, panel, box, view)
        _fill(figure, axes, panel)
    if title:
        figure.suptitle(title, fontsize=10)
    if file.suffix == ".svg":
        figure.savefig(file, metadata={"Date": None})
    else:
        _few_colours(figure).save(file, optimize=True)
    return file


def _few_colours(figure: Any) -> Any:
    """The drawn figure as a Pillow image of 256 colours, a third of the bytes."""
    from PIL import Image

    figure.canvas.draw()
    whole = Image.fromarray(np.asarray(figure.canvas.buffer_rgba()))
    return whole.convert("RGB").quantize(256)


def _box(panels: Sequence[Panel]) -> Floats:
    """Lowest and highest corner (2, 3), mm, of everything that is drawn."""
    shapes = [m for p in panels for m in (p.mesh, p.ghost) if m is not None]
    ends = [(m.points.min(axis=0), m.points.max(axis=0)) for m in shapes]
    return 1e3 * np.array([np.min(ends, axis=(0, 1)), np.max(ends, axis=(0, 1))])


def _dress(axes: Any, panel: Panel, box: Floats, view: tuple[float, float]) -> None:
    axes.set_title(panel.title, fontsize=9)
    axes.view_init(*view)
    axes.set_proj_type("ortho")
    axes.set_box_aspect(np.maximum(box[1] - box[0], 1e-3 * np.ptp(box, axis=0).max()), zoom=1.1)
    for axis, low, high in zip("xyz", *box, strict=True):
        getattr(axes, f"set_{axis}lim")(low, high)
        getattr(axes, f"set_{axis}label")(f"{axis} (mm)", fontsize=7, labelpad=-6)
    axes.tick_params(labelsize=6, pad=-2)
    axes.locator_params(nbins=4)


def _fill(figure: Any, axes: Any, panel: Panel) -> None:
    mesh = panel.mesh
    triangles, rows = triangles_of(mesh.boundary(), mesh.table)
    if panel.ghost is not None:
        net = _polygons(panel.ghost, triangles, facecolors="none", linewidths=0.25)
        net.set_edgecolor((*_GHOST, 0.5))
        axes.add_collection3d(net)
    colours = _shaded(mesh.points, triangles, _colours(figure, axes, panel, triangles, rows))
    edge = 0.2 if mesh.table.degree == 1 else 0.0  # edges within a curved facet are none
    axes.add_collection3d(
        _polygons(mesh, triangles, facecolors=colours, linewidths=edge, edgecolors=(0, 0, 0, 0.4))
    )
    if len(panel.marked):
        whole = _marked_triangles(mesh, panel.marked)
        axes.add_collection3d(
            _polygons(mesh, whole, facecolors=_MARKED, linewidths=0.5, edgecolors="black")
        )


def _polygons(mesh: Mesh, triangles: Ints, **style: Any) -> Any:
    from mpl_toolkits.mplot3d.art3d import Poly3DCollection

    return Poly3DCollection(1e3 * mesh.points[triangles], **style)


def _marked_triangles(mesh: Mesh, cells: Sequence[int]) -> Ints:
    """All facets of the cells, as triangles: they may lie inside the body."""
    table = mesh.table
    facets = mesh.cells[np.asarray(cells)][:, table.facets]
    facets[:, table.facets < 0] = -1
    return triangles_of(facets.reshape(-1, table.facets.shape[1]), table)[0]


def _colours(figure: Any, axes: Any, panel: Panel, triangles: Ints, rows: Ints) -> Floats:
    """(t, 4) colours before light, and the colour bar."""
    opacity = 0.35 if len(panel.marked) else 1.0
    if panel.values is None:
        return np.tile((*_PLAIN, opacity), (len(triangles), 1))
    from matplotlib import colormaps
    from matplotlib.cm import ScalarMappable
    from matplotlib.colors import Normalize

    values, mesh = np.asarray(panel.values, dtype=float), panel.mesh
    if len(values) == len(mesh.points):
        shown = values[triangles].mean(axis=1)
    else:
        shown = values[owners(mesh)[rows]]
    scale = ScalarMappable(Normalize(float(values.min()), float(values.max())),
                           colormaps["cividis"])  # fmt: skip
    bar = figure.colorbar(scale, ax=axes, shrink=0.55, pad=0.08, orientation="horizontal")
    bar.set_label(panel.label, fontsize=8)
    bar.ax.tick_params(labelsize=7)
    return np.asarray(scale.to_rgba(shown, alpha=opacity))


def _shaded(points: Floats, triangles: Ints, colours: Floats) -> Floats:
    """The colours under a light from above and in front."""
    normal = unit_normals(points[triangles])
    light = 0.72 + 0.28 * (normal @ (_LIGHT / np.linalg.norm(_LIGHT)))
    return np.column_stack([np.clip(colours[:, :3] * light[:, None], 0, 1), colours[:, 3]])
