"""The torso template that Supple ships: made by code, so that everything runs with no data."""

from __future__ import annotations

from supple.registration.procedural_marks import marks, regions
from supple.registration.procedural_mesh import skin
from supple.registration.procedural_rig import bones, weights
from supple.registration.procedural_shapes import blendshapes, bounds
from supple.registration.template import Template


def torso(spacing: float = 0.024) -> Template:
    """A woman's torso from the hips to the neck, with upper arms; upright, arms a little away.

    Everything but the triangles is a closed form of the place, so that another ``spacing``
    describes the same torso, the same blendshapes and the same drawing.

    Args:
        spacing: longest edges wanted, 0.004 to 0.04 m; those on the breasts are near half of it.
            0.024 gives 2,300 vertices, 0.008 some 20,000.

    Raises:
        InputError: another spacing.
    """
    made = skin(spacing)
    landmarks, curves = marks(made)
    ends = [float(landmarks[name].at(made.points, made.triangles)[0, 2])
            for name in ("sternal_notch", "xiphoid")]  # fmt: skip
    shapes, names = blendshapes(made)
    return Template(
        points=made.points,
        triangles=made.triangles,
        bones=bones(),
        weights=weights(made.points),
        blendshapes=shapes,
        blendshape_names=names,
        blendshape_bounds=bounds(names),
        landmarks=landmarks,
        curves=curves,
        regions=regions(made.points, *ends),
        mirror=made.mirror,
        name="procedural torso",
        source="Supple; made by code after published anthropometry.",
    )
