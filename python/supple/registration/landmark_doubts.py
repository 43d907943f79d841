"""Which of the landmarks that were given contradict the rest of what the fit saw?

A landmark that is wrong draws the skin to itself, so that it seems to be less wrong than it is. How
far off it would be had it not been given follows from the fit's own matrices.
"""

from __future__ import annotations

from collections.abc import Mapping
from itertools import combinations
from typing import TYPE_CHECKING

import numpy as np

from supple.registration.template import Floats

if TYPE_CHECKING:
    from supple.registration.registration import Registration

#: A landmark is doubted that is so far, m, from where the scan and the others have it, and so many
#: times as far as those are on the median: bodies that the template cannot become are 25 mm off.
_FAR, _TIMES = 35e-3, 1.8
#: Exchanged, two landmarks must be so much nearer to where the scan has them.
_CROSSED = 0.4


def left_out(registration: Registration, given: Mapping[str, Floats], sd: float) -> Floats:
    """How far each landmark (k,) m is from where a fit without it would have it, linearised.

    r (k, 3), the residual of one of them, is (I - H) times what it is without it, with the leverage
    H = J N⁻¹ Jᵀ / sd² of its own three rows in the normal equations N.

    Args:
        given: name → (3,) m, to which it was fitted.
        sd: m, with which they pulled.

    Source: Cook and Weisberg (1982), Residuals and influence in regression, eq. 2.2.23.
    """
    fit = registration.fit
    marks = registration.template.landmark_points(fit.points)  # before the skin slid to them
    apart = np.array([at - marks[name] for name, at in given.items()])
    J = _moves(registration, list(given))
    leverage = J @ np.linalg.solve(fit.data_matrix + fit.prior_matrix, J.transpose(0, 2, 1)) / sd**2
    return np.asarray(np.linalg.norm(
        np.linalg.solve(np.eye(3) - leverage, apart[:, :, None])[..., 0], axis=1))  # fmt: skip


def _moves(registration: Registration, names: list[str]) -> Floats:
    """(k, 3, 9K+A): how landmarks move with the unknowns."""
    from supple.registration.register import rig_of

    template = registration.template
    whole = rig_of(template).jacobian(registration.posture)
    whole = whole.reshape(len(template.points), 3, -1)
    places = [template.landmarks[name] for name in names]
    return np.array([
        np.einsum("c,cdu->du", place.barycentric[0], whole[template.triangles[place.triangle[0]]])
        for place in places
    ])  # fmt: skip


def misplaced(registration: Registration, given: Mapping[str, Floats], sd: float) -> list[str]:
    """A sentence on the landmark that the scan and the others contradict, if one is; the worst."""
    if not given or registration.fit is None:
        return []
    off, names = left_out(registration, given, sd), list(given)
    worst = int(off.argmax())
    others = np.delete(off, worst)
    if off[worst] < max(_FAR, _TIMES * np.median(others) if len(others) else 0.0):
        return []
    return [
        f"Landmark {names[worst]} was given {off[worst] * 1e3:.0f} mm from where the scan and the "
        "other landmarks have it; check it, or leave it out."
    ]


def mistaken(marks: Mapping[str, Floats], given: Mapping[str, Floats]) -> list[str]:
    """A sentence on two landmarks that are each nearer to where the other belongs.

    Args:
        marks: name → (3,) m of a fit that did not see ``given``.
    """
    for a, b in combinations(given, 2):
        own = _apart(given[a], marks[a]) + _apart(given[b], marks[b])
        crossed = _apart(given[a], marks[b]) + _apart(given[b], marks[a])
        if own > 2 * _FAR and crossed < _CROSSED * own:
            return [f"It looks as if {a} and {b} are exchanged: they were given "
                    f"{own * 5e2:.0f} mm from where the scan alone has them, exchanged "
                    f"{crossed * 5e2:.0f} mm; correct the names."]  # fmt: skip
    return []


def _apart(a: Floats, b: Floats) -> float:
    return float(np.linalg.norm(a - b))
