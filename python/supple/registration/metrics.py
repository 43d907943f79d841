"""How good a registration is: the figures of the thesis' Table 2, and a row for each landmark."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from supple.errors import InputError

if TYPE_CHECKING:
    from supple.registration.registration import Registration


@dataclass(frozen=True)
class LandmarkError:
    """A landmark that was given, and where the registered template has it."""

    name: str
    error_mm: float
    given_mm: tuple[float, float, float]  #: LPS
    found_mm: tuple[float, float, float]  #: LPS


@dataclass(frozen=True)
class Metrics:
    """Mazier 2022, Table 2: errors in mm, seconds.

    Attributes:
        surface_mae_mm: mean distance of the scan's points that were used to the registered skin.
        surface_p95_mm: 95 % of them are closer.
        used_share: of the scan's points.
        landmark_mae_mm: mean distance of the landmarks given; None where none were.
        landmarks: a row of each, in the order given.
        seconds: of the registration.
        iterations: of the solver.
    """

    surface_mae_mm: float
    surface_p95_mm: float
    used_share: float
    landmark_mae_mm: float | None
    landmarks: tuple[LandmarkError, ...]
    seconds: float
    iterations: int


def metrics(
    registration: Registration, landmarks: Mapping[str, npt.ArrayLike] | None = None
) -> Metrics:
    """The figures of a registration.

    Args:
        landmarks: name → (3,) m, LPS, as picked on the scan; those may be ones it was fitted to.

    Raises:
        InputError: a name that the template does not have.
    """
    r = registration
    rows = tuple(_row(r, name, point) for name, point in (landmarks or {}).items())
    distance = np.abs(r.distance[r.used])
    p95 = 1e3 * float(np.percentile(distance, 95)) if len(distance) else float("nan")
    mean = float(np.mean([row.error_mm for row in rows])) if rows else None
    return Metrics(r.surface_mae_mm, p95, float(np.mean(r.used)), mean, rows,
                   float(sum(v for k, v in r.seconds.items() if k != "total"))
                   if "total" not in r.seconds else float(r.seconds["total"]),
                   int(r.iterations))  # fmt: skip


def _row(registration: Registration, name: str, point: npt.ArrayLike) -> LandmarkError:
    if name not in registration.landmarks:
        known = ", ".join(sorted(registration.landmarks))
        raise InputError(f"landmarks must be named as the template's ({known}), got {name!r}.")
    given, found = 1e3 * np.asarray(point, float), 1e3 * registration.landmarks[name]
    error = float(np.linalg.norm(given - found))
    return LandmarkError(name, error, tuple(given.tolist()), tuple(found.tolist()))
