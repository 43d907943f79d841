"""What the pages for surgeons share: one HTML file that needs no network."""

from __future__ import annotations

import base64
import json
from collections.abc import Iterable, Mapping
from html import escape
from importlib import resources
from pathlib import Path
from string import Template
from typing import Any

import numpy as np
import numpy.typing as npt

from supple.files import replacing

Floats = npt.NDArray[np.float64]
Ints = npt.NDArray[np.int64]


def write_page(path: str | Path, package: str, name: str, parts: Mapping[str, str]) -> Path:
    """Write a page, whole or not at all.

    Args:
        package: its folder ``templates`` holds NAME.html and NAME.js, which finds the functions of
            ``scene.js`` under ``page``.
        parts: what the HTML names ($title …), as HTML; style, script and plotly.js are put in.
    """
    from plotly.offline import get_plotlyjs

    page = Template(text(package, f"templates/{name}.html")).substitute(
        parts,
        style=text("supple.page", "page.css"),
        script=text("supple.page", "scene.js") + text(package, f"templates/{name}.js"),
        plotly=get_plotlyjs().replace("</script", "<\\/script"),
    )
    with replacing(Path(path)) as aside:
        aside.write_text(page, encoding="utf-8")
    return Path(path)


def text(package: str, name: str) -> str:
    """A file that lies in a package."""
    return resources.files(package).joinpath(name).read_text(encoding="utf-8")


def as_script(scene: Mapping[str, Any]) -> str:
    """JSON that is safe inside a script element."""
    return json.dumps(scene, allow_nan=False).replace("<", "\\u003c")


def packed(values: npt.NDArray[Any], kind: str) -> str:
    """An array as base64 of ``kind``, such as "<f4"."""
    return base64.b64encode(np.ascontiguousarray(values, dtype=kind).tobytes()).decode("ascii")


def thinned(points: Floats, triangles: Ints, most: int) -> tuple[Ints, Ints]:
    """One node a voxel, the voxel as small as ``most`` allows; collapsed triangles go.

    Args:
        points: (n, 3), in units of which one is small: mm.

    Returns:
        The nodes that are kept (k,), k ≤ most, and triangles of them.
    """
    if not len(points):
        return np.empty(0, dtype=np.int64), np.empty((0, 3), dtype=np.int64)
    size = 1.0
    while True:
        cell = np.floor((points - points.min(axis=0)) / size).astype(np.int64)
        rows, columns = cell[:, 1].max() + 1, cell[:, 2].max() + 1
        key = (cell[:, 0] * rows + cell[:, 1]) * columns + cell[:, 2]
        _, first, to = np.unique(key, return_index=True, return_inverse=True)
        if len(first) <= most:
            break
        size *= max(1.15, 0.9 * (len(first) / most) ** 0.5)  # of a surface, by its area
    tri = to[triangles]
    whole = (tri[:, 0] != tri[:, 1]) & (tri[:, 1] != tri[:, 2]) & (tri[:, 2] != tri[:, 0])
    return first, tri[whole]


def rows(pairs: Iterable[tuple[str, ...]]) -> str:
    """Table rows of plain texts, the first a heading."""
    return "".join(
        f"<tr><th>{escape(first)}</th>{''.join(f'<td>{escape(x)}</td>' for x in rest)}</tr>"
        for first, *rest in pairs
    )


def bullets(sentences: Iterable[str]) -> str:
    """A list of plain texts."""
    items = "".join(f"<li>{escape(sentence)}</li>" for sentence in sentences)
    return f"<ul>{items}</ul>" if items else "<p>None.</p>"
