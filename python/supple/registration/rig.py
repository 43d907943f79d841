"""The fit of a template to a scan by the C++ core: its settings, its loop, what it returns."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Literal

import numpy as np
import numpy.typing as npt

from supple.core import core
from supple.errors import ConvergenceError, InputError
from supple.registration.posture import Posture
from supple.registration.rig_settings import (
    COLD,
    WARM,
    Priors,
    Stage,
    priors_in_core,
    stage_in_core,
    weights_in_core,
)
from supple.registration.template import Template
from supple.registration.weights import Weights
from supple.surface import Surface

Floats = npt.NDArray[np.float64]
Ints = npt.NDArray[np.int64]
__all__ = ["COLD", "WARM", "Priors", "Rig", "RigFit", "Stage"]
Report = Literal["lead", "pairs", "whole"]
_REPORTS = ("lead", "pairs", "whole")
_TERMS = ("data", "scale", "blendshape", "joint", "landmark", "rotation")


@dataclass(frozen=True, eq=False)
class RigFit:
    """What a fit found.

    Attributes:
        posture: at the end.
        points: (n, 3) m, the template's vertices there.
        converged: the last stage ended because nothing moved further than its tolerance.
        last_step: m, largest movement of a vertex in the last iteration.
        iterations: of each stage.
        history: energy at the start of each iteration, for the pairs of that iteration.
        seconds: of each stage.
        energy: of each term at the end.
        data_matrix, prior_matrix: (9K+A, 9K+A); their sum is the inverse covariance if residuals
            of patches are independent with standard deviation ``Priors.noise``.
        patch_sd: m, robust standard deviation of the mean residual of a patch, as found.
        residual_sd: m, that of all residuals.
        observations: patches of the template that the scan shows.
        scan_points, scan_normals: (c, 3) of the thinned scan, of those points that were looked at.
        triangle: (c,) of the template where each of them lands; -1 where it has no partner.
        barycentric: (c, 3); distance (c,) m, NaN without partner.
        used: (c,) robust weight 0..1 of each; vertex_used (n,) of each vertex' pair.
    """

    posture: Posture
    points: Floats
    converged: bool
    last_step: float
    iterations: list[int]
    history: list[float]
    seconds: list[float]
    energy: dict[str, float]
    data_matrix: Floats
    prior_matrix: Floats
    patch_sd: float
    residual_sd: float
    observations: float
    scan_points: Floats
    scan_normals: Floats
    triangle: Ints
    barycentric: Floats
    distance: Floats
    used: Floats
    vertex_used: Floats
    noise: float = field(default=2e-3)

    def covariance(self, inflation: float = 1.0) -> Floats:
        """Of the unknowns (9K+A, 9K+A), in the order of `Posture.stepped`.

        (JᵀWJ/(f·inflation) + priors)⁻¹, where f = (patch_sd/noise)² corrects the variance that was
        assumed for a patch to the one that was found, if it is larger.
        """
        found = max(self.patch_sd / self.noise, 1.0) ** 2 * inflation
        return np.asarray(np.linalg.inv(self.data_matrix / found + self.prior_matrix))


class Rig:
    """A template in the core, ready to be posed and fitted many times.

    Args:
        template: its bones, weights and blendshapes.
        dual_quaternion: skinning by blended dual quaternions (Kavan et al. 2007) instead of linear
            blending; each vertex is scaled first, Σ w (S (x − j) + j), then moved rigidly.
    """

    def __init__(self, template: Template, dual_quaternion: bool = False) -> None:
        self.template = template
        shapes = np.ascontiguousarray(template.blendshapes).reshape(-1, 3 * len(template.points))
        self._rig = core().Rig(
            template.points, template.triangles.astype(np.int32), template.joints,
            template.parents.astype(np.int32), template.weights, shapes, dual_quaternion,
        )  # fmt: skip
        self._fit = core().RigFit(self._rig)

    def vertices(self, posture: Posture) -> Floats:
        """(n, 3) m."""
        return np.asarray(self._rig.vertices(*_arrays(posture)))

    def jacobian(self, posture: Posture) -> Floats:
        """(3n, 9K+A) of the vertices by the steps of `Posture.stepped`."""
        return np.asarray(self._rig.jacobian(*_arrays(posture)))

    def vertex_sd(
        self, posture: Posture, covariance: Floats, of: npt.NDArray[np.bool_] | None = None
    ) -> Floats:
        """(n,) m: √(trace of a vertex' covariance / 3), for that of the unknowns; or only ``of``.

        Args:
            of: (n,) which vertices; all by default.
        """
        count = len(self.template.points)
        asked = np.arange(count) if of is None else np.flatnonzero(of)
        return np.asarray(
            self._rig.vertex_sd(*_arrays(posture), covariance, asked.astype(np.int32))
        )

    def set_scan(
        self,
        scan: Surface,
        normals: npt.ArrayLike | None = None,
        voxel: float = 12e-3,
        thin: bool = True,
        gap: float = 0.0,
    ) -> None:
        """The scan of the fits to come.

        Args:
            scan: m; a cloud without triangles does too.
            normals: (m, 3) outward, of its points. Without them and without triangles they come
                from the points around, and their sign stays open.
            voxel: m; the points of a voxel become their mean.
            thin: False: every point is used as it is.
            gap: m; thinned points closer than this are of one piece, and pieces with less than
                4 % of them are left out; 0: all stay.
        """
        given = np.empty((0, 3)) if normals is None else np.asarray(normals, dtype=np.float64)
        self._fit.set_scan(scan.points, scan.triangles, given, voxel, thin, gap)

    @property
    def cloud(self) -> Any:
        """The thinned scan: ``points``, ``normals`` (c, 3); ``oriented``: their sign is known."""
        return self._fit.scan

    def fit(
        self,
        start: Posture,
        stages: Sequence[Stage] = COLD,
        weights: Weights | None = None,
        priors: Priors | None = None,
        landmarks: Mapping[str, npt.ArrayLike] | None = None,
        landmark_sd: float | Mapping[str, float] = 5e-3,
        report: Report = "whole",
    ) -> RigFit:
        """Fit to the scan from ``start``; other threads may run meanwhile, with rigs of their own.

        Args:
            landmarks: name → (3,) m on the scan.
            landmark_sd: m, of all or of each.
            report: how much it says, as the rest takes time: a "lead" to another fit has pairs
                only of the points that its last stage used, and neither their spread nor
                matrices, which stay empty (0, 0); "pairs": all but the matrices; the "whole".

        Raises:
            InputError: no scan, a landmark that the template does not name.
            ConvergenceError: no pairs within reach: the start is too far away.
        """
        chosen, named = priors or Priors(), landmarks or {}
        try:
            found = self._fit.run(
                *_arrays(start), weights_in_core(weights or Weights()),
                priors_in_core(chosen, self.template), [stage_in_core(stage) for stage in stages],
                *self._landmarks(named, landmark_sd), _REPORTS.index(report),
            )  # fmt: skip
        except core().Error as error:
            kind = ConvergenceError if "pairs" in str(error) else InputError
            raise kind(str(error)) from None
        return self._result(found, chosen)

    def land(self, posture: Posture, points: npt.ArrayLike) -> tuple[Ints, Floats, Floats]:
        """Where points (m, 3) m land: triangle (m,), barycentric (m, 3), distance (m,) m."""
        asked = np.ascontiguousarray(points, dtype=np.float64)
        triangle, barycentric, distance = self._fit.land(*_arrays(posture), asked)
        return triangle.astype(np.int64), barycentric, distance

    def offset(self, skin: npt.ArrayLike, **settings: float) -> Any:
        """What the scan is off ``skin`` (n, 3) m, smoothly along its normals.

        Returns:
            ``height`` (n,) m, ``along`` (n, 3) unit; ``start``, ``row``, ``values`` of the
            precision, 1/m², by columns.
        """
        chosen = core().RigOffsetSettings()
        for name, value in settings.items():
            setattr(chosen, name, value)
        return self._fit.offset(np.ascontiguousarray(skin, dtype=np.float64), chosen)

    def _landmarks(
        self, named: Mapping[str, npt.ArrayLike], sd: float | Mapping[str, float]
    ) -> tuple[Any, ...]:
        known = self.template.landmarks
        for name in named:
            if name not in known:
                raise InputError(f"landmark {name!r} must be one of {', '.join(known)}.")
        triangle = [known[name].triangle[0] for name in named]
        barycentric = [known[name].barycentric[0] for name in named]
        sds = [sd[name] if isinstance(sd, Mapping) else sd for name in named]
        return (
            np.array(triangle, dtype=np.int32),
            np.array(barycentric, dtype=float).reshape(-1, 3),
            np.array([np.asarray(at, dtype=float) for at in named.values()]).reshape(-1, 3),
            np.array(sds, dtype=float),
        )

    def _result(self, found: Any, priors: Priors) -> RigFit:
        energy = {name: getattr(found.terms, name) for name in _TERMS}
        scan, asked = self._fit.scan, slice(None, None, found.every_point)
        return RigFit(
            Posture(*found.posture), found.points, found.converged, found.last_step,
            found.iterations, found.history, found.stage_seconds, energy,
            found.data_matrix, found.prior_matrix, found.patch_sd, found.residual_sd,
            found.observations, scan.points[asked], scan.normals[asked],
            found.triangle[asked].astype(np.int64), found.barycentric[asked],
            found.distance[asked], found.used[asked], found.vertex_used, priors.noise,
        )  # fmt: skip


def _arrays(posture: Posture) -> tuple[Floats, Floats, Floats, Floats]:
    return posture.rotations, posture.translations, posture.scales, posture.blend
