"""Bodies of random shape: some of a template's blendshapes, as far as a body can go."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
from numpy.random import Generator

from supple.errors import ConvergenceError
from supple.registration.template import Floats, Template

#: Correlation of the shapes of a pair: bodies are nearly symmetric.
_ALIKE = 0.9
#: Share of the shapes in a body. Many one-sided shapes ("fuller, in an old body") mean one thing:
#: all at once would add it up many times.
_SHARE = 0.4
#: Largest movement of a vertex by all shapes of the breasts, and by all others, m.
_REACH = {"breast": 0.045, "trunk": 0.035}
#: Triangles may not turn by more than 120°, nor breasts cross the midline by more than 3 mm.
_TURNED, _CROSSED = -0.5, 3e-3
_TRIES = 100


def random_blend(template: Template, random: Generator, sd: float) -> Floats:
    """Coefficients (A,): normal of ``sd`` cut at their bounds, two fifths of them not 0.

    All shapes of the breasts, and all others, are scaled down together where they would move a
    vertex further than a drawn part of 45 mm (35 mm). Drawn again where the skin would fold.

    Raises:
        ConvergenceError: the skin folds in each of 100 draws.
    """
    groups = _groups(template)
    for _ in range(_TRIES):
        blend = _drawn(template, random, sd)
        for name, members in groups.items():
            moved = np.tensordot(blend[members], template.blendshapes[members], axes=1)
            largest = np.linalg.norm(moved, axis=1).max(initial=1e-12)
            blend[members] *= min(1.0, random.uniform(0.3, 1.0) * _REACH[name] / largest)
        if not _folds(template, template.points + np.tensordot(blend, template.blendshapes, 1)):
            return blend
    raise ConvergenceError(f"each of {_TRIES} random shapes folds the skin of {template!r}.")


def _drawn(template: Template, random: Generator, sd: float) -> Floats:
    names = {name: i for i, name in enumerate(template.blendshape_names)}
    low, high = template.blendshape_bounds.T
    blend = _cut_normal(random, sd, low, high) * (random.uniform(size=len(low)) < _SHARE)
    for name, i in names.items():
        j = names.get(name[: -len("_left")] + "_right") if name.endswith("_left") else None
        if j is not None:
            own = np.sqrt(1 - _ALIKE**2) * blend[j] if blend[i] else 0.0
            blend[j] = np.clip(_ALIKE * blend[i] + own, low[j], high[j])
    return blend


def _cut_normal(random: Generator, sd: float, low: Floats, high: Floats) -> Floats:
    """Normal numbers (A,) drawn again where they leave their bounds."""
    drawn = sd * random.normal(size=len(low))
    for _ in range(100):
        out = (drawn < low) | (drawn > high)
        if not out.any():
            return np.asarray(drawn)
        drawn[out] = sd * random.normal(size=int(out.sum()))
    return np.clip(drawn, low, high)


def _groups(template: Template) -> dict[str, npt.NDArray[np.intp]]:
    """Numbers of the shapes that move mostly the breasts, and of the others."""
    breasts = template.regions["breast_left"] | template.regions["breast_right"]
    moves = np.linalg.norm(template.blendshapes, axis=2)
    of_breast = moves[:, breasts].sum(axis=1) > moves[:, ~breasts].sum(axis=1)
    return {"breast": np.flatnonzero(of_breast), "trunk": np.flatnonzero(~of_breast)}


def _folds(template: Template, shape: Floats) -> bool:
    """Whether the skin turns over itself, or a breast crosses the midline."""
    before, after = (_normals(points, template.triangles) for points in (template.points, shape))
    over = np.einsum("ti,ti->t", before, after) < _TURNED
    left = (template.points[:, 0] > 0.01) & (shape[:, 0] < -_CROSSED)
    right = (template.points[:, 0] < -0.01) & (shape[:, 0] > _CROSSED)
    return bool(over.mean() > 2e-3 or (left | right).any())


def _normals(points: Floats, triangles: npt.NDArray[np.int64]) -> Floats:
    a, b, c = (points[triangles[:, i]] for i in range(3))
    cross = np.cross(b - a, c - a)
    return np.asarray(cross / (np.linalg.norm(cross, axis=1, keepdims=True) + 1e-30))
