"""Do landmarks lie on the scan that they are said to be of?"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import numpy.typing as npt

from supple.errors import InputError
from supple.registration.landmark_exchange import exchanged
from supple.registration.landmark_files import Landmarks
from supple.registration.template import Template
from supple.surface import Surface

Floats = npt.NDArray[np.float64]

#: m: landmarks this near on the mean are on the scan; one farther than the second is said to be
#: off, and one farther than the third (more than a hole in the scan) is refused.
_ON, _OFF, _LOST = 6e-3, 20e-3, 60e-3
#: Other readings of the same numbers: what is said of each, a matrix, and a scale.
_FRAMES = (
    ("", np.eye(3)),
    ("in RAS, not LPS (x and y turned round)", np.diag([-1.0, -1.0, 1.0])),
    ("y-up with z to the front", np.array([[1.0, 0, 0], [0, 0, -1], [0, 1, 0]])),
)
_SCALES = (("", 1.0), ("in mm", 1e-3), ("in m", 1e3), ("in cm", 1e-2), ("100 times", 100.0),
           ("in dm", 0.1), ("10 times", 10.0))  # fmt: skip


def check_on_scan(
    landmarks: Mapping[str, npt.ArrayLike] | Landmarks, scan: Surface,
    template: Template | None = None,
) -> Landmarks:  # fmt: skip
    """The landmarks as they lie on the scan, with what was mended and said.

    Landmarks that are off the scan but on it as RAS, y-up, or in another unit are brought there.

    Args:
        landmarks: name → (3,) m, in the scan's frame; or what `read_landmarks` returned.
        scan: m, LPS.
        template: whose landmarks tell whether two names are exchanged; without it that is not
            looked at.

    Raises:
        InputError: a landmark more than 60 mm from the scan in every reading; left and right
            swapped (or a mirrored scan), which of the two only the user can know; two names
            exchanged.
    """
    given = landmarks.points if isinstance(landmarks, Landmarks) else landmarks
    said = list(landmarks.said) if isinstance(landmarks, Landmarks) else []
    if not given:
        return Landmarks({}, said)
    names = list(given)
    points = np.array([np.asarray(given[name], dtype=np.float64) for name in names])
    points, distance, mended = _best(points, scan)
    said += mended
    lost = [k for k in np.argsort(-distance) if distance[k] > _LOST]
    if lost:
        far = ", ".join(f"{names[k]} ({distance[k] * 1e3:.0f} mm)" for k in lost[:4])
        raise InputError(f"landmarks must lie on the scan, but {far} do not in LPS, RAS, mm or m; "
                         "check that they belong to this scan.")  # fmt: skip
    said += [f"Landmark {names[k]!r} is {distance[k] * 1e3:.0f} mm from the scan: over a hole, or "
             "misplaced." for k in np.flatnonzero(distance > _OFF)]  # fmt: skip
    placed = dict(zip(names, points, strict=True))
    _same_sides(placed, scan)
    if template is not None:
        _own_names(placed, scan, template)
    return Landmarks(placed, said)


def _best(points: Floats, scan: Surface) -> tuple[Floats, Floats, list[str]]:
    """The reading that lies nearest; another than the given only where it is far better."""
    from scipy.spatial import cKDTree

    tree = cKDTree(scan.points)
    distance = tree.query(points)[0]
    if distance.mean() <= _ON:
        return points, distance, []
    best = (points, distance, "")
    for frame, turn in _FRAMES:
        for unit, scale in _SCALES:
            moved = scale * points @ turn.T
            apart = tree.query(moved)[0]
            # A scale that shrinks all onto one point is no reading.
            wide = np.ptp(moved, axis=0).max() > 0.03 or len(points) == 1
            if wide and np.minimum(apart, 0.1).mean() < 0.5 * np.minimum(best[1], 0.1).mean():
                best = (moved, apart, " and ".join(w for w in (frame, unit) if w))
    if not best[2] or best[1].mean() > _OFF:
        return points, distance, []
    return (
        best[0],
        best[1],
        [
            f"The landmarks are {distance.mean() * 1e3:.0f} mm from the scan as given, and "
            f"{best[1].mean() * 1e3:.0f} mm when read {best[2]}: taken so."
        ],
    )


def _same_sides(points: dict[str, Floats], scan: Surface) -> None:
    """Left × up × front must be right-handed, however the body lies."""
    pairs = [(name, name[:-5] + "_right") for name in points if name.endswith("_left")]
    across = [points[a] - points[b] for a, b in pairs if b in points]
    if not across:
        return
    left, up = np.mean(across, axis=0), _up(points)
    side = np.cross(up, _front(np.array(list(points.values())), scan))
    turn, size = float(left @ side), float(np.linalg.norm(left) * np.linalg.norm(side))
    if turn < -0.5 * size:
        which = ", ".join(name[:-5] for name, other in pairs if other in points)
        raise InputError(f"left and right of {which} are swapped, or the scan is mirrored; "
                         "correct the names or the scan.")  # fmt: skip


def _own_names(points: dict[str, Floats], scan: Surface, template: Template) -> None:
    """Two landmarks that make a body only when exchanged are refused."""
    front = _front(np.array(list(points.values())), scan)
    found = exchanged(points, front, template)
    if found is not None and found.names == ("left", "right"):
        raise InputError("left and right of the landmarks are swapped, or the scan is mirrored; "
                         "correct the names or the scan.")  # fmt: skip
    if found is not None:
        a, b = found.names
        raise InputError(
            f"landmarks must be named by where they are, but it looks as if {a} and {b} are "
            f"exchanged: as given they are {found.given * 1e3:.0f} mm (rms) from those of a body, "
            f"exchanged {found.exchanged * 1e3:.0f} mm; correct the names."
        )


def _front(points: Floats, scan: Surface) -> Floats:
    """The way that the skin looks round the landmarks; of a cloud, away from its middle."""
    from scipy.spatial import cKDTree

    if not len(scan.triangles):
        away = np.asarray(points.mean(axis=0) - scan.points.mean(axis=0))
        return away if np.linalg.norm(away) > 0.02 else np.zeros(3)
    near = np.zeros(len(scan.points), dtype=bool)
    for ids in cKDTree(scan.points).query_ball_point(points, 0.03):
        near[ids] = True
    a, b, c = (scan.points[ids] for ids in scan.triangles[near[scan.triangles[:, 0]]].T)
    return np.asarray(np.cross(b - a, c - a).sum(axis=0))


def _up(points: dict[str, Floats]) -> Floats:
    """Towards the head, by landmarks of different height that come in twos or on the midline."""
    heights = ("sternal_notch", "axilla", "xiphoid", "nipple", "breast_inferior")
    level = []
    for place in heights:
        own = [p for name, p in points.items() if name.startswith(place)]
        if len(own) == (1 if place in ("sternal_notch", "xiphoid") else 2):
            level.append((place, np.mean(own, axis=0)))
    if len(level) > 1 and {level[0][0], level[-1][0]} != {"xiphoid", "nipple"}:
        return np.asarray(level[0][1] - level[-1][1])
    return np.array([0.0, 0.0, 1.0])
