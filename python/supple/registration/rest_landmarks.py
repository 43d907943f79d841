"""Landmarks as the shape of a registered body tells them: skin slides on skin, corners do not.

    fit → its skin at rest → the rule of each landmark, near where the fit has it → on the scan

The rules are those that define the landmarks on templates (landmark_rules.py). At rest a body is a
whole, smooth mesh, whatever the pose of the scan. What a rule cannot tell it leaves out.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
import numpy.typing as npt

from supple.registration.landmark_rules import (
    fold_of,
    sagittal,
    turning,
    xiphoid_height,
)
from supple.registration.posture import Posture, attached, posed
from supple.registration.template import Floats, Ints, Template
from supple.surface import Surface

#: m along the midline from where the fit has it, within which the notch is sought; rad that the
#: profile turns there at least; and how much more than at any other corner there.
_NOTCH, _CORNER, _CLEAR = 0.07, 0.3, 1.2
#: m; a rule that is further off than this has found something else.
_FAR = 0.07
#: m, by which the mirror image of a nipple at rest differs from the other (5 mm on random bodies).
_ALIKE, _IMAGE = 6e-3, np.array([-1.0, 1.0, 1.0])
_NONE = np.zeros(3), 0.0
#: m, by which steps of the two sides may differ and still tell of the same slide.
_PAIRED = 12e-3
#: m below the foremost skin, whose mean is the breast's tip.
_TIP = 2e-3
#: m (rms) over which a tip may spread: that of a flatter breast is anywhere, as noise has it.
_FLAT = 11e-3
#: m around a place, where the skin next to it is sought: more than the longest edge of a template.
_PATCH = 40e-3


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


#: By the name of the landmark without its side; doubts from 60 random bodies of each template at
#: rest: 9 in 10 of a rule's places stay within it.
TOLD = {
    "sternal_notch": Told(7.5e-3, 2e-3),
    "nipple": Told(10e-3, 2.5e-3),
    "breast_inferior": Told(15e-3, 3e-3),
    "xiphoid": Told(16e-3, 3e-3),
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
    for side in ("left", "right"):
        _put(found, f"nipple_{side}", _tip(template, skin, side))
        nipple = found.get(f"nipple_{side}", at[f"nipple_{side}"])
        _put(found, f"breast_inferior_{side}",
             _fold(template, skin, nipple, at[f"breast_inferior_{side}"]))  # fmt: skip
    now = at | found
    _put(found, "xiphoid", _xiphoid(template, skin, now))
    return found


@dataclass(frozen=True, eq=False, repr=False)
class Evidence:
    """Where landmarks are to be, one a name.

    Attributes:
        names: (k) of them.
        places: (k, 3) m, on the scan.
        sds: (k) m.
    """

    names: list[str]
    places: Floats
    sds: list[float]


def evidence(
    template: Template, skin: Floats, points: Floats, seen: npt.NDArray[np.bool_],
    slid: Collection[str] = (),
) -> Evidence:  # fmt: skip
    """Where the scan has the landmarks that slid.

    A nipple that the scan does not show is the mirror image of one that it shows.

    Args:
        skin: (n, 3) m at rest.
        points: (n, 3) m, the same vertices on the scan.
        seen: (n,) which of them the scan shows.
        slid: names of landmarks that are known to have slid: they would slide back.
    """
    wanted = _wanted(template, skin, seen, slid)
    if not wanted:
        return Evidence([], np.empty((0, 3)), [])
    corners, shares = _landing(template, skin, np.array([one[0] for one in wanted.values()]))
    places = np.einsum("kc,kcd->kd", shares, points[corners])
    near = np.asarray(grown(template, grown(template, seen))[corners].any(axis=1))
    names = [name for name, on in zip(wanted, near, strict=True)
             if on or not wanted[name][2]]  # fmt: skip
    number = {name: i for i, name in enumerate(wanted)}
    return Evidence(
        names, places[[number[name] for name in names]], [wanted[name][1] for name in names]
    )


def _landing(template: Template, skin: Floats, places: Floats) -> tuple[Ints, Floats]:
    """Vertices (k, 3) and barycentric (k, 3) of where ``places`` (k, 3) m land on ``skin``.

    Only the triangles around them are asked, unless there are none.
    """
    apart = ((skin[:, None] - places) ** 2).sum(axis=2)
    around = (apart < np.maximum(_PATCH**2, 4 * apart.min(axis=0))).any(axis=1)
    part = template.triangles[around[template.triangles].any(axis=1)]
    hit = Surface(skin, part).closest(places)
    return np.asarray(part[hit.triangle]), np.asarray(hit.barycentric)


def _wanted(
    template: Template, skin: Floats, seen: npt.NDArray[np.bool_], slid: Collection[str]
) -> dict[str, tuple[Floats, float, bool]]:
    """Place (3,) m at rest, its sd (m), and whether it holds only if the scan shows that skin."""
    at, steps = template.landmark_points(skin), _steps(template, skin, slid)
    shown = {name: _shown(template, name, seen) for name in at}
    wanted = {}
    for name in at:
        other = _opposite(name)
        if kind(name) == "nipple" and not shown[name]:
            if shown[other]:
                wanted[name] = (at[other] + steps.get(other, _NONE)[0]) * _IMAGE, _ALIKE, False
        elif name in steps:
            step, sd = steps[name]
            wanted[name] = at[name] + step, sd, True
    return wanted


def kind(name: str) -> str:
    """Of a landmark, without its side."""
    return name.removesuffix("_left").removesuffix("_right")


def _steps(
    template: Template, skin: Floats, slid: Collection[str]
) -> dict[str, tuple[Floats, float]]:
    """From where the fit has landmarks to where the rules have them, (3,) m, and its sd, m.

    What is within a rule's doubt says nothing: it would hold a landmark where the fit has it.
    Nor do two sides that contradict each other: skin slides on both alike.
    """
    at, steps = template.landmark_points(skin), {}
    apart = {name: place - at[name] for name, place in told(template, skin).items()}
    for name, step in apart.items():
        other = apart.get(_opposite(name))
        if _opposite(name) != name and other is not None and not alike(step, other):
            continue
        rule = TOLD[kind(name)]
        size = max(float(np.linalg.norm(step)), 1e-9)
        sure = 1.0 if name in slid else 1 - (rule.doubt / size) ** 4
        if sure > 0 and size < _FAR:
            steps[name] = sure * step, rule.sd / sure
    return steps


def alike(left: Floats, right: Floats) -> bool:
    """Whether steps (3,) m of two sides, in the body's frame, are nearly each other's image."""
    return float(np.linalg.norm(left - right * _IMAGE)) < _PAIRED


def _shown(template: Template, name: str, seen: npt.NDArray[np.bool_]) -> bool:
    return bool(seen[template.triangles[template.landmarks[name].triangle[0]]].any())


def grown(template: Template, seen: npt.NDArray[np.bool_]) -> npt.NDArray[np.bool_]:
    """Vertices (n,) that share a triangle with one that is ``seen``."""
    grown = np.zeros_like(seen)
    grown[template.triangles[seen[template.triangles].any(axis=1)]] = True
    return grown


def _opposite(name: str) -> str:
    """The landmark of the other side."""
    for side, other in (("_left", "_right"), ("_right", "_left")):
        if name.endswith(side):
            return name.removesuffix(side) + other
    return name


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
    """What stands out most from the plane of the breast's outline, if that is one place."""
    outline = template.curves[f"breast_{side}"].at(skin, template.triangles)
    across = np.linalg.svd(outline - outline.mean(axis=0), full_matrices=False)[2][2]
    breast = skin[template.regions[f"breast_{side}"]]
    if not len(breast):
        return None
    height = breast @ (across * -np.sign(across[1]))
    near = np.linalg.norm(breast - breast[height.argmax()], axis=1) < 0.03
    weight = np.exp((height[near] - height.max()) / _TIP)
    top = weight @ breast[near] / weight.sum()
    wide = np.sqrt(weight @ ((breast[near] - top) ** 2).sum(axis=1) / weight.sum())
    return np.asarray(top) if wide < _FLAT else None


def _fold(template: Template, skin: Floats, nipple: Floats, fit: Floats) -> Floats | None:
    """The crease half-way across from below the ``nipple`` to where the ``fit`` has it.

    Folds are below their nipples within a cm, and the fit knows where across as well.
    """
    aside = (float(nipple[0]) + float(fit[0])) / 2
    line = sagittal(skin, template.triangles, aside)
    below = nipple[2] - line[:, 2]
    if ((below > 0) & (below < 0.13)).sum() < 4:
        return None
    return fold_of(line, np.array([aside, nipple[1], nipple[2]]))
