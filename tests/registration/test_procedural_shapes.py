"""The blendshapes of the template made by code: of their own, local, harmless, of any mesh."""

from __future__ import annotations

import numpy as np
import pytest

from supple.box_pairs import meeting
from supple.registration import procedural_body as body
from supple.registration.posture import Posture, posed
from supple.registration.procedural import torso
from supple.registration.template import BONES, LANDMARKS, Template
from supple.surface import Surface


@pytest.fixture(scope="module")
def template() -> Template:
    return torso()


@pytest.fixture(scope="module")
def fine() -> Template:
    return torso(0.012)


def crossings(points: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """Pairs (k, 2) of an edge's row and a triangle without a common corner that pierce each other.

    By the signs of five tetrahedra's volumes.
    """
    edges = np.unique(np.sort(triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2)), axis=0)
    ends, corners = points[edges], points[triangles]
    i, j = meeting(ends.min(1), ends.max(1), corners.min(1), corners.max(1))
    apart = (edges[i][:, :, None] != triangles[j][:, None, :]).all(axis=(1, 2))
    i, j = i[apart], j[apart]
    (p, q), (a, b, c) = ends[i].transpose(1, 0, 2), corners[j].transpose(1, 0, 2)

    def volume(k: np.ndarray, m: np.ndarray, n: np.ndarray, o: np.ndarray) -> np.ndarray:
        return np.einsum("nd,nd->n", np.cross(m - k, n - k), o - k)

    split = volume(a, b, c, p) * volume(a, b, c, q) < 0
    turns = [np.sign(volume(p, q, x, y)) for x, y in ((a, b), (b, c), (c, a))]
    through = (turns[0] == turns[1]) & (turns[1] == turns[2]) & (turns[0] != 0)
    return np.stack([i, j], axis=1)[split & through]


def _other(name: str) -> str:
    stem, _, side = name.rpartition("_")
    return {"left": f"{stem}_right", "right": f"{stem}_left"}.get(side, name)


def test_blendshapes_are_many_paired_and_independent(template: Template) -> None:
    """At least 55; each of unit length, the least singular value is no rounding."""
    names = template.blendshape_names
    assert len(names) >= 55
    assert len(set(names)) == len(names)
    assert all(_other(name) in names for name in names)
    flat = template.blendshapes.reshape(len(names), -1)
    sizes = np.linalg.norm(template.blendshapes, axis=2).max(axis=1)
    assert sizes.min() > 1e-3
    assert sizes.max() < 0.03
    flat = flat / np.linalg.norm(flat, axis=1, keepdims=True)
    squares = np.linalg.eigvalsh(flat @ flat.T)
    assert squares[0] > 0.02**2 * squares[-1], np.sqrt(squares[[0, -1]])


def test_each_blendshape_leaves_most_of_the_skin_where_it_is(template: Template) -> None:
    """Local: none moves more than two thirds of the vertices, those of a breast less than a tenth
    of the other breast's side."""
    moved = np.linalg.norm(template.blendshapes, axis=2) > 1e-5
    assert moved.mean(axis=1).max() < 0.67
    right = template.points[:, 0] < -0.005
    for name, mask in zip(template.blendshape_names, moved, strict=True):
        if name.endswith("_left"):
            assert mask[right].mean() < 0.1, name


def test_another_spacing_describes_the_same_torso(template: Template, fine: Template) -> None:
    """The coarse surface is within h²/(8 r) of the fine one; shapes, weights, marks agree."""
    assert len(fine.points) > 3 * len(template.points)
    surface = Surface(fine.points, fine.triangles)
    near = surface.closest(template.points)
    assert np.asarray(near.distance).max() < 0.012**2 / (8 * 0.006)
    corners, b = fine.triangles[near.triangle], np.asarray(near.barycentric)
    weights = np.einsum("nc,nck->nk", b, fine.weights[corners])
    assert np.abs(weights - template.weights).max() < 0.05
    for coarse, values in zip(template.blendshapes, fine.blendshapes, strict=True):
        between = np.einsum("nc,ncd->nd", b, values[corners])
        assert np.abs(between - coarse).max() < 1e-3
    at, fine_at = template.landmark_points(), fine.landmark_points()
    assert max(np.linalg.norm(at[name] - fine_at[name]) for name in LANDMARKS) < 0.003
    for name, curve in template.curve_points().items():
        gap = np.linalg.norm(curve - fine.curve_points()[name], axis=1)
        assert gap.max() < 0.006, name


@pytest.mark.slow
def test_the_skin_converges_to_the_level_set_at_order_two() -> None:
    """Middles of edges on the back, where it is smoothest, lie off it by O(h²)."""
    misses = []
    for spacing in (0.036, 0.018, 0.009):
        made = torso(spacing)
        kept = made.regions["back"][made.triangles].all(axis=1)
        middles = made.points[made.triangles[kept]].mean(axis=1)
        misses.append(np.abs(body.level(middles)).mean())
    assert misses[0] / misses[1] > 2.8
    assert misses[1] / misses[2] > 2.8


def test_the_skin_does_not_cut_itself(template: Template) -> None:
    """No edge pierces a triangle, at rest nor with the arms raised by 40°; a fold is found."""
    assert len(crossings(template.points, template.triangles)) == 0
    bent = template.points.copy()
    bent[template.points[:, 2] > 0.1, 2] -= 0.2
    assert len(crossings(bent, template.triangles)) > 0
    step = np.zeros((9, 9))
    for name, angle in (("arm_left", -0.7), ("arm_right", 0.7)):
        step[[bone for bone, _ in BONES].index(name), 1] = angle
    whole = np.concatenate([step.ravel(), np.zeros(len(template.blendshapes))])
    raised = posed(template, Posture.rest(template).stepped(whole))
    left = template.regions["arm_left"]
    assert raised[left, 2].mean() > template.points[left, 2].mean() + 0.03
    assert len(crossings(raised, template.triangles)) == 0


@pytest.mark.slow
def test_no_blendshape_cuts_the_skin(template: Template) -> None:
    """At coefficients -1 and 1 of each, and triangles turn by less than 60°."""
    rest = Surface(template.points, template.triangles).normals
    for name, shape in zip(template.blendshape_names, template.blendshapes, strict=True):
        if name.endswith("_right"):
            continue
        for sign in (-1, 1):
            points = template.points + sign * shape
            turned = Surface(points, template.triangles).normals
            assert np.einsum("nd,nd->n", rest, turned).min() > 0.5, (name, sign)
            assert len(crossings(points, template.triangles)) == 0, (name, sign)


@pytest.mark.slow
def test_no_blendshape_alone_cuts_the_skin_within_its_bounds(template: Template) -> None:
    """At the least and the greatest coefficient of each."""
    many = zip(
        template.blendshape_names, template.blendshapes, template.blendshape_bounds, strict=True
    )
    for name, shape, bounds in many:
        if name.endswith("_right"):
            continue
        for coefficient in bounds:
            points = template.points + coefficient * shape
            assert len(crossings(points, template.triangles)) == 0, (name, coefficient)
