"""What the errors of a registered torso depend on: the thesis' figures 9 to 13, redone.

    cases → sweeps: landmarks given, blendshapes kept, each weight of the energy → rows → figures

Each case is a synthetic scan of one template to which another is registered (the same one where
no other is at hand), standing and supine as in the thesis. Every level of a sweep sees the same
scans.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, fields, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ..registration.synthetic import SyntheticScan
from ..registration.template import LANDMARKS, Template
from ..registration.weights import Weights
from . import torso_cases, torso_figure
from .output import table
from .torso_cases import Case
from .torso_score import score

if TYPE_CHECKING:
    from ..registration.registration import Registration

Row = dict[str, Any]
Fit = Callable[[Case, SyntheticScan], "Registration"]

#: Landmarks in the order in which they are given: those that fix the pose first.
ORDER = (
    "sternal_notch", "nipple_left", "nipple_right", "xiphoid", "axilla_left", "axilla_right",
    *(name for name in LANDMARKS if name.startswith("breast_")),
)  # fmt: skip
#: Numbers of landmarks and blendshapes (all that there are beyond the last), factors of weights.
COUNTS = (0, 3, 4, 6, 8, 10, 12)
SHAPES = (0, 2, 5, 10, 20, 40, 55, 80)
FACTORS = (1e-2, 1e-1, 1.0, 1e1, 1e2)
#: The first body's number. 0 to 99 judge the fit, 1000 and on set it: a study draws neither.
FIRST = 2001
#: Of the thesis' study and its figures.
SWEEPS = {"landmarks": "Landmarks given", "blendshapes": "Blendshapes"} | {
    field.name: f"Factor of λ {field.name}" for field in fields(Weights)
}


@dataclass(frozen=True)
class Level:
    """One place on a sweep: what it is at, and how to register there."""

    sweep: str
    at: float
    fit: Fit


def run(
    folder: Path, samples: int = 3, data: Path | None = None,
    progress: Callable[[str, float], None] | None = None,
) -> list[Path]:  # fmt: skip
    """Redo the figures on ``samples`` bodies a pose; returns the files written to ``folder``.

    Args:
        data: folder of `template_makehuman`; without it the shipped template is fitted to scans
            of itself.
    """
    known = torso_cases.templates(data)
    found = rows(cases(samples, known), known, progress)
    folder.mkdir(parents=True, exist_ok=True)
    written = []
    for name, part in (("landmarks", ["landmarks"]), ("blendshapes", ["blendshapes"]),
                       ("weights", [field.name for field in fields(Weights)])):  # fmt: skip
        own = [row for row in found if row["sweep"] in part]
        (path := folder / f"torso_{name}.csv").write_text(table(own), encoding="utf-8")
        written += [path, *(torso_figure.draw(own, folder / f"torso_{name}.{suffix}")
                            for suffix in ("svg", "png"))]  # fmt: skip
    return written


def cases(samples: int, known: Mapping[str, Template]) -> list[Case]:
    """Standing and supine bodies, across templates where there are two."""
    planned = torso_cases.plan(samples, known, noise_free=False, first=FIRST)
    across = len(known) > 1
    return [case for case in planned if case.pose in ("standing", "supine")
            and (case.scanned != case.fitted or not across)]  # fmt: skip


def rows(
    cases: Sequence[Case], known: Mapping[str, Template],
    progress: Callable[[str, float], None] | None = None,
) -> list[Row]:  # fmt: skip
    """A row each case and level."""
    found: list[Row] = []
    for number, case in enumerate(cases):
        scan = torso_cases.scan_of(case, known)
        places = list(levels(known[case.fitted]))
        for done, level in enumerate(places):
            if progress is not None:
                progress(f"{case.key}, {level.sweep} {level.at:g}",
                         (number + done / len(places)) / len(cases))  # fmt: skip
            found.append(row(case, scan, known, level))
    return found


def levels(template: Template) -> Iterator[Level]:
    """Every place on every sweep."""
    from ..registration.register import RegisterSettings, register

    def given(count: int) -> Fit:
        return lambda case, scan: register(
            scan.surface, template, {name: scan.truth.landmarks[name] for name in ORDER[:count]}
        )

    def with_shapes(count: int) -> Fit:
        fewer = first_shapes(template, count)
        return lambda case, scan: register(scan.surface, fewer)

    def weighted(name: str, factor: float) -> Fit:
        settings = RegisterSettings()
        weights = replace(settings.weights, **{name: factor * getattr(settings.weights, name)})
        changed = replace(settings, weights=weights)
        landmarks = name == "landmark"
        return lambda case, scan: register(
            scan.surface, template, dict(scan.truth.landmarks) if landmarks else None, changed
        )

    for count in COUNTS:
        yield Level("landmarks", count, given(count))
    for count in (*(n for n in SHAPES if n < len(template.blendshapes)), len(template.blendshapes)):
        yield Level("blendshapes", count, with_shapes(count))
    for field in fields(Weights):
        for factor in FACTORS:
            yield Level(field.name, factor, weighted(field.name, factor))


def first_shapes(template: Template, count: int) -> Template:
    """With the ``count`` blendshapes alone that move the skin most at the edge of their bounds."""
    reach = np.abs(template.blendshape_bounds).max(axis=1)
    moves = np.linalg.norm(template.blendshapes, axis=(1, 2)) * np.minimum(reach, 1.0)
    kept = np.sort(np.argsort(-moves, kind="stable")[:count])
    return replace(
        template, blendshapes=template.blendshapes[kept],
        blendshape_names=tuple(template.blendshape_names[i] for i in kept),
        blendshape_bounds=template.blendshape_bounds[kept],
    )  # fmt: skip


def row(case: Case, scan: SyntheticScan, known: Mapping[str, Template], level: Level) -> Row:
    """One registration and its errors, mm."""
    found = level.fit(case, scan)
    result = score(found, scan, known[case.scanned])
    return {
        "sweep": level.sweep, "at": level.at, "pair": f"{case.scanned}→{case.fitted}",
        "pose": case.pose, "shape": case.shape, "noise_mm": 1e3 * case.noise,
        "surface_mm": result.surface, "landmark_mm": result.landmark,
        "worst_landmark_mm": result.worst_landmark[1], "failed": result.failed,
        "trustworthy": found.trustworthy, "seconds": found.seconds["total"],
    }  # fmt: skip
