"""A scan from a file: unit and frame found and said, then what is wrong with it mended and said.

1. read      points and triangles as they stand in the file
2. unit      given, named in the file's comments, or found from the size of a body
3. frame     to LPS, where the format or a comment names another
4. tidy      points that are no numbers, triangles without area
5. clean     pieces, walls and orientation (scan_clean.py)
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import numpy.typing as npt

from supple.errors import InputError
from supple.files import METRES, existing, metres
from supple.registration.scan_clean import clean, tidy
from supple.surface import Surface
from supple.surface_files import EVERY, GLTF, load

Floats = npt.NDArray[np.float64]

#: Largest extent, m, of what may be a scan of a torso or of a whole body, arms raised.
BODY = (0.15, 2.5)
#: From here, m, up to BODY a scan may be in its unit and show a part of a torso only.
_PART = 0.03
#: Which unit a file is in by its largest extent, in its own numbers.
_BY_SIZE = (("m", 0.15, 2.2), ("dm", 2.2, 15.0), ("cm", 15.0, 220.0), ("mm", 220.0, 2500.0))
#: Extents in cm that may as well be a torso of 0.4 to 1 m in inches.
_OR_INCHES = (15.0, 40.0)
#: Head of a file that may hold comments, bytes.
_HEAD = 4096


@dataclass(frozen=True)
class Scan:
    """A scan in LPS, m."""

    surface: Surface
    unit: str  #: that of the file
    said: list[str]  #: what was found or mended, a sentence each


def read_scan(path: str | Path, unit: str | None = None) -> Scan:
    """Read a scan: PLY, OBJ, STL, OFF, glTF, GLB, VTK, VTP or VTU; triangles or a cloud of points.

    A format names no unit but glTF's metre, and that is often wrong: without ``unit`` it is found
    from the size. The frame is LPS (+x the patient's left, +y to the back, +z to the head) unless
    a comment names RAS (``frame RAS``, 3D Slicer's ``SPACE=RAS``); glTF is y-up and is turned.

    Raises:
        InputError: no such file, a unit that the size contradicts, a size of no body, more than
            1 % of the points NaN or infinite, fewer than 200 points.
        MeshError: a file that cannot be read.

    Source: glTF 2.0, §3.4 (+y up, +z to the front, so the subject's left is +x); 3D Slicer's
    ``SPACE`` in the header of a model, vtkMRMLModelStorageNode.
    """
    file = existing(Path(path))
    raw, triangles = load(file, EVERY)
    head = _comments(file)
    points, triangles, said = tidy(raw, triangles, str(file))
    extent = float(np.ptp(points, axis=0).max())
    found, sentence = _unit(file, extent, unit, head)
    points, turned = _to_lps(points * metres(found), file, head)
    surface, cleaned = clean(Surface(points, triangles))
    return Scan(surface, found, [sentence, turned, *said, *cleaned])


def _unit(file: Path, extent: float, given: str | None, head: str) -> tuple[str, str]:
    """The unit of length, and the sentence that says where it is from."""
    named = re.search(r"\bunits?\s*[:=]?\s*(mm|cm|dm|um|in|m)\b", head)
    if given is not None:
        metres(given)
        unit, why = given, "as given"
    elif named:
        unit, why = named[1], "as the file's comment says"
    elif file.suffix.lower() in GLTF and BODY[0] <= extent <= BODY[1]:
        unit, why = "m", "as glTF defines"
    else:
        unit, why = _by_size(file, extent), "found from its size"
    size = extent * metres(unit)
    if not BODY[0] <= size <= BODY[1]:
        raise InputError(
            f"{file} spans {extent:.4g} {unit} ({why}), {size:.3g} m, but a scan of a torso spans "
            f"{BODY[0]} to {BODY[1]} m; {_remedy(extent, size)}"
        )
    return unit, f"The unit is {unit}, {why}: the scan spans {size:.2f} m."


def _remedy(extent: float, size: float) -> str:
    """Another unit, or more of the body; ``size`` is m as it was read."""
    more = "scan the front from neck to waist and from armpit to armpit"
    fits = [u for u in METRES if u != "um" and BODY[0] <= extent * METRES[u] <= BODY[1]]
    if not fits:
        return f"{more}, and give its unit."
    other = f"if it is in {fits[0]} ({extent * METRES[fits[0]]:.2f} m), {_given(fits[0])}."
    return other if not _PART <= size < BODY[0] else f"{more}; {other}"


def _given(unit: str) -> str:
    """How a unit is given, on the command line and in Python."""
    return f"give --unit {unit} (in Python, unit={unit!r})"


def _by_size(file: Path, extent: float) -> str:
    if _OR_INCHES[0] <= extent <= _OR_INCHES[1]:
        raise InputError(
            f"{file} spans {extent:.4g}, which may be {extent:.0f} cm or {extent * 2.54:.0f} cm in "
            f"inches; {_given('cm')} or --unit in."
        )
    for unit, low, high in _BY_SIZE:
        if low <= extent < high:
            return unit
    raise InputError(
        f"{file} spans {extent:.4g}, which is a torso's {BODY[0]} to {BODY[1]} m in no unit (m, "
        "dm, cm, mm); check that it is a scan of a torso, and give --unit (in Python, unit=)."
    )


def _to_lps(points: Floats, file: Path, head: str) -> tuple[Floats, str]:
    named = re.search(r"(?:\bframe\s+|\bSPACE\s*=\s*|\bspace\s*[:=]\s*)(RAS|LPS)\b", head)
    if named and named[1] == "RAS":
        return points * [-1.0, -1.0, 1.0], "The file says RAS: x and y are turned round to LPS."
    if named:
        return points, "The frame is LPS, as the file's comment says."
    if file.suffix.lower() in GLTF:
        turned = np.stack([points[:, 0], -points[:, 2], points[:, 1]], axis=1)
        return turned, "glTF is y-up with z to the front: turned to LPS."
    return points, "The file names no frame: taken as LPS."


def _comments(file: Path) -> str:
    """The text of a file's head in which comments stand; none of a binary body."""
    with file.open("rb") as stream:
        data = stream.read(_HEAD)
    suffix = file.suffix.lower()
    if suffix == ".ply":
        data = data.split(b"end_header")[0]
        data = b"\n".join(s for s in data.split(b"\n") if s.startswith((b"comment", b"obj_info")))
    elif suffix in (".obj", ".off"):
        data = b"\n".join(s for s in data.split(b"\n") if s.lstrip().startswith(b"#"))
    elif suffix == ".stl":
        data = data[:80]
    elif suffix == ".vtk":
        data = b"\n".join(data.split(b"\n")[:2])
    elif suffix in GLTF:
        data = b""
    return data.decode("latin-1")
