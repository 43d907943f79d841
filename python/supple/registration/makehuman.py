"""A torso template from MakeHuman's CC0 body: mesh, targets, rig and weights.

Read the body → make it an adult woman → cut out the torso → refine → bones, shapes, marks.
"""

from __future__ import annotations

from functools import cache
from pathlib import Path

import numpy as np
import numpy.typing as npt

from supple.registration import makehuman_bones as rig
from supple.registration import makehuman_marks as draw
from supple.registration.makehuman_cut import Half, cut
from supple.registration.makehuman_files import BaseMesh, read_base
from supple.registration.makehuman_refine import refined
from supple.registration.makehuman_shapes import shapes
from supple.registration.template import BONES, Template

Floats = npt.NDArray[np.float64]

SOURCE = (
    "hm08 body, targets, rig and weights of MakeHuman, (c) 2020 Data Collection AB, J. Palmius, "
    "J. Hauquier, 2021 Elvaerwyn; CC0"
)
_PEOPLES = ("african", "asian", "caucasian")
_FULL = "breast/female-young-averagemuscle-averageweight-maxcup-averagefirmness"
_NIPPLE = "breast/nipple-point-incr"
_HIPS = 0.05  #: height of the lower cut, m
#: A point of the neck's cut, m, and its normal.
_NECK = np.array([(0.0, -0.025, 0.555), (0.0, -0.196, 0.981)])
_ARM = 0.55  #: place of the cut between the joints of shoulder and elbow
#: Where the breast begins: geometric mean of its bone's weight and of its move by a fuller cup.
_OUTLINE = 0.25


def torso(folder: Path, mpfb: Path | None = None, spacing: float = 0.0185) -> Template:
    """The torso of an average young woman, 1.59 m tall.

    Args:
        folder: laid out as MakeHuman's data: 3dobjs/base.obj, targets/, rigs/.
        mpfb: laid out as MPFB 2's data, for its table of mirrored vertices; without it they are
            found by place.
        spacing: longest edge on the breasts, m, as they are or half a cup range fuller, as far as
            one division goes; twice that elsewhere. 0.0185 gives about 2,200 vertices.

    Raises:
        InputError: a file is missing or not MakeHuman's.
        MeshError: the mesh is not hm08.
    """
    base = read_base(Path(folder), None if mpfb is None else Path(mpfb))
    woman = base.points + sum(base.target(f"macrodetails/{p}-female-young") for p in _PEOPLES) / 3
    more = base.target(_FULL)
    half = _cut(base, woman)
    full = half.means @ np.linalg.norm(more, axis=1)
    longest = np.where(full > 0.1 * full.max(), spacing, 2 * spacing)
    half = refined(half, woman, woman + more / 2, base.mirror, longest)
    return _template(base, woman, half)


def _cut(base: BaseMesh, woman: Floats) -> Half:
    """Neck, left upper arm and hips cut across."""
    joints = {name: woman[ids].mean(axis=0) for name, ids in base.joints().items()}
    weights = base.weights()
    limb = ("upperarm", "lowerarm", "wrist", "finger", "metacarpal")
    arm = sum(w for name, w in weights.items() if name.startswith(limb) and name.endswith(".L"))
    shoulder, elbow = joints["upperarm01.L"], joints["lowerarm01.L"]
    along = (elbow - shoulder) / np.linalg.norm(elbow - shoulder)
    reach = (woman - shoulder) @ along - _ARM * np.linalg.norm(elbow - shoulder)
    sides = ((woman - _NECK[0]) @ _NECK[1], _HIPS - woman[:, 2], np.where(arm > 0.5, reach, -1.0))
    return cut(woman, base.quads, sides)


def _template(base: BaseMesh, woman: Floats, half: Half) -> Template:
    means, triangles, mirror = half.whole(base.mirror)
    points = means @ woman
    points[mirror == np.arange(len(points)), 0] = 0.0

    @cache
    def target(name: str) -> Floats:
        return np.asarray(means @ base.target(name))

    skin = draw.Skin(points, triangles, mirror)
    weights = rig.weights(base, means, skin)
    of_bone = {name: weights[:, k] for k, (name, _) in enumerate(BONES)}
    full, nipple = (np.linalg.norm(target(name), axis=1) for name in (_FULL, _NIPPLE))
    breast = np.sqrt(full / full.max() * of_bone["breast_left"])
    outline = draw.smooth_outline(skin, skin.outline(breast, _OUTLINE, 96))
    marks = draw.landmarks(skin, nipple, rig.shoulder(base, woman))
    inside = (breast > _OUTLINE) & (points[:, 0] > 0)
    bones = rig.bones(base, woman, skin.at(outline).mean(axis=0))
    found = shapes(target, points, mirror, rig.moves(points, weights, bones))
    return Template(
        points, triangles, bones, weights,
        found.moved, found.names, found.bounds, marks, draw.curves(skin, marks, outline),
        draw.regions(skin, of_bone, inside, marks), mirror, "makehuman", SOURCE,
    )  # fmt: skip
