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
