"""Registering a torso template to a scan, in any pose.

1. scan       thinned, with normals
2. start      given, from landmarks, or searched: all rotations, arms down or up
3. coarse     rigid, bones, scales
   facing     of those that face differently, the likeliest goes on
4. landmarks  where asked for: nipples found on the scan join those given
5. fine       all shapes, the robust threshold shrinking to the noise; arms that went elsewhere are
              set again, and landmarks that slid along the skin are pulled to where the body's own
              shape tells them to be
6. offset     what bones and shapes cannot reach, smoothly; beside it, how sure they are
7. slide      along itself, the skin to landmarks that were given, for what is left
8. judge      is the fit to be trusted, and if not, why
"""

from __future__ import annotations

import threading
from collections.abc import Callable, Mapping
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from weakref import WeakKeyDictionary

import numpy as np
import numpy.typing as npt

from supple.errors import ConvergenceError, InputError
from supple.registration import uncertainty
from supple.registration.advice import advised, too_little
from supple.registration.arm_search import settled_arms
from supple.registration.body_prior import body_prior, prior_seen
from supple.registration.found_landmarks import astray, found_landmarks, told_landmarks
from supple.registration.initial_pose import Candidate, candidates
from supple.registration.landmark_pose import posture_from_landmarks
from supple.registration.offset import Offset, offset
from supple.registration.posture import Posture
from supple.registration.register_settings import RegisterSettings
from supple.registration.registration import Registration
from supple.registration.rig import Priors, Rig, RigFit, Stage
from supple.registration.rivals import Rival, against, contenders, decided
from supple.registration.slide import slide
from supple.registration.stage_clock import StageClock
from supple.registration.template import Floats, Template
from supple.registration.trust import doubts, unlike
from supple.surface import Surface

__all__ = ["RegisterSettings", "register"]


def register(
    scan: Surface,
    template: Template | None = None,
    landmarks: Mapping[str, npt.ArrayLike] | None = None,
    settings: RegisterSettings | None = None,
    start: Posture | None = None,
    progress: Callable[[str], None] | None = None,
) -> Registration:
    """Fit ``template`` to ``scan``.

    Args:
        scan: m, in any frame; triangles, or a cloud of points. More than the torso does no harm.
        template: the shipped one by default.
        landmarks: name → (3,) m on the scan, good to ``settings.landmark_sd``; they pull, the skin
            slides to them, and three or more give the initial pose.
        start: a posture near the answer (the frame before): no search.
        progress: called with the name of each stage.

    Returns:
        The registration. Read ``trustworthy`` and ``warnings`` before using it.

    Raises:
        InputError: landmarks that the template does not name, a scan that is no body in metres.
        ConvergenceError: nothing of the template comes near the scan.
    """
    keep = settings or RegisterSettings()
    if template is None:
        from supple.registration.procedural import torso

        template = torso()
    try:
        found = _stages(scan, template, landmarks, keep, start, progress)
    except ConvergenceError as error:
        reason = too_little(scan, template, start is not None)
        raise ConvergenceError(reason, cause=str(error)) from None
    return advised(found, landmarks, keep.landmark_sd,
                   lambda: _stages(scan, template, None, keep, None, None))  # fmt: skip


def _stages(
    scan: Surface, template: Template, landmarks: Mapping[str, npt.ArrayLike] | None,
    keep: RegisterSettings, start: Posture | None, progress: Callable[[str], None] | None,
) -> Registration:  # fmt: skip
    clock = StageClock(progress)
    clock.stage("scan")
    _check(scan)
    named = {name: np.asarray(at, dtype=np.float64) for name, at in (landmarks or {}).items()}
    rig = rig_of(template)
    _set_scan(rig, scan, keep)
    ours = keep.priors is None
    keep = replace(keep, priors=keep.priors or body_prior(template))
    clock.stage("start")
    starts = _starts(rig, named, keep, start)
    clock.stage("coarse")
    tried = [] if start is not None else _coarse(rig, starts, named, keep)
    clock.stage("facing")
    rivals = _rivals(rig, tried, named, keep)
    clock.stage("landmarks")
    first = rivals[0].fit.posture if rivals else starts[0].posture
    if ours:
        keep = replace(keep, priors=prior_seen(rig, first))
    marks, sds = found_landmarks(scan, rig, first, named, keep) if tried else (
        named, dict.fromkeys(named, keep.landmark_sd))  # fmt: skip
    clock.stage("fine")
    stages = keep.fine if tried else keep.warm
    quick = keep if tried else replace(keep, told=0, arms=())
    fit = _fine(rig, scan, first, stages, marks, sds, quick)
    clock.stage("offset")
    with ThreadPoolExecutor(1) as aside:  # each is the work of one processor
        moving = aside.submit(_offset, rig, fit, keep)
        covariance = uncertainty.of_fit(fit, template)
        moved = moving.result()
    clock.stage("slide")
    points = fit.points + moved.vectors
    points += slide(template, fit.posture, points, moved.vectors, named, keep.landmark_sd)
    clock.stage("judge")
    held = set(template.landmarks) <= set(named)
    return _result(rig, scan, fit, moved, points, covariance, rivals, held, keep, clock)


class _Rigs(threading.local):
    """Those of a thread: a rig holds the scan that it is fitted to."""

    def __init__(self) -> None:
        self.of: WeakKeyDictionary[Template, Rig] = WeakKeyDictionary()


_RIGS = _Rigs()


def rig_of(template: Template) -> Rig:
    """The template in the core, made once a thread."""
    rigs = _RIGS.of
    if template not in rigs:
        rigs[template] = Rig(template)
    return rigs[template]


def _check(scan: Surface) -> None:
    size = scan.size
    if len(scan.points) < 200:
        raise InputError(f"scan must be 200 points or more, got {len(scan.points)}; "
                         "give the whole scan.")  # fmt: skip
    if not 0.1 <= size <= 4.0:
        raise InputError(f"scan must span 0.1 to 4 m, got {size:.4g} m; convert it to metres.")


def _set_scan(rig: Rig, scan: Surface, keep: RegisterSettings) -> None:
    """Thinned, and without the small pieces beside the body."""
    rig.set_scan(scan, voxel=keep.voxel, gap=1.9 * keep.voxel)


def _starts(
    rig: Rig, named: Mapping[str, Floats], keep: RegisterSettings, start: Posture | None
) -> list[Candidate]:
    if start is not None:
        return [Candidate(start, "given", 0.0)]
    if len(named) >= 3:
        found = posture_from_landmarks(rig.template, named)
        if found:
            return found
    cloud = rig.cloud
    return candidates(cloud.points, cloud.normals, rig.template, cloud.oriented, keep.search)


def _run(rig: Rig, start: Posture, stages: tuple[Stage, ...], named: Mapping[str, Floats],
         keep: RegisterSettings) -> RigFit:  # fmt: skip
    return rig.fit(start, stages, keep.weights, keep.priors, named, keep.landmark_sd, "lead")


def _fine(
    rig: Rig, scan: Surface, first: Posture, stages: tuple[Stage, ...], marks: Mapping[str, Floats],
    sds: Mapping[str, float], keep: RegisterSettings,
) -> RigFit:  # fmt: skip
    """All shapes; held loosely to the scan first, tightly once they turn out to follow it.

    A body that the template cannot become pulls its landmarks away if it is followed closely;
    the less it follows, the looser it is held.
    """
    priors = keep.priors or Priors()
    loose = replace(priors, noise=max(priors.noise, keep.unlike))
    if len(stages) > 1 and keep.unlike > 0:
        fit = rig.fit(first, stages[:-1], keep.weights, loose, marks, sds, "pairs")
        fit = _armed(rig, fit, stages[:-1], loose, marks, sds, keep)
        fit, marks, sds = _told(rig, scan, fit, stages[:-1], loose, marks, sds, keep)
        first, stages = fit.posture, stages[-1:]
        if fit.patch_sd > keep.follows:
            grade = min(1.0, 0.35 + fit.patch_sd / keep.follows - 1)
            priors = replace(priors, noise=max(priors.noise, grade * keep.unlike))
    return rig.fit(first, stages, keep.weights, priors, marks, sds)


def _armed(
    rig: Rig, fit: RigFit, stages: tuple[Stage, ...], loose: Priors, marks: Mapping[str, Floats],
    sds: Mapping[str, float], keep: RegisterSettings,
) -> RigFit:  # fmt: skip
    """``fit``, or one made anew with an arm elsewhere."""
    if not keep.arms:
        return fit
    first = settled_arms(
        fit, rig.template,
        lambda start: rig.fit(start, keep.arms, keep.weights, loose, marks, sds, "lead"),
    )  # fmt: skip
    if first is None:
        return fit
    return rig.fit(first, stages, keep.weights, loose, marks, sds, "pairs")


def _told(
    rig: Rig, scan: Surface, fit: RigFit, stages: tuple[Stage, ...], loose: Priors,
    given: Mapping[str, Floats], given_sds: Mapping[str, float], keep: RegisterSettings,
) -> tuple[RigFit, Mapping[str, Floats], Mapping[str, float]]:  # fmt: skip
    """The landmarks given, and those that the fit's own shape puts elsewhere.

    Where they slid far, ``fit`` is made again with them, and asked once more. On a body that the
    template can become nothing slides, and its own rest shape tells more than rules do. Skin leaves
    such a body by 0.25 to 0.40 of the noise, and another template's by 0.5 to 1: ``keep.like``.
    """
    marks, sds = dict(given), dict(given_sds)
    for left in reversed(range(keep.told)):
        moved = _offset(rig, fit, keep).vectors
        if unlike(fit, moved) < keep.like:
            break
        found, of_found, far = told_landmarks(
            scan, rig.template, fit.posture, moved, fit.points + moved, fit.vertex_used > 0, marks
        )
        marks, sds = found | dict(given), of_found | dict(given_sds)
        if not left or far < keep.slid:
            break
        fit = rig.fit(fit.posture, stages, keep.weights, loose, marks, sds, "pairs")
    return fit, marks, sds


def _coarse(rig: Rig, starts: list[Candidate], named: Mapping[str, Floats],
            keep: RegisterSettings) -> list[RigFit]:  # fmt: skip
    """Coarse fits of the starts that are nearly as good as the best, best first."""
    near = contenders(starts, rig.template, np.median(rig.cloud.points, axis=0), keep)
    if len(named) >= 3:
        near = starts[: keep.starts]
    fits = [_run(rig, one.posture, keep.coarse, named, keep) for one in near]
    return sorted(fits, key=against)


def _rivals(
    rig: Rig, tried: list[RigFit], named: Mapping[str, Floats], keep: RegisterSettings
) -> list[Rival]:
    """The best of each facing, fitted loosely with all shapes; the likeliest first."""
    priors = keep.priors or Priors()
    loose = replace(priors, noise=max(priors.noise, keep.unlike))
    return decided(
        tried, rig.template,
        lambda fit: rig.fit(
            fit.posture, keep.face, keep.weights, loose, named, keep.landmark_sd, "lead"),
        keep,
    )  # fmt: skip


def _offset(rig: Rig, fit: RigFit, keep: RegisterSettings) -> Offset:
    if keep.offset is None:
        return Offset(np.zeros_like(fit.points), None, 0.0)
    return offset(rig, fit, keep.offset)


def _result(
    rig: Rig, scan: Surface, fit: RigFit, moved: Offset, points: Floats, covariance: Floats,
    rivals: list[Rival], held: bool, keep: RegisterSettings, clock: StageClock,
) -> Registration:  # fmt: skip
    off = astray(scan, rig.template, fit.posture, points, keep.doubts.sure) if rivals else 0.0
    warnings = doubts(rig, fit, moved.vectors, rivals, covariance, keep.doubts, off, held)
    covariance = covariance * uncertainty.slid(0.0 if held else unlike(fit, moved.vectors))
    history = [
        value for one in [*(rival.fit for rival in rivals[:1]), fit] for value in one.history
    ]
    return Registration(
        rig.template, fit.posture, points, scan, points - fit.points,
        moved.precision, covariance, not warnings, warnings, clock.stop(), len(history), history,
        _reach(fit), fit,
    )  # fmt: skip


def _reach(fit: RigFit) -> float:
    """Distance, m, beyond which scan points are clutter."""
    return float(np.clip(6 * fit.residual_sd, 8e-3, 25e-3))
