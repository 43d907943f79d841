"""What registering a template to a scan found."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np
import numpy.typing as npt

from supple.core import core
from supple.registration.posture import Posture
from supple.registration.template import Floats, Ints, Template
from supple.surface import Surface


@dataclass(frozen=True, eq=False, repr=False)
class Registration:
    """A template in the place of a scan's body; in the scan's frame, m.

    What only some need (distances of all scan points, standard deviations of all vertices) is
    worked out when it is first asked for.

    Attributes:
        template, posture: ``posed(template, posture) + offset`` are the points.
        points: (n, 3) m, the registered skin's vertices.
        scan: that was registered.
        offset: (n, 3) m by which the skin leaves what bones and blendshapes can do, and by which it
            slid along itself to landmarks that were given.
        offset_precision: (n, n) sparse, 1/m², of its size along the normals; None without it.
        covariance: (9K+A, 9K+A) of the unknowns, in the order of `Posture.stepped`.
        trustworthy: no warning that makes the fit doubtful.
        warnings: one sentence each.
        seconds: of each stage and "total".
        iterations: of all stages.
        history: energy at the start of each iteration.
        reach: m; a scan point further from the skin than this is clutter.
        fit: of the core: pairs, matrices.
    """

    template: Template
    posture: Posture
    points: Floats
    scan: Surface
    offset: Floats
    offset_precision: Any
    covariance: Floats | None
    trustworthy: bool
    warnings: list[str]
    seconds: dict[str, float]
    iterations: int
    history: list[float]
    reach: float
    fit: Any = field(repr=False, default=None)

    @property
    def triangles(self) -> Ints:
        """(t, 3), the template's."""
        return self.template.triangles

    @property
    def skin(self) -> Surface:
        """The registered skin."""
        return Surface(self.points, self.template.triangles)

    @cached_property
    def _landing(self) -> Any:
        return self.skin.closest(self.scan.points)

    @property
    def distance(self) -> Floats:
        """(m,) m of each scan point to the registered skin, unsigned."""
        return np.asarray(self._landing.distance)

    @cached_property
    def used(self) -> npt.NDArray[np.bool_]:
        """(m,) which scan points are this body's skin: near it, and not past its rim."""
        hit, rim = self._landing, _rim(self.template.triangles, len(self.points))
        inside = np.asarray(hit.barycentric) * ~rim[self.template.triangles[hit.triangle]]
        return np.asarray((self.distance < self.reach) & (inside.sum(axis=1) > 1e-9))

    @cached_property
    def surface_mae_mm(self) -> float:
        """Mean distance of the used scan points to the registered skin, mm."""
        return 1e3 * float(self.distance[self.used].mean()) if self.used.any() else float("nan")

    @cached_property
    def sd(self) -> Floats:
        """(n,) m standard deviation of each vertex, root mean square over the axes."""
        from supple.registration.rig import Rig

        if self.covariance is None:
            return np.full(len(self.points), np.nan)
        of_posture = Rig(self.template).vertex_sd(self.posture, self.covariance)
        return np.asarray(np.hypot(of_posture, self._offset_sd))

    @property
    def _offset_sd(self) -> Floats:
        """(n,) m, over the three axes; of the displacement along the normal a third each."""
        if self.offset_precision is None:
            return np.zeros(len(self.points))
        precision = self.offset_precision.toarray()
        # not by NumPy: bits of a BLAS change with the number of its threads
        variance = np.diagonal(core().inverse_sum(precision, np.zeros_like(precision)))
        return np.asarray(np.sqrt(variance / 3))

    @property
    def landmarks(self) -> dict[str, Floats]:
        """Name → (3,) m."""
        return self.template.landmark_points(self.points)

    @property
    def curves(self) -> dict[str, Floats]:
        """Name → (k, 3) m."""
        return self.template.curve_points(self.points)

    def __repr__(self) -> str:
        return (f"Registration({self.template.name!r}, {len(self.scan.points)} scan points, "
                f"trustworthy={self.trustworthy})")  # fmt: skip


def _rim(triangles: Ints, count: int) -> npt.NDArray[np.bool_]:
    """Which of ``count`` vertices lie at an edge of one triangle alone."""
    edges = np.sort(triangles[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)
    once, times = np.unique(edges[:, 0] * count + edges[:, 1], return_counts=True)
    rim = np.zeros(count, dtype=bool)
    rim[np.concatenate(np.divmod(once[times == 1], count))] = True
    return rim
