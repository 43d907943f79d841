"""Registrations with a known answer: templates, poses, shapes and scans, one after the other.

templates → a random body → its scan → registered, cold → scored → its next frame, warm
"""

from __future__ import annotations

import time
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ..registration.posture import Posture, attached
from ..registration.synthetic import POSES, Pose, SyntheticScan, random_posture, synthetic_scan
from ..registration.synthetic_posture import turned
from ..registration.template import Template
from .torso_score import Score, score

if TYPE_CHECKING:
    from ..registration.registration import Registration

#: Scanned and fitted template. Those of two names are the harder: no fit can be exact.
PAIRS = (("procedural", "makehuman"), ("makehuman", "procedural"), ("makehuman", "makehuman"))
#: m, by the number of the shape.
NOISE = (1e-3, 2e-3, 3e-3)
#: m that a table flattens the back of a supine body.
_PRESSED = 0.012
#: rad and m between frames of a moving scan: of each bone, and of the whole.
_BONE, _TURN, _SHIFT = 0.01, 0.02, 5e-3
#: s until the BLAS' threads that made a scan no longer wait, busy, for more of the same.
_ASLEEP = 0.1


@dataclass(frozen=True)
class Case:
    """A scan of a random body of the template ``scanned``, to which ``fitted`` is registered."""

    scanned: str
    fitted: str
    pose: Pose
    shape: int
    noise: float  #: m

    @property
    def key(self) -> str:
        """Names it in a table."""
        return f"{self.scanned}→{self.fitted} {self.pose} {self.shape} {1e3 * self.noise:g} mm"


@dataclass(frozen=True)
class Outcome:
    """What came of a case: its score, seconds of wall and processor, and the fit's own doubts."""

    case: Case
    score: Score
    seconds: float
    cpu: float
    trustworthy: bool
    warnings: tuple[str, ...]
    warm: Score | None = None
    warm_seconds: float = float("nan")
    warm_cpu: float = float("nan")


def templates(data: Path | None = None) -> dict[str, Template]:
    """The shipped template, and with ``data`` MakeHuman's (its folder, or that above it)."""
    from ..registration.procedural import torso

    found = {"procedural": torso()}
    if data is not None:
        from ..registration.makehuman import torso as makehuman

        inner = data / "template_makehuman"
        found["makehuman"] = makehuman(inner if inner.is_dir() else data)
    return found


def plan(
    shapes: int, names: Mapping[str, Any], noise_free: bool = True, first: int = 0
) -> Iterator[Case]:
    """All shapes from the number ``first`` on, pairs of the templates that are there, and poses.

    Noise-free too where a template is fitted to itself. Without another template the procedural
    one is fitted to itself.
    """
    pairs = [pair for pair in PAIRS if all(name in names for name in pair)]
    for shape in range(first, first + shapes):
        for scanned, fitted in pairs or [("procedural", "procedural")]:
            for pose in POSES:
                yield Case(scanned, fitted, pose, shape, NOISE[shape % len(NOISE)])
                if noise_free and scanned == fitted:
                    yield Case(scanned, fitted, pose, shape, 0.0)


def scan_of(case: Case, known: Mapping[str, Template], **changes: Any) -> SyntheticScan:
    """The scan; a supine body is seen from the front and lies on a table."""
    template = known[case.scanned]
    return synthetic_scan(
        template, random_posture(template, case.pose, case.shape), _seed(case), **_view(case.pose),
        **({"noise": case.noise, "rotation": 0.0 if case.pose == "tilted" else 45.0} | changes),
    )  # fmt: skip


def next_frame(
    case: Case, known: Mapping[str, Template], scan: SyntheticScan, **changes: Any
) -> SyntheticScan:
    """Of the same body a moment later: each bone turned by 0.6°, all by 1° and 5 mm."""
    template, random = known[case.scanned], np.random.default_rng(_seed(case))
    before = random_posture(template, case.pose, case.shape)
    turns = np.array([turned(random, np.degrees(_BONE)) for _ in template.bones])
    after = attached(template, turns @ before.rotations, before.scales, before.blend)
    after = _as_far(after, before)
    turn, shift = turned(random, np.degrees(_TURN)), _SHIFT * turned(random, 90.0)[0]
    R, t = turn @ scan.truth.R, scan.truth.t + shift
    view: dict[str, Any] = {"view": "front"} if case.pose == "supine" else {}
    given: dict[str, Any] = {"noise": case.noise, "motion": (R, t)} | view | changes
    return synthetic_scan(template, after, _seed(case) + 1, **given)


def run(case: Case, known: Mapping[str, Template], warm: bool = False, **given: Any) -> Outcome:
    """Register, cold and then warm where asked, and score; ``given`` goes to `register`."""
    scan = scan_of(case, known)
    found, seconds, cpu = _timed(scan, known[case.fitted], **given)
    outcome = Outcome(case, score(found, scan, known[case.scanned]), seconds, cpu,
                      found.trustworthy, tuple(found.warnings))  # fmt: skip
    if not warm:
        return outcome
    frame = next_frame(case, known, scan)
    moved, seconds, cpu = _timed(frame, known[case.fitted], start=found.posture, **given)
    return Outcome(**(vars(outcome) | {"warm": score(moved, frame, known[case.scanned]),
                                       "warm_seconds": seconds, "warm_cpu": cpu}))  # fmt: skip


def _timed(
    scan: SyntheticScan, template: Template, **given: Any
) -> tuple[Registration, float, float]:
    """A registration, and its seconds of wall and processor."""
    from ..registration.register import register

    time.sleep(_ASLEEP)
    wall, cpu = time.perf_counter(), time.process_time()
    found = register(scan.surface, template, **given)
    return found, time.perf_counter() - wall, time.process_time() - cpu


def _view(pose: Pose) -> dict[str, Any]:
    return {"view": "front", "press": _PRESSED} if pose == "supine" else {}


def _seed(case: Case) -> int:
    return 10 * (4 * case.shape + POSES.index(case.pose)) + (case.scanned == "procedural") * 5


def _as_far(after: Posture, before: Posture) -> Posture:
    """With the root where it was: `attached` leaves it at rest."""
    shift = before.translations[0] - after.translations[0]
    return Posture(after.rotations, after.translations + shift, after.scales, after.blend)
