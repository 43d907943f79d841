"""How torsos differ: the blendshapes of the procedural torso, as fields over the place."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from supple.registration import procedural_body as body
from supple.registration.procedural_bumps import bumps
from supple.registration.procedural_breast_shapes import BREAST_SHAPES
from supple.registration.procedural_trunk_shapes import TRUNK_SHAPES

Floats = npt.NDArray[np.float64]

#: Coefficients that still are a body; 1 is near one standard deviation among women.
BOUND = 4.0


def blendshapes(points: Floats) -> tuple[Floats, tuple[str, ...]]:
    """Displacements (A, n, 3) m of the skin at ``points`` (n, 3) m for a coefficient 1; names."""
    flip = np.array([-1.0, 1.0, 1.0])
    here, there = (points, body.normals(points)), (points * flip, body.normals(points) * flip)
    fields: list[Floats] = []
    names: list[str] = []
    for table in (BREAST_SHAPES, {**TRUNK_SHAPES, **bumps()}):
        for name, field in table.items():
            left, right = field(*here), field(*there) * flip
            if name.endswith("_left"):
                fields += [left, right]
                names += [name, name.removesuffix("_left") + "_right"]
            else:
                fields.append((left + right) / 2)
                names.append(name)
    return np.stack(fields), tuple(names)
