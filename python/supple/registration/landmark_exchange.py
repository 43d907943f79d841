"""Are the names of two landmarks exchanged? By the triangles that landmarks of any body make.

The landmarks, and a point in front of their middle, against the template's in each pose of a
search, by the similarity that brings them closest: of bodies of two templates in four poses they
stay 7 to 31 mm (rms) apart, and two that are exchanged at least 1.2 times, mostly 2 to 12 times,
as far.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from supple.registration.pose_presets import shapes_of
from supple.registration.template import Floats, Template

#: Fewer landmarks with a front are a triangle that any exchange may only turn.
_LEAST = 3
#: Exchanged back, landmarks must be this much nearer a body's; and this far, m (rms), from it so.
_NEARER, _LIKE = 0.6, 35e-3


@dataclass(frozen=True)
class Exchange:
    """Two landmarks that fit a body better when they are exchanged."""

    names: tuple[str, str]  #: or "left" and "right", of all of them
    given: float  #: m, rms distance from a body's landmarks as they are named
    exchanged: float  #: m, with the two exchanged


def exchanged(
    landmarks: Mapping[str, Floats], front: Floats, template: Template
) -> Exchange | None:
    """The pair of names that must have been exchanged, if any.

    Args:
        landmarks: name → (3,) m, in any frame and pose.
        front: (3,) the way that the skin looks there, of any length; zero if it is not known.
    """
    names = [name for name in landmarks if name in template.landmarks]
    if len(names) < _LEAST or not np.linalg.norm(front) > 0:
        return None
    bodies = _bodies(template, names)
    at = np.array([landmarks[name] for name in names])
    given = _apart(bodies, _with_front(at, front))
    best = Exchange(("", ""), given, given)
    for i, j in combinations(range(len(names)), 2):
        order = np.arange(len(names))
        order[[i, j]] = j, i
        off = _apart(bodies, _with_front(at[order], front))
        if off < best.exchanged:
            best = Exchange((names[i], names[j]), given, off)
    off = _apart(_bodies(template, [_opposite(name) for name in names]), _with_front(at, front))
    if off < best.exchanged:
        best = Exchange(("left", "right"), given, off)
    return best if best.exchanged < min(_NEARER * given, _LIKE) else None


def _opposite(name: str) -> str:
    """The landmark's name on the other side."""
    for side, other in (("_left", "_right"), ("_right", "_left")):
        if name.endswith(side):
            return name.removesuffix(side) + other
    return name


def _bodies(template: Template, names: Sequence[str]) -> list[Floats]:
    """Landmarks of the template in each pose, with the point before them, (k + 1, 3) m."""
    found = []
    for points in shapes_of(template).points:
        marks = template.landmark_points(points)
        found.append(_with_front(np.array([marks[name] for name in names]), [0.0, -1.0, 0.0]))
    return found


def _with_front(points: Floats, front: Floats | Sequence[float]) -> Floats:
    """Points (k + 1, 3), the last before the middle of the others by their rms distance from it."""
    middle = points.mean(axis=0)
    size = np.sqrt(((points - middle) ** 2).sum(axis=1).mean())
    return np.vstack([points, middle + size * np.asarray(front) / np.linalg.norm(front)])


def _apart(bodies: Sequence[Floats], points: Floats) -> float:
    """Least rms distance, m, of ``points`` to those of a body, moved, turned and scaled."""
    return min(_similar(body, points) for body in bodies)


def _similar(source: Floats, target: Floats) -> float:
    """Umeyama (1991), IEEE TPAMI 13(4): the rms of target - (k R source + t)."""
    a, b = source - source.mean(axis=0), target - target.mean(axis=0)
    u, s, v = np.linalg.svd(b.T @ a)
    sign = np.array([1.0, 1.0, np.sign(np.linalg.det(u @ v))])
    size = float((s * sign).sum() / (a**2).sum())
    return float(np.sqrt(((b - size * a @ ((u * sign) @ v).T) ** 2).sum(axis=1).mean()))
