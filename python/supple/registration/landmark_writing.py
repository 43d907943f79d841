"""Landmarks into the files of 3D Slicer, MeshLab and spreadsheets: mm, LPS."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from xml.sax.saxutils import quoteattr

import numpy as np
import numpy.typing as npt

from supple.errors import InputError
from supple.files import replacing

#: Schema of 3D Slicer that a written file names.
_SCHEMA = ("https://raw.githubusercontent.com/slicer/slicer/master/Modules/Loadable/Markups/"
           "Resources/Schema/markups-schema-v1.0.3.json#")  # fmt: skip

#: Columns of a ``.fcsv`` file.
_COLUMNS = "# columns = id,x,y,z,ow,ox,oy,oz,vis,sel,lock,label,desc,associatedNodeID"


def write_landmarks(path: str | Path, points: Mapping[str, npt.ArrayLike]) -> Path:
    """Write landmarks (3,) m, LPS, by name, whole or not at all.

    The suffix tells the format: ``.fcsv``, ``.json`` (``.mrk.json``), ``.csv`` or ``.pp``. All are
    in mm; a ``.pp`` names neither unit nor frame, so it fits a mesh written in mm, LPS.

    Raises:
        InputError: another suffix, or a point that is not three finite numbers.
    """
    file = Path(path)
    suffix = file.suffix.lower()
    if suffix not in _WRITERS:
        raise InputError(f"path must end in {', '.join(_WRITERS)}, got {file.name!r}.")
    rows = {}
    for name, point in points.items():
        place = np.asarray(point, dtype=np.float64)
        if place.shape != (3,) or not np.isfinite(place).all():
            raise InputError(
                f"landmark {name!r} must be three finite numbers, got {place.tolist()}."
            )
        rows[name] = (1e3 * place).tolist()
    with replacing(file) as aside:
        aside.write_text(_WRITERS[suffix](rows), encoding="utf-8")
    return file


def _fcsv(rows: dict[str, list[float]]) -> str:
    lines = ["# Markups fiducial file version = 4.11", "# CoordinateSystem = LPS",
             _COLUMNS]  # fmt: skip
    lines += [f"{k},{x!r},{y!r},{z!r},0,0,0,1,1,1,0,{name},,"
              for k, (name, (x, y, z)) in enumerate(rows.items())]  # fmt: skip
    return "\n".join([*lines, ""])


def _json(rows: dict[str, list[float]]) -> str:
    points = [{"id": str(k + 1), "label": name, "position": place, "positionStatus": "defined"}
              for k, (name, place) in enumerate(rows.items())]  # fmt: skip
    markup = {"type": "Fiducial", "coordinateSystem": "LPS", "coordinateUnits": "mm",
              "controlPoints": points}  # fmt: skip
    return json.dumps({"@schema": _SCHEMA, "markups": [markup]}, indent=1) + "\n"


def _csv(rows: dict[str, list[float]]) -> str:
    lines = ["# frame LPS, unit mm", "name,x,y,z"]
    lines += [f"{name},{x!r},{y!r},{z!r}" for name, (x, y, z) in rows.items()]
    return "\n".join([*lines, ""])


def _pp(rows: dict[str, list[float]]) -> str:
    lines = ["<!DOCTYPE PickedPoints>", "<PickedPoints>"]
    lines += [f' <point x="{x!r}" y="{y!r}" z="{z!r}" active="1" name={quoteattr(name)}/>'
              for name, (x, y, z) in rows.items()]  # fmt: skip
    return "\n".join([*lines, "</PickedPoints>", ""])


_WRITERS = {".fcsv": _fcsv, ".json": _json, ".csv": _csv, ".pp": _pp}
