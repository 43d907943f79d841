"""Landmarks as the shape of a registered body tells them: skin slides on skin, corners do not.

    fit → its skin at rest → the rule of each landmark, near where the fit has it → on the scan

The rules are those that define the landmarks on templates (landmark_rules.py). At rest a body is a
whole, smooth mesh, whatever the pose of the scan. What a rule cannot tell it leaves out.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
import numpy.typing as npt

from supple.registration.landmark_rules import (
    fold_before,
    fold_of,
    joining,
    sagittal,
    turning,
    xiphoid_height,
)
from supple.registration.posture import Posture, attached, posed
from supple.registration.template import Floats, Ints, Template
from supple.surface import Surface

SIDES = (("left", 1.0), ("right", -1.0))
#: m along the midline from where the fit has it, within which the notch is sought; rad that the
#: profile turns there at least; and how much more than at any other corner there.
_NOTCH, _CORNER, _CLEAR = 0.07, 0.3, 1.2
#: m around the axilla on the template, in which the armpit's saddle is sought.
_ARMPIT = 0.09
#: m below the foremost skin, whose mean is the breast's tip.
_TIP = 2e-3


@dataclass(frozen=True)
class Told:
    """How a rule's place is used.

    Attributes:
        doubt: m, by which the rule differs from the landmark on bodies of one template: a
            difference up to this says nothing, and a larger one by so much less.
        sd: m, with which the landmark is held there.
    """

    doubt: float
    sd: float


#: By the name of the landmark without its side. Of 80 random bodies of each template, at rest.
TOLD = {
    "sternal_notch": Told(6e-3, 4e-3),
    "nipple": Told(7e-3, 4e-3),
    "breast_inferior": Told(12e-3, 6e-3),
    "xiphoid": Told(10e-3, 6e-3),
    "axilla": Told(12e-3, 6e-3),
}  # fmt: skip


def at_rest(template: Template, posture: Posture, offset: Floats | None = None) -> Floats:
    """Vertices (n, 3) m of a fitted body with its shapes and sizes, but no bone turned.

    Args:
        offset: (n, 3) m of the posed skin, turned back with it.
    """
    upright = np.tile(np.eye(3), (len(template.bones), 1, 1))
    skin = posed(template, attached(template, upright, posture.scales, posture.blend))
    if offset is None:
        return skin
    turns = np.tensordot(template.weights, posture.rotations, axes=1)
    return np.asarray(skin + np.einsum("nji,nj->ni", turns, offset))


def told(template: Template, skin: Floats) -> dict[str, Floats]:
    """Where the rules put landmarks, (3,) m, on ``skin`` (n, 3) m at rest; some may be missing."""
    at, found = template.landmark_points(skin), dict[str, Floats]()
    _put(found, "sternal_notch", _notch(template, skin))
    for side, sign in SIDES:
        _put(found, f"nipple_{side}", _tip(template, skin, side))
        nipple = found.get(f"nipple_{side}", at[f"nipple_{side}"])
        _put(found, f"breast_inferior_{side}",
             _fold(template, skin, nipple, float(at[f"breast_inferior_{side}"][0])))  # fmt: skip
        _put(found, f"axilla_{side}", _axilla(template, skin, side, sign))
    now = at | found
    _put(found, "xiphoid", _xiphoid(template, skin, now))
    return found


def evidence(
    template: Template, skin: Floats, points: Floats, seen: npt.NDArray[np.bool_],
    rules: Mapping[str, Told] = TOLD,
) -> tuple[dict[str, Floats], dict[str, float], float]:  # fmt: skip
    """Where the scan has the landmarks that slid, (3,) m, with standard deviations.

    Args:
        skin: (n, 3) m at rest.
        points: (n, 3) m, the same vertices on the scan.
        seen: (n,) which of them the scan shows.

    Returns:
        Places and standard deviations by name, and the furthest that one slid, m.
    """
    names, starts, places = _slid(template, skin, rules)
    if not names:
        return {}, {}, 0.0
    hit = Surface(skin, template.triangles).closest(places)
    corners = template.triangles[hit.triangle]
    shown = seen[corners].any(axis=1)
    on_scan = np.einsum("kc,kcd->kd", hit.barycentric, points[corners])
    kept = [i for i in range(len(names)) if shown[i]]
    apart = np.linalg.norm(places - starts, axis=1)
    return ({names[i]: on_scan[i] for i in kept},
            {names[i]: rules[kind(names[i])].sd for i in kept},
            float(apart[kept].max(initial=0.0)))  # fmt: skip


def kind(name: str) -> str:
    """Of a landmark, without its side."""
    return name.removesuffix("_left").removesuffix("_right")


def _slid(
    template: Template, skin: Floats, rules: Mapping[str, Told]
) -> tuple[list[str], Floats, Floats]:
    """Names, places (k, 3) m by the fit and by the rules less their doubt."""
    at, names = template.landmark_points(skin), []
    starts, places = [], []
    for name, place in told(template, skin).items():
        if kind(name) not in rules:
            continue
        step = place - at[name]
        doubt = rules[kind(name)].doubt / max(float(np.linalg.norm(step)), 1e-9)
        names.append(name)
        starts.append(at[name])
        places.append(at[name] + max(0.0, 1 - doubt**2) * step)
    return names, np.reshape(starts, (-1, 3)), np.reshape(places, (-1, 3))


def _put(found: dict[str, Floats], name: str, place: Floats | None) -> None:
    if place is not None and np.isfinite(place).all():
        found[name] = place


@lru_cache(maxsize=16)
def _front(template: Template) -> Ints:
    """Vertices of the front's midline, from below to the neck."""
    middle = np.flatnonzero(template.mirror == np.arange(len(template.points)))
    depth = template.points[middle, 1]
    front = middle[depth < np.median(depth)]
    return np.asarray(front[np.argsort(template.points[front, 2], kind="stable")])


def _notch(template: Template, skin: Floats) -> Floats | None:
    """Where the midline turns most from chest to neck, if one corner there is the clearest."""
    line, at = skin[_front(template)], template.landmark_points(skin)["sternal_notch"]
    if len(line) < 8:
        return None
    length, turn, curve = turning(line)
    middle = length[np.linalg.norm(curve - at, axis=1).argmin()]
    near = np.flatnonzero(np.abs(length - middle) < _NOTCH)
    near = near[np.isfinite(turn[near])]
    if len(near) < 3:
        return None
    inner = near[1:-1]
    peaks = inner[(turn[inner] >= turn[inner - 1]) & (turn[inner] > turn[inner + 1])]
    peaks = peaks[np.argsort(-turn[peaks])]
    if not len(peaks) or turn[peaks[0]] < _CORNER:
        return None
    if len(peaks) > 1 and turn[peaks[0]] < _CLEAR * turn[peaks[1]]:
        return np.asarray(curve[peaks[:2]].mean(axis=0))
    return np.asarray(curve[peaks[0]])


def _xiphoid(template: Template, skin: Floats, at: Mapping[str, Floats]) -> Floats:
    """On the midline, by the heights of notch and folds."""
    fold = (at["breast_inferior_left"][2] + at["breast_inferior_right"][2]) / 2
    height = xiphoid_height(float(at["sternal_notch"][2]), float(fold))
    line = skin[_front(template)]
    line = line[np.argsort(line[:, 2], kind="stable")]
    return np.array([np.interp(height, line[:, 2], line[:, k]) for k in range(3)])


def _tip(template: Template, skin: Floats, side: str) -> Floats | None:
    """What stands out most from the plane of the breast's outline."""
    outline = template.curves[f"breast_{side}"].at(skin, template.triangles)
    across = np.linalg.svd(outline - outline.mean(axis=0), full_matrices=False)[2][2]
    breast = skin[template.regions[f"breast_{side}"]]
    if not len(breast):
        return None
    height = breast @ (across * -np.sign(across[1]))
    near = np.linalg.norm(breast - breast[height.argmax()], axis=1) < 0.03
    weight = np.exp((height[near] - height.max()) / _TIP)
    return np.asarray(weight @ breast[near] / weight.sum())


def _fold(template: Template, skin: Floats, nipple: Floats, aside: float) -> Floats | None:
    """The crease below ``nipple`` in the sagittal section at x = ``aside`` m."""
    line = sagittal(skin, template.triangles, aside)
    below = nipple[2] - line[:, 2]
    if ((below > 0) & (below < 0.13)).sum() < 4:
        return None
    return fold_of(line, np.array([aside, nipple[1], nipple[2]]))


@lru_cache(maxsize=32)
def _armpit(template: Template, side: str) -> tuple[Ints, list[set[int]]]:
    """Vertices around an axilla of the template, and the neighbours of each vertex."""
    at = template.landmark_points()[f"axilla_{side}"]
    kept = np.flatnonzero(np.linalg.norm(template.points - at, axis=1) < _ARMPIT)
    near: list[set[int]] = [set() for _ in template.points]
    inside = np.isin(template.triangles, kept).all(axis=1)
    for a, b in template.triangles[inside][:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2).tolist():
        near[a].add(b)
        near[b].add(a)
    return kept, near


def _axilla(template: Template, skin: Floats, side: str, sign: float) -> Floats | None:
    """The edge of the front fold at the armpit's saddle."""
    kept, near = _armpit(template, side)
    apex = joining(skin[:, 2], kept, near)
    if apex < 0:
        return None
    line = sagittal(skin, template.triangles, float(skin[apex, 0]))
    line = line[np.linalg.norm(line - skin[apex], axis=1) < _ARMPIT]
    if not ((line[:, 2] > skin[apex, 2] - 0.02) & (line[:, 1] < skin[apex, 1])).any():
        return None
    return fold_before(line, skin[apex])
