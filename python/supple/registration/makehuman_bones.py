"""The nine bones of the torso from MakeHuman's default rig of 163."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from supple.registration.makehuman_files import BaseMesh
from supple.registration.template import BONES, Bone

Floats = npt.NDArray[np.float64]
Ints = npt.NDArray[np.int64]

#: Bone of the torso → the rig's bones whose weights it takes over; those of the left side.
_PARTS = {
    "abdomen": ("root", "pelvis.L", "pelvis.R", "spine05", "spine04", "spine03",
                "upperleg01.L", "upperleg01.R", "upperleg02.L", "upperleg02.R"),
    "chest": ("spine02", "spine01"),
    "neck": ("neck01", "neck02", "neck03", "head", "jaw"),
    "shoulder_left": ("clavicle.L", "shoulder01.L"),
    "arm_left": ("upperarm01.L", "upperarm02.L", "lowerarm01.L"),
    "breast_left": ("breast.L",),
}  # fmt: skip
#: Bone of the torso → the bone of the rig at whose head it turns.
_HEADS = {"abdomen": "spine04", "chest": "spine02", "neck": "neck01",
          "shoulder_left": "clavicle.L", "arm_left": "upperarm01.L"}  # fmt: skip


def weights(base: BaseMesh, means: Any, mirror: Ints) -> Floats:
    """Weights (n, 9) at the vertices of the torso, in the order of BONES; rows sum to 1.

    The rig shares the neck and the breasts with the chest even at their far ends; here both come
    to 1 where the rig's own weight is largest, so that each of these bones moves something alone.
    """
    rig = base.weights()
    left = {name: means @ sum(rig[part] for part in parts) for name, parts in _PARTS.items()}
    whole = np.stack([_side(left, name, mirror) for name, _ in BONES], axis=1)
    whole = np.clip(whole, 0.0, None)
    for name in ("neck", "breast_left", "breast_right"):
        _raise(whole, [bone for bone, _ in BONES].index(name))
    whole = whole / whole.sum(axis=1, keepdims=True)
    whole[whole < 1e-4] = 0.0
    return np.asarray(whole / whole.sum(axis=1, keepdims=True))


def _side(left: dict[str, Floats], name: str, mirror: Ints) -> Floats:
    if name.endswith("_right"):
        return left[name.replace("_right", "_left")][mirror]
    own = left[name]
    return own if name.endswith("_left") else (own + own[mirror]) / 2


def _raise(whole: Floats, column: int) -> None:
    """Scale a column so that its largest is 1, at the cost of all others in equal parts."""
    whole /= np.maximum(whole.sum(axis=1, keepdims=True), 1e-12)
    raised = whole[:, column] / whole[:, column].max()
    others = 1 - whole[:, column]
    whole *= ((1 - raised) / np.maximum(others, 1e-12))[:, None]
    whole[:, column] = raised


def bones(base: BaseMesh, points: Floats, breast: Floats) -> tuple[Bone, ...]:
    """BONES with their joints; ``points`` (n, 3) m of all the mesh, ``breast`` (3,) its base."""
    heads = base.joints()
    places = {name: points[heads[head]].mean(axis=0) for name, head in _HEADS.items()}
    places["breast_left"] = breast
    result = []
    for name, parent in BONES:
        x, y, z = places[name.replace("_right", "_left")]
        side = {"left": x, "right": -x}.get(name.rpartition("_")[2], 0.0)
        result.append(Bone(name, parent, (float(side), float(y), float(z))))
    return tuple(result)


def moves(points: Floats, weights: Floats, bones: tuple[Bone, ...]) -> Floats:
    """What each bone does to the skin (9 K, n, 3) m: shifts, turns and scales, to first order."""
    result = []
    for k, bone in enumerate(bones):
        arm, share = points - bone.joint, weights[:, k, None]
        for axis in np.eye(3):
            result += [share * axis, share * np.cross(axis, arm), share * arm * axis]
    return np.array(result)
