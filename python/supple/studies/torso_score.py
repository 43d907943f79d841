"""How far a registered torso is from the truth of a synthetic scan."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from ..registration.template import Floats, Ints, OnSurface, Template
from ..surface import Surface

if TYPE_CHECKING:
    from ..registration.registration import Registration
    from ..registration.synthetic import SyntheticScan

#: A fit has failed beyond these, mm.
SURFACE_BAR, LANDMARK_BAR = 5.0, 20.0


@dataclass(frozen=True)
class Score:
    """Errors of one registration, mm.

    Attributes:
        surface: mean distance of even samples of the true skin, also where the scan lacks it, to
            the registered skin; those that lie past its rim count in ``beyond`` instead.
        scan: the same of the scan's skin points without their noise.
        landmarks: name → distance.
        vertices: mean distance of corresponding vertices; NaN where another template was scanned.
        beyond: share of the true skin past the rim.
        covered: share of vertices (same template) or landmarks inside their 95 % band; NaN
            without a covariance.
    """

    surface: float
    scan: float
    landmarks: Mapping[str, float]
    vertices: float
    beyond: float
    covered: float

    @property
    def landmark(self) -> float:
        """Mean over the landmarks, mm."""
        return float(np.mean(list(self.landmarks.values())))

    @property
    def worst_landmark(self) -> tuple[str, float]:
        """Name and mm."""
        return max(self.landmarks.items(), key=lambda item: item[1])

    @property
    def failed(self) -> bool:
        """Surface off by more than 5 mm, or a landmark by more than 20 mm."""
        return not (self.surface <= SURFACE_BAR and self.worst_landmark[1] <= LANDMARK_BAR)


def score(found: Registration, scan: SyntheticScan, scanned: Template) -> Score:
    """``found`` held against the truth of ``scan``, which is of the template ``scanned``."""
    skin = Surface(found.points, found.triangles)
    true, past = distances(skin, scan.truth.points)
    seen, seen_past = distances(skin, scan.clean[scan.skin])
    landmarks = {
        name: 1e3 * float(np.linalg.norm(point - found.landmarks[name]))
        for name, point in scan.truth.landmarks.items() if name in found.landmarks
    }  # fmt: skip
    same = found.template is scanned
    off = np.linalg.norm(found.points - scan.truth.vertices, axis=1) if same else np.array(np.nan)
    return Score(
        1e3 * float(true[~past].mean()), 1e3 * float(seen[~seen_past].mean()), landmarks,
        1e3 * float(off.mean()), float(past.mean()), _covered(found, scan, off),
    )  # fmt: skip


def distances(skin: Surface, points: Floats) -> tuple[Floats, npt.NDArray[np.bool_]]:
    """Of ``points`` (k, 3) m to ``skin`` (k,) m, and which land on its rim, past its end."""
    hit = skin.closest(points)
    rim = rim_vertices(skin.triangles, len(skin.points))
    corners = rim[skin.triangles[hit.triangle]]
    return hit.distance, np.asarray((np.asarray(hit.barycentric) * ~corners).sum(axis=1) < 1e-9)


def rim_vertices(triangles: Ints, count: int) -> npt.NDArray[np.bool_]:
    """Which of ``count`` vertices lie at an edge of one triangle alone."""
    edges = np.sort(triangles[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)
    once, times = np.unique(edges, axis=0, return_counts=True)
    rim = np.zeros(count, dtype=bool)
    rim[once[times == 1].ravel()] = True
    return rim


def _covered(found: Registration, scan: SyntheticScan, off: Floats) -> float:
    """Share of vertices, or of landmarks where vertices do not correspond, inside their band."""
    from ..registration import uncertainty

    if found.covariance is None:
        return float("nan")
    given = found.template, found.posture, found.covariance
    if off.ndim:
        return float((off <= uncertainty.vertex_uncertainty(*given).radius95).mean())
    names = [name for name in found.template.landmarks if name in scan.truth.landmarks]
    bands = uncertainty.uncertainty_at(*given, _joined(found.template, names))
    apart = [found.landmarks[name] - scan.truth.landmarks[name] for name in names]
    return float((np.linalg.norm(apart, axis=1) <= bands.radius95).mean())


def _joined(template: Template, names: Sequence[str]) -> OnSurface:
    """Landmarks as one set of points."""
    parts = [template.landmarks[name] for name in names]
    return OnSurface(
        np.concatenate([part.triangle for part in parts]),
        np.concatenate([part.barycentric for part in parts]),
    )
