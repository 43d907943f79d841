"""What a registration found → files: skin, drawing, landmarks, parameters, tables, picture, page.

All lengths in files are mm, in the scan's frame (LPS), and each file says so.
"""

from __future__ import annotations

import csv
import json
import platform
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from functools import cached_property
from importlib.metadata import version
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

import supple
from supple.errors import InputError
from supple.files import existing
from supple.registration.body_size import body_size
from supple.registration.measures import Measures, measures
from supple.registration.metrics import Metrics, metrics
from supple.registration.posture import Posture
from supple.registration.transfer import Carried, Transfer
from supple.registration.trust import below

if TYPE_CHECKING:
    from supple.registration.registration import Registration
    from supple.registration.report import ReportData
    from supple.registration.template import Template
    from supple.surface import Surface

Floats = npt.NDArray[np.float64]
Place = Callable[[str], Path]

#: Least share of the drawing that lies on a scan of the front, a third of which may be holes.
_DRAWN = 0.25
#: ml: a breast of less has no edge to be seen. 24 of random bodies, registered, have 108 to 429.
_FLAT = 50.0


@dataclass(frozen=True, eq=False, repr=False)
class Outcome:
    """A registration, the scan it was made to, and all that follows."""

    registration: Registration
    scan: Surface
    given: Mapping[str, Floats] = field(default_factory=dict)  #: landmarks on the scan, (3,) m
    title: str = ""
    said: Sequence[str] = ()  #: what was found or mended on reading
    weights: Mapping[str, float] = field(default_factory=dict)  #: of the energy
    unit: str = ""  #: that the scan was read in

    @cached_property
    def curves(self) -> dict[str, Carried]:
        """The drawing on the scan."""
        return self._transfer.curves()

    @cached_property
    def landmarks(self) -> dict[str, Carried]:
        """The landmarks on the scan, one point each."""
        return self._transfer.landmarks()

    @cached_property
    def measures(self) -> Measures:
        """Of the breasts."""
        return measures(self.registration)

    @cached_property
    def metrics(self) -> Metrics:
        """Of the fit."""
        return metrics(self.registration, self.given)

    @cached_property
    def _transfer(self) -> Transfer:
        return Transfer.of(self.registration, self.scan)

    def summary(self) -> dict[str, Any]:
        """All numbers, for result.json: mm, ml, s."""
        m, fit = self.metrics, self.registration
        return {
            "unit": "mm",
            "frame": "LPS",
            "template": fit.template.name,
            "trustworthy": bool(fit.trustworthy),
            "warnings": list(fit.warnings),
            "said": list(self.said),
            "metrics": asdict(m),
            "body": asdict(body_size(fit)),
            "scan_unit": self.unit,
            "measures": [asdict(row) for row in self.measures.rows],
            "ptosis": dict(self.measures.ptosis),
            "landmarks": {k: 1e3 * c.points[0] for k, c in self.landmarks.items()},
            "on_scan": {k: float(c.on_scan.mean()) for k, c in self.curves.items()},
            "seconds": dict(fit.seconds),
            "versions": versions(),
        }


def judged(outcome: Outcome) -> Outcome:
    """Not to be trusted where another body is in the scan, or hardly any of the drawing on it."""
    from supple.registration.second_body import second_body

    fit = outcome.registration
    found = [text for text in (second_body(fit), _undrawn(outcome)) if text]
    flat = _flat(outcome.measures) if fit.trustworthy and not found else ""
    if found:
        fit = replace(fit, trustworthy=False, warnings=[*fit.warnings, *found])
    elif flat:
        fit = replace(fit, warnings=[*fit.warnings, flat])
    return replace(outcome, registration=fit) if found or flat else outcome


def _undrawn(outcome: Outcome) -> str:
    """The back was scanned. Of a cloud, which is no surface, nothing lies on the scan anyhow."""
    if not len(outcome.scan.triangles):
        return ""
    share = float(np.concatenate([c.on_scan for c in outcome.curves.values()]).mean())
    if share >= _DRAWN:
        return ""
    return (f"Only {below(share)} of the drawing lies on the scan, less than "
            f"{_DRAWN:.0%}; scan the front.")  # fmt: skip


def _flat(found: Measures) -> str:
    """A man's chest, or one after a mastectomy: nothing there holds the drawing."""
    volumes = {side: found.of("volume", side).value for side in ("left", "right")}
    flat = [f"{side} breast stands out by {ml:.0f} ml" for side, ml in volumes.items()
            if ml < _FLAT]  # fmt: skip
    if not flat:
        return ""
    return (f"The {' and the '.join(flat)}, less than {_FLAT:.0f} ml: little on the scan tells "
            "where its outline and its nipple are.")  # fmt: skip


def write(outcome: Outcome, place: Place) -> None:
    """Write every file; ``place`` gives the path of each by its name."""
    from supple.registration.landmark_writing import write_landmarks
    from supple.registration.lines import write_lines
    from supple.registration.report import write_report
    from supple.surface import Surface

    fit = outcome.registration
    sd = {} if fit.covariance is None else {"sd": 1e3 * fit.sd}
    Surface(fit.points, fit.template.triangles).write(place("registered.ply"), values=sd)
    for suffix in ("ply", "obj", "glb"):
        write_lines(place(f"drawing.{suffix}"), outcome.curves)
    marks = {name: carried.points[0] for name, carried in outcome.landmarks.items()}
    for name in ("landmarks.mrk.json", "landmarks.fcsv"):
        write_landmarks(place(name), marks)
    text = json.dumps(parameters(outcome), indent=1)
    place("parameters.json").write_text(text + "\n", encoding="utf-8")
    _table(place("table.csv"), outcome)
    _picture(place("picture.png"), outcome)
    write_report(place("report.html"), _report(outcome))


def parameters(outcome: Outcome) -> dict[str, Any]:
    """The posture by names, with what it belongs to; `read_posture` reads it again."""
    fit, posture = outcome.registration, outcome.registration.posture
    bones = {
        bone.name: {
            "rotation": posture.rotations[k].tolist(),
            "translation_mm": (1e3 * posture.translations[k]).tolist(),
            "scale": posture.scales[k].tolist(),
        }
        for k, bone in enumerate(fit.template.bones)
    }
    return {
        "unit": "mm",
        "frame": "LPS",
        "template": {"name": fit.template.name, "source": fit.template.source,
                     "vertices": len(fit.template.points)},
        "bones": bones,
        "blendshapes": dict(zip(fit.template.blendshape_names, posture.blend.tolist(),
                                strict=True)),
        "weights": dict(outcome.weights),
        "iterations": int(fit.iterations),
        "versions": versions(),
    }  # fmt: skip


def read_posture(path: str | Path, template: Template) -> Posture:
    """The posture of an earlier registration's parameters.json, to start the next one from.

    Raises:
        InputError: no such file, or one that is not of this template.
    """
    file = existing(Path(path))
    try:
        held = json.loads(file.read_text(encoding="utf-8"))
        bones = [held["bones"][bone.name] for bone in template.bones]
        blend = [held["blendshapes"][name] for name in template.blendshape_names]
        posture = Posture(
            np.array([bone["rotation"] for bone in bones], dtype=np.float64),
            1e-3 * np.array([bone["translation_mm"] for bone in bones], dtype=np.float64),
            np.array([bone["scale"] for bone in bones], dtype=np.float64),
            np.array(blend, dtype=np.float64),
        )
    except (ValueError, KeyError, TypeError) as error:
        raise InputError(
            f"{file} does not hold the parameters of the template {template.name!r} ({error}); "
            "give the parameters.json that was written with this template."
        ) from None
    k = len(template.bones)
    shapes = (posture.rotations.shape, posture.translations.shape, posture.scales.shape)
    if shapes != ((k, 3, 3), (k, 3), (k, 3)) or not np.isfinite(posture.rotations).all():
        raise InputError(f"{file} must hold a rotation (3, 3), translation (3,) and scale (3,) of "
                         "each bone; give the parameters.json of a registration.")  # fmt: skip
    return posture


def versions() -> dict[str, str]:
    """Of what computes."""
    return {"supple": supple.__version__, "python": platform.python_version(),
            **{name: version(name) for name in ("numpy", "scipy")}}  # fmt: skip


def _table(path: Path, outcome: Outcome) -> None:
    """One row a number."""
    m, size = outcome.metrics, body_size(outcome.registration)
    rows: list[tuple[Any, ...]] = [
        ("metric", "surface_mae", "", m.surface_mae_mm, None, "mm"),
        ("metric", "surface_p95", "", m.surface_p95_mm, None, "mm"),
        ("metric", "used_share", "", m.used_share, None, "1"),
        ("metric", "landmark_mae", "", m.landmark_mae_mm, None, "mm"),
        ("metric", "seconds", "", m.seconds, None, "s"),
        ("body", "chest_girth", "", size.girth_cm, None, "cm"),
        ("body", "notch_to_folds", "", size.length_cm, None, "cm"),
    ]
    rows += [("landmark_error", row.name, "", row.error_mm, None, "mm") for row in m.landmarks]
    rows += [("measure", row.name, row.side, row.value, row.sd, row.unit)
             for row in outcome.measures.rows]  # fmt: skip
    rows += [("measure", "ptosis_grade", side, grade, None, "Regnault")
             for side, grade in outcome.measures.ptosis.items()]  # fmt: skip
    with path.open("w", newline="", encoding="utf-8") as stream:
        table = csv.writer(stream)
        table.writerow(("table", "name", "side", "value", "sd", "unit"))
        for *names, value, sd, unit in rows:
            table.writerow((*names, _short(value), _short(sd), unit))


def _short(value: Any) -> str:
    if value is None:
        return ""
    return f"{value:.6g}" if isinstance(value, float) else str(value)


def _picture(path: Path, outcome: Outcome) -> None:
    from supple.registration.portrait import Portrait, draw_portrait
    from supple.registration.report import body_frame

    fit = outcome.registration
    doubt = "" if fit.trustworthy else "\n".join(("Not trustworthy:", *fit.warnings))
    marks = {name: carried.points[0] for name, carried in outcome.landmarks.items()}
    draw_portrait(path, Portrait(outcome.scan, fit.points, body_frame(fit), outcome.curves, marks,
                                 outcome.title, doubt))  # fmt: skip


def _report(outcome: Outcome) -> ReportData:
    from supple.registration.report import ReportData

    return ReportData(
        outcome.registration, outcome.scan, outcome.curves, outcome.landmarks, outcome.measures,
        outcome.metrics, outcome.title, outcome.said, tuple(outcome.given), versions(),
    )  # fmt: skip
