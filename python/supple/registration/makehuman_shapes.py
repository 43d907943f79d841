"""Blendshapes of the torso from MakeHuman's targets."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

Floats = npt.NDArray[np.float64]
Ints = npt.NDArray[np.int64]
Read = Callable[[str], Floats]
Line = tuple[Floats, tuple[float, float]]  #: displacements (n, 3) m, bounds

_CUP = "breast/female-young-averagemuscle-averageweight-{}cup-{}firmness"
_MACRO = "macrodetails/universal-female-young-{}muscle-{}weight"
_ARM = "armslegs/{}-upperarm-{}"

#: Of each breast: name → the target of its positive end, and of its negative end if it has one.
BREAST: dict[str, tuple[str, ...]] = {
    "cup": (_CUP.format("max", "average"), _CUP.format("min", "average")),
    "firmness": (_CUP.format("average", "max"), _CUP.format("average", "min")),
    "full_firm": (_CUP.format("max", "max"),),
    "full_soft": (_CUP.format("max", "min"),),
    "small_firm": (_CUP.format("min", "max"),),
    "small_soft": (_CUP.format("min", "min"),),
    "height": ("breast/breast-trans-up", "breast/breast-trans-down"),
    "distance": ("breast/breast-dist-incr", "breast/breast-dist-decr"),
    "point": ("breast/breast-point-incr", "breast/breast-point-decr"),
    "volume_vertical": ("breast/breast-volume-vert-up", "breast/breast-volume-vert-down"),
    "nipple_size": ("breast/nipple-size-incr", "breast/nipple-size-decr"),
    "nipple_point": ("breast/nipple-point-incr", "breast/nipple-point-decr"),
    "heavy_full": ("breast/female-young-averagemuscle-maxweight-maxcup-averagefirmness",),
    "heavy_soft": ("breast/female-young-averagemuscle-maxweight-averagecup-minfirmness",),
    "slim_full": ("breast/female-young-averagemuscle-minweight-maxcup-averagefirmness",),
    "strong_full": ("breast/female-young-maxmuscle-averageweight-maxcup-averagefirmness",),
    "old_full": ("breast/female-old-averagemuscle-averageweight-maxcup-averagefirmness",),
    "old_soft": ("breast/female-old-averagemuscle-averageweight-averagecup-minfirmness",),
}
#: Of the whole body.
BODY: dict[str, tuple[str, ...]] = {
    "weight": (_MACRO.format("average", "max"), _MACRO.format("average", "min")),
    "muscle": (_MACRO.format("max", "average"), _MACRO.format("min", "average")),
    "strong_heavy": (_MACRO.format("max", "max"),),
    "weak_slim": (_MACRO.format("min", "min"),),
    **{f"figure_{name.replace('-', '_')}": (f"bodyshapes/bodyshapes-elvs-fem-{name}",)
       for name in ("adrenal", "apple", "diamond", "full-hourglass", "invert-triangle",
                    "lean-column", "liver", "neat-hourglass", "ovary", "rectangle", "thyroid",
                    "triangle")},
}  # fmt: skip
#: Of the torso.
TORSO: dict[str, tuple[str, ...]] = {
    **{f"torso_{name.replace('-', '_')}": (f"torso/torso-{name}-incr", f"torso/torso-{name}-decr")
       for name in ("scale-depth", "scale-horiz", "scale-vert", "vshape", "muscle-pectoral",
                    "muscle-dorsi")},
    "belly_tone": ("stomach/stomach-tone-incr", "stomach/stomach-tone-decr"),
    "belly_pregnant": ("stomach/stomach-pregnant-incr", "stomach/stomach-pregnant-decr"),
    "navel_depth": ("stomach/stomach-navel-out", "stomach/stomach-navel-in"),
    "navel_height": ("stomach/stomach-navel-up", "stomach/stomach-navel-down"),
    **{f"hips_{name}": (f"hip/hip-scale-{name}-incr", f"hip/hip-scale-{name}-decr")
       for name in ("depth", "horiz", "vert")},
    "hips_height": ("hip/hip-trans-up", "hip/hip-trans-down"),
    "waist_height": ("hip/hip-waist-up", "hip/hip-waist-down"),
    "pelvis_tone": ("pelvis/pelvis-tone-incr", "pelvis/pelvis-tone-decr"),
    "neck_depth": ("neck/neck-scale-depth-incr", "neck/neck-scale-depth-decr"),
    "neck_width": ("neck/neck-scale-horiz-incr", "neck/neck-scale-horiz-decr"),
    "neck_length": ("neck/neck-scale-vert-incr", "neck/neck-scale-vert-decr"),
    "neck_forward": ("neck/neck-trans-forward", "neck/neck-trans-backward"),
    "nape_depth": ("neck/neck-back-scale-depth-incr", "neck/neck-back-scale-depth-decr"),
}  # fmt: skip
#: Of each arm.
ARM: dict[str, tuple[str, ...]] = {
    f"arm_{name.replace('-', '_')}": (_ARM.format("l", f"{name}-incr"),
                                      _ARM.format("l", f"{name}-decr"))
    for name in ("fat", "muscle", "scale-depth", "scale-horiz", "scale-vert", "shoulder-muscle")
}  # fmt: skip
#: Half the breadth over which a shape of both breasts goes over from one side to the other, m.
_BLEND = 0.03
#: Cosine above which a pair of targets counts as one line.
_OPPOSITE = 0.82
#: Least part of a shape, as a share of its norm, that bones and the shapes before it leave over.
_OWN = 0.15
#: Shapes that move nothing by more are left out, m.
_LEAST = 1e-3


@dataclass(frozen=True, eq=False, repr=False)
class Shapes:
    """What becomes the template's blendshapes; of those left out, why."""

    names: tuple[str, ...]
    moved: Floats  #: (A, n, 3) m
    bounds: Floats  #: (A, 2)
    dropped: dict[str, str]


def shapes(read: Read, points: Floats, mirror: Ints, moves: Floats) -> Shapes:
    """All of them; ``read(target)`` gives (n, 3) m at the template's ``points`` (n, 3) m.

    A pair of targets becomes one line where they are opposite to a cosine of −0.82 or beyond;
    its bounds are the targets' places on it. Else each is a shape of its own from 0 to 1.
    What targets of the whole body do to the torso as a rigid body is taken off: it stands on the
    ground there. ``moves`` (m, n, 3) are the bones' own, which need no shape.
    """
    candidates = {**_breasts(read, points, mirror), **_bodies(read, points, mirror)}
    for name, ends in TORSO.items():
        candidates.update(_lines(name, [_even(read(end), mirror) for end in ends]))
    for name, ends in ARM.items():
        for end, (moved, bounds) in _lines(name, [read(end) for end in ends]):
            candidates[f"{end}_left"] = (moved, bounds)
            candidates[f"{end}_right"] = (_image(moved, mirror), bounds)
    return _independent(candidates, moves)


def _breasts(read: Read, points: Floats, mirror: Ints) -> dict[str, Line]:
    left = (1 + np.sin(np.pi / 2 * np.clip(points[:, :1] / _BLEND, -1, 1))) / 2
    result = {}
    for name, ends in BREAST.items():
        for end, (moved, bounds) in _lines(name, [_even(read(end), mirror) for end in ends]):
            result[f"breast_{end}_left"] = (moved * left, bounds)
            result[f"breast_{end}_right"] = (moved * left[mirror], bounds)
    return result


def _bodies(read: Read, points: Floats, mirror: Ints) -> dict[str, Line]:
    """Age, peoples, weight, muscle, figure."""

    def still(moved: Floats) -> Floats:
        return _unmoved(points, _even(moved, mirror))

    young = _people(read, "young")
    result = {"age": (still(_people(read, "old") - young), (-0.3, 1.0))}
    for people in ("african", "asian"):
        moved = read(f"macrodetails/{people}-female-young") - young
        result[f"people_{people}"] = (still(moved), (-1.0, 1.0))
    for name, ends in BODY.items():
        result.update(_lines(name, [still(read(end)) for end in ends]))
    return result


def _unmoved(points: Floats, moved: Floats) -> Floats:
    """Displacements less their best small rigid motion."""
    p = points - points.mean(axis=0)
    axes = [np.broadcast_to(e, p.shape) for e in np.eye(3)] + [np.cross(e, p) for e in np.eye(3)]
    basis = np.stack([axis.ravel() for axis in axes], axis=1)
    motion = np.linalg.lstsq(basis, moved.ravel(), rcond=None)[0]
    return moved - (basis @ motion).reshape(-1, 3)


def _people(read: Read, age: str) -> Floats:
    peoples = ("african", "asian", "caucasian")
    return np.asarray(sum(read(f"macrodetails/{p}-female-{age}") for p in peoples) / 3)


def _image(moved: Floats, mirror: Ints) -> Floats:
    return moved[mirror] * (-1.0, 1.0, 1.0)


def _even(moved: Floats, mirror: Ints) -> Floats:
    return (moved + _image(moved, mirror)) / 2


def _lines(name: str, ends: list[Floats]) -> list[tuple[str, Line]]:
    """A pair of opposite targets as one line, others each from 0 to 1."""
    if len(ends) == 1:
        return [(name, (ends[0], (0.0, 1.0)))]
    more, less = ends
    norms = np.linalg.norm(more) * np.linalg.norm(less)
    if norms == 0 or (more * less).sum() > -_OPPOSITE * norms:
        return [(f"{name}_more", (more, (0.0, 1.0))), (f"{name}_less", (less, (0.0, 1.0)))]
    line = (more - less) / 2
    low, high = ((end * line).sum() / (line * line).sum() for end in (less, more))
    return [(name, (line, (float(low), float(high))))]


def _independent(candidates: dict[str, Line], moves: Floats) -> Shapes:
    """Those that move something that neither the bones nor the shapes before them can.

    Images in the middle are judged together: both stay, or neither.
    """
    basis = np.zeros((moves[0].size, len(moves) + len(candidates)), order="F")
    basis[:, : len(moves)] = np.linalg.qr(moves.reshape(len(moves), -1).T)[0]
    count, kept = len(moves), list[str]()
    dropped: dict[str, str] = {}
    for name, (moved, _) in candidates.items():
        twin = name.replace("_right", "_left")
        if twin in dropped:
            dropped[name] = dropped[twin]
            continue
        largest = float(np.linalg.norm(moved, axis=1).max())
        rest = moved.ravel() / max(float(np.linalg.norm(moved)), 1e-12)
        for _ in range(2):  # twice is enough against rounding
            rest = rest - basis[:, :count] @ (basis[:, :count].T @ rest)
        own = float(np.linalg.norm(rest))
        if largest < _LEAST:
            dropped[name] = f"moves the torso by {1e3 * largest:.2f} mm at most"
        elif own < _OWN and twin not in kept:
            dropped[name] = f"bones and the shapes before it leave {100 * own:.1f} % of it"
        else:
            kept.append(name)
            basis[:, count] = rest / own
            count += 1
    moved = np.array([candidates[name][0] for name in kept])
    return Shapes(tuple(kept), moved, np.array([candidates[name][1] for name in kept]), dropped)
