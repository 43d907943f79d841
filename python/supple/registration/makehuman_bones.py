"""The nine bones of the torso from MakeHuman's default rig of 163."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from supple.registration.makehuman_files import BaseMesh
from supple.registration.makehuman_marks import Skin
from supple.registration.makehuman_refine import laplacian
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
#: Length over which weights are evened out, m.
_EVEN = 0.01
#: Largest weight of bones that the rig lets move nothing alone.
_TOPS = {("shoulder_left", "shoulder_right"): 0.7, ("neck",): 1.0,
         ("breast_left", "breast_right"): 1.0}  # fmt: skip
#: Bone of the torso → the bone of the rig at whose head it turns.
_HEADS = {"abdomen": "spine04", "chest": "spine02", "neck": "neck01",
          "shoulder_left": "clavicle.L", "arm_left": "upperarm01.L"}  # fmt: skip


def weights(base: BaseMesh, means: Any, skin: Skin) -> Floats:
    """Weights (n, 9) at the vertices of the torso, in the order of BONES; rows sum to 1.

    The rig's own are evened out over `_EVEN`: in the armpit they jump within a few mm. It shares
    shoulders, neck and breasts with the chest even where they are strongest; here they come to
    `_TOPS` there, so that a scan tells what each of these bones does.
    """
    rig = base.weights()
    left = {name: means @ sum(rig[part] for part in parts) for name, parts in _PARTS.items()}
    whole = np.stack([_side(left, name, skin.mirror) for name, _ in BONES], axis=1)
    whole = np.clip(_evened(whole, skin), 0.0, None)
    names = [name for name, _ in BONES]
    for bones, top in _TOPS.items():
        _raise(whole, [names.index(bone) for bone in bones], top)
    whole[whole < 1e-3] = 0.0  # too small to see
    return np.asarray(whole / whole.sum(axis=1, keepdims=True))


def _evened(values: Floats, skin: Skin) -> Floats:
    """One implicit step of diffusion on the skin, (M + a² L) x = M values; the same both sides."""
    from scipy import sparse
    from scipy.sparse.linalg import spsolve

    stiffness, mass = laplacian(skin.points, skin.triangles)
    matrix = sparse.diags_array(mass) + _EVEN**2 * stiffness
    result = spsolve(matrix.tocsc(), mass[:, None] * values)
    swapped = [[name for name, _ in BONES].index(_other(name)) for name, _ in BONES]
    return np.asarray((result + result[skin.mirror][:, swapped]) / 2)


def _other(name: str) -> str:
    """The bone of the other side, or the same."""
    stem, _, side = name.rpartition("_")
    return {"left": f"{stem}_right", "right": f"{stem}_left"}.get(side, name)


def _side(left: dict[str, Floats], name: str, mirror: Ints) -> Floats:
    if name.endswith("_right"):
        return left[name.replace("_right", "_left")][mirror]
    own = left[name]
    return own if name.endswith("_left") else (own + own[mirror]) / 2


def _raise(whole: Floats, columns: list[int], top: float) -> None:
    """Scale columns so that the largest is ``top``, at the cost of all others in equal parts."""
    whole /= np.maximum(whole.sum(axis=1, keepdims=True), 1e-12)
    raised = top * whole[:, columns] / whole[:, columns].max()
    others = 1 - whole[:, columns].sum(axis=1)
    whole *= (np.maximum(1 - raised.sum(axis=1), 0) / np.maximum(others, 1e-12))[:, None]
    whole[:, columns] = raised


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


def shoulder(base: BaseMesh, points: Floats) -> Floats:
    """The left arm's joint (3,) m; ``points`` (n, 3) m of all the mesh."""
    return np.asarray(points[base.joints()[_HEADS["arm_left"]]].mean(axis=0))


def moves(points: Floats, weights: Floats, bones: tuple[Bone, ...]) -> Floats:
    """What each bone does to the skin (9 K, n, 3) m: shifts, turns and scales, to first order."""
    result = []
    for k, bone in enumerate(bones):
        arm, share = points - bone.joint, weights[:, k, None]
        for axis in np.eye(3):
            result += [share * axis, share * np.cross(axis, arm), share * arm * axis]
    return np.array(result)
