"""Landmarks to and from the files of 3D Slicer, MeshLab and spreadsheets.

Sources: 3D Slicer developer guide, Markups (``.fcsv``: a comment line with the version, one with
``CoordinateSystem``, which up to version 4.10 is 0 for RAS or 1 for LPS, one with ``columns``;
``.mrk.json``: schema markups-v1.0.3; a table of control points: ``label,l,p,s`` or
``label,r,a,s``); MeshLab's PickedPoints, a ``point`` with attributes x, y, z, name, active each.
"""

from __future__ import annotations

import csv
import io
import json
import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np
import numpy.typing as npt

from supple.errors import InputError
from supple.files import METRES, existing, metres, parsed_xml
from supple.registration.landmark_names import landmark_name

Floats = npt.NDArray[np.float64]

SUFFIXES = (".fcsv", ".json", ".pp", ".csv")
_TURN = {"LPS": np.ones(3), "RAS": np.array([-1.0, -1.0, 1.0])}
_FRAMES = {"LPS": "LPS", "RAS": "RAS", "0": "RAS", "1": "LPS"}
#: Largest distance between landmarks, in the file's numbers, that is a torso's in m, cm or mm.
_BY_SIZE = (("m", 0.02, 2.0), ("cm", 2.0, 80.0), ("mm", 80.0, 2000.0))


@dataclass(frozen=True)
class Landmarks:
    """Landmarks in LPS, m."""

    points: Mapping[str, Floats]  #: the template's name → (3,) m
    said: list[str] = field(default_factory=list)  #: what was found or mended, a sentence each


@dataclass
class _Raw:
    """What a file holds: labels and numbers, and what it says of unit and frame, if anything."""

    labels: list[str]
    points: list[list[float]]
    unit: str | None = None
    frame: str | None = None
    said: list[str] = field(default_factory=list)


def read_landmarks(
    path: str | Path, unit: str | None = None, frame: str | None = None
) -> Landmarks:
    """Read landmarks by name from ``.fcsv``, ``.mrk.json``, ``.json``, ``.pp`` or ``.csv``.

    Args:
        path: the file.
        unit: of length; by default what the file or its format says, else found from the spread.
        frame: "LPS" or "RAS"; by default what the file says, else its format's default.

    Raises:
        InputError: a file that cannot be read, an unknown or a repeated name, NaN, a unit or a
            frame that is not known or that the file contradicts.
    """
    file = existing(Path(path))
    suffix = file.suffix.lower()
    if suffix not in _READERS:
        raise InputError(f"{file} must be one of {', '.join(SUFFIXES)}; export the landmarks so.")
    try:
        text = file.read_text(encoding="utf-8-sig")
        raw = _READERS[suffix](text, file)
    except (ValueError, LookupError, TypeError, AttributeError) as error:
        raise InputError(f"{file} is no {suffix} file of landmarks ({error}); export it again, or "
                         "as a .csv file with the columns name, x, y, z.") from None  # fmt: skip
    if not raw.labels:
        raise InputError(f"{file} holds no landmarks; place and name at least one.")
    points, said = _named(raw, file)
    scale, sentence = _unit(points, raw.unit, unit, file)
    turn, turned = _frame(raw.frame, frame, file)
    return Landmarks(MappingProxyType({n: p * scale * turn for n, p in points.items()}),
                     [*raw.said, sentence, turned, *said])  # fmt: skip


def _named(raw: _Raw, file: Path) -> tuple[dict[str, Floats], list[str]]:
    """Numbers by the template's names."""
    points: dict[str, Floats] = {}
    said = []
    for label, numbers in zip(raw.labels, raw.points, strict=True):
        try:
            name = landmark_name(label)
        except InputError as error:
            raise InputError(f"{file}: {error}") from None
        point = np.array(numbers, dtype=np.float64)
        if point.shape != (3,) or not np.isfinite(point).all():
            raise InputError(f"{file}: landmark {label!r} must be at three finite numbers, got "
                             f"{numbers}; place it again or remove it.")  # fmt: skip
        if name in points:
            if not np.array_equal(points[name], point):
                raise InputError(f"{file} has two landmarks {name!r}, at {points[name].tolist()} "
                                 f"and {point.tolist()}; remove one.")  # fmt: skip
            said.append(f"Landmark {name!r} stands twice at the same place.")
        if label != name:
            said.append(f"Landmark {label!r} is taken as {name!r}.")
        points[name] = point
    return points, said


def _unit(
    points: dict[str, Floats], named: str | None, given: str | None, file: Path
) -> tuple[float, str]:
    if named is not None and given is not None and named != given:
        raise InputError(f"{file} is in {named}, got unit={given!r}; leave out unit or correct it.")
    if given is not None or named is not None:
        unit = given or named or ""
        scale = metres(unit)
        return scale, f"The landmarks are in {unit}, as {'given' if given else 'the file says'}."
    every = np.array(list(points.values()))
    spread = float(np.linalg.norm(every - every[0], axis=1).max())
    if len(every) == 1:
        return metres("mm"), "The file names no unit and holds one landmark: taken as mm."
    for unit, low, high in _BY_SIZE:
        if low <= spread < high:
            return metres(unit), f"The file names no unit: {unit}, as the landmarks' spread tells."
    raise InputError(f"{file} names no unit and its landmarks are up to {spread:.4g} apart, which "
                     "is no torso in m, cm or mm; write them in mm, with a comment '# unit mm' "
                     "or columns x_mm, y_mm, z_mm in a .csv file.")  # fmt: skip


def _frame(named: str | None, given: str | None, file: Path) -> tuple[Floats, str]:
    for frame in (named, given):
        if frame is not None and frame not in _TURN:
            raise InputError(f"frame must be LPS or RAS, got {frame!r} for {file}.")
    if named is not None and given is not None and named != given:
        raise InputError(f"{file} is in {named}, got frame={given!r}; leave it out or correct it.")
    frame = given or named
    if frame is None:
        return _TURN["LPS"], "The file names no frame: taken as the scan's, LPS."
    if frame == "RAS":
        return _TURN["RAS"], "The landmarks are in RAS: x and y are turned round to LPS."
    return _TURN["LPS"], "The landmarks are in LPS."


def _fcsv(text: str, file: Path) -> _Raw:
    head = dict(re.findall(r"^#\s*([A-Za-z ]+?)\s*=\s*(.+?)\s*$", text, re.MULTILINE))
    versioned = "Markups fiducial file version" in head
    default = "id,x,y,z,ow,ox,oy,oz,vis,sel,lock,label" if versioned else "label,x,y,z,sel,vis"
    columns = [c.strip() for c in head.get("columns", default).split(",")]
    label, first = columns.index("label"), columns.index("x")
    raw = _Raw([], [], "mm")
    stated = head.get("CoordinateSystem")
    if stated is None:
        raw.frame, raw.said = "RAS", ["The file names no coordinate system: RAS, Slicer's default."]
    else:
        raw.frame = _FRAMES.get(stated, stated)
    for row in csv.reader(line for line in io.StringIO(text) if line.strip() and line[0] != "#"):
        raw.labels.append(row[label] if label < len(row) else "")
        raw.points.append([float(v) for v in row[first : first + 3]])
    return raw


def _json(text: str, file: Path) -> _Raw:
    raw = _Raw([], [])
    whole = json.loads(text)
    if not isinstance(whole, dict):
        raise ValueError("it holds no 'markups', as 3D Slicer's do, and no names")
    if "markups" not in whole:
        return _plain_json(whole)
    for markup in whole["markups"]:
        points = markup.get("controlPoints", [])
        code = markup.get("coordinateUnits", "mm")
        unit = code if isinstance(code, str) else str(code[0])
        frame = _FRAMES.get(str(markup.get("coordinateSystem", "LPS")), "")
        if not frame or unit not in METRES:
            raise InputError(f"{file} is in {markup.get('coordinateSystem')}, {unit}; export it in "
                             "LPS or RAS and mm.")  # fmt: skip
        if raw.labels and (raw.unit, raw.frame) != (unit, frame):
            raise InputError(f"{file} holds lists in different units or frames; export one.")
        placed = [p for p in points if p.get("positionStatus", "defined") == "defined"]
        if placed:
            raw.unit, raw.frame = unit, frame
        unset = len(points) - len(placed)
        raw.said += [f"{unset} control points without a position are left out."] * (unset > 0)
        only = len(placed) == 1 and str(placed[0].get("label", "")).rpartition("-")[2].isdigit()
        for point in placed:
            raw.labels.append(str(markup.get("name", "") if only else point.get("label", "")))
            raw.points.append([float(v) for v in point["position"]])
    return raw


def _plain_json(whole: dict[str, Any]) -> _Raw:
    """``{"xiphoid": [x, y, z], …}``, with "unit" and "frame" beside the names if known."""
    unit, frame = whole.pop("unit", None), whole.pop("frame", None)
    if unit is not None:
        metres(unit)
    for name, numbers in whole.items():
        if not isinstance(numbers, list) or len(numbers) != 3:
            raise ValueError("it holds no 'markups', as 3D Slicer's do, and "
                             f"{name!r} is no list of three numbers")  # fmt: skip
    return _Raw(list(whole), [[float(v) for v in one] for one in whole.values()], unit, frame)


def _pp(text: str, file: Path) -> _Raw:
    raw = _Raw([], [])
    root = parsed_xml(text, file)
    if root.tag != "PickedPoints":
        raise InputError(f"{file} holds {root.tag!r}, not MeshLab's PickedPoints.")
    for point in root.iter("point"):
        if point.get("active", "1") not in ("1", "true"):
            raw.said.append(f"Point {point.get('name')!r} is not active and left out.")
            continue
        raw.labels.append(point.get("name", ""))
        raw.points.append([float(point.get(axis, "")) for axis in "xyz"])
    return raw


def _csv(text: str, file: Path) -> _Raw:
    comments = " ".join(line for line in text.splitlines() if line.lstrip().startswith("#"))
    unit = re.search(r"\bunits?\b\s*[:=]?\s*(mm|cm|dm|um|in|m)\b", comments)
    frame = re.search(r"\b(?:frame|CoordinateSystem|space)\b\s*[:=]?\s*(\w+)", comments, re.I)
    lines = [t for t in text.splitlines() if t.strip() and not t.lstrip().startswith("#")]
    raw = _Raw([], [], unit and unit[1], frame and _FRAMES.get(frame[1], frame[1]))
    name, axes, lines = _columns(lines, raw)
    delimiter = _delimiter(lines)
    for row in csv.reader(lines, delimiter=delimiter):
        if delimiter != ",":  # spreadsheets of some countries: 1,5 for 1.5
            row = [c if k == name else c.replace(",", ".") for k, c in enumerate(row)]
        raw.labels.append(row[name].strip())
        raw.points.append([float(row[axis]) for axis in axes if axis < len(row)])
    return raw


def _columns(lines: list[str], raw: _Raw) -> tuple[int, list[int], list[str]]:
    """Which columns hold name and coordinates; a header may end in the unit, ``x_mm``, ``x [mm]``.

    3D Slicer's tables name the axes after the frame: l, p, s or r, a, s.
    """
    cells = next(csv.reader(lines[:1], delimiter=_delimiter(lines)), [])
    words = [re.match(r"\s*([a-z]*)[\s_\[(]*(mm|cm|dm|um|in|m)?[\])]?\s*$", c.lower())
             for c in cells]  # fmt: skip
    heads = [w[1] if w else c.strip().lower() for w, c in zip(words, cells, strict=True)]
    for axes, frame in (("xyz", None), ("lps", "LPS"), ("ras", "RAS")):
        if all(axis in heads for axis in axes):
            at = [heads.index(axis) for axis in axes]
            raw.unit = raw.unit or next((w[2] for w in (words[k] for k in at) if w and w[2]), None)
            raw.unit = raw.unit or ("mm" if frame else None)
            raw.frame = raw.frame or frame
            name = next((heads.index(h) for h in ("name", "label", "landmark", "id")
                         if h in heads), 0)  # fmt: skip
            return name, at, lines[1:]
    return 0, [1, 2, 3], lines


def _delimiter(lines: list[str]) -> str:
    """Of the first line: semicolon, tab or comma."""
    return next((d for d in ";\t" if lines and d in lines[0]), ",")


_READERS = {".fcsv": _fcsv, ".json": _json, ".pp": _pp, ".csv": _csv}
