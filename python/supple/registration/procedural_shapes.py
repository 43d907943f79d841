"""How torsos differ: the blendshapes of the procedural torso, as fields over the place."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from supple.registration import procedural_body as body
from supple.registration.procedural_breast_shapes import BREAST_SHAPES
from supple.registration.procedural_bumps import bumps
from supple.registration.procedural_mesh import Skin
from supple.registration.procedural_trunk_shapes import TRUNK_SHAPES

Floats = npt.NDArray[np.float64]

#: Coefficients that still are a body; 1 is near one standard deviation among women.
BOUND = 4.0
#: Least and greatest coefficients of those that would fold the skin, or hollow a breast, earlier.
_TIGHTER = {
    "breast_size": (-2.0, 5.0),
    "breast_projection": (-2.0, 5.0),
    "breast_heavy": (-2.5, 5.0),
    "axilla_front": (-4.0, 2.5),
    "axilla_side": (-4.0, 1.25),
    "dorsi": (-4.0, 2.25),
    "chest_75": (-4.0, 2.0),
    "arm_length": (-2.5, 4.0),
    "chest_0": (-4.0, 2.5),
    "breast_lower_pole": (-3.0, 4.0),
    "breast_fold": (-2.5, 4.0),
    "ribs_110": (-4.0, 3.0),
    "breast_up": (-3.5, 4.0),
}


def blendshapes(skin: Skin) -> tuple[Floats, tuple[str, ...]]:
    """Displacements (A, n, 3) m of the skin's vertices for a coefficient of 1, and their names."""
    normals = body.normals(skin.points)
    fields: list[Floats] = []
    names: list[str] = []
    for name, field in {**BREAST_SHAPES, **TRUNK_SHAPES, **bumps()}.items():
        moved = field(skin.points, normals)
        image = moved[skin.mirror] * (-1.0, 1.0, 1.0)
        if name.endswith("_left"):
            fields += [moved, image]
            names += [name, name.removesuffix("_left") + "_right"]
        else:
            fields.append((moved + image) / 2)
            names.append(name)
    return np.stack(fields), tuple(names)


def bounds(names: tuple[str, ...]) -> Floats:
    """Least and greatest coefficient (A, 2) of the blendshapes of these names."""
    stems = [name.removesuffix("_left").removesuffix("_right") for name in names]
    return np.array([_TIGHTER.get(stem, (-BOUND, BOUND)) for stem in stems])
