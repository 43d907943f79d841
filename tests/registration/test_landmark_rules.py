"""The landmarks of all templates mean the same points."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from supple.registration.landmark_rules import (
    axilla,
    breast_edges,
    drawn_through,
    fold_below,
    notch_height,
    turning,
)
from supple.registration.makehuman import torso as makehuman
from supple.registration.procedural import torso as procedural


@pytest.mark.parametrize("name", ["procedural", "makehuman"])
def test_a_template_s_landmarks_are_where_the_rules_put_them(name, request):
    """Xiphoid: 0.9 of the way down from notch to folds; the breast's edges: at the nipple's
    height; its lowest point: the crease. Within 6 mm, half an edge of the skin; the axilla, where
    edges are longer, within half of those."""
    if name == "makehuman":
        data = request.getfixturevalue("shared") / "data" / "template_makehuman"
        template = makehuman(Path(data))
    else:
        template = procedural()
    at, curves = template.landmark_points(), template.curve_points()
    top = notch_height(template.points, float(at["nipple_left"][2]))
    assert at["sternal_notch"][2] == pytest.approx(top, abs=6e-3)
    edge = axilla(template.points, template.triangles, joint_of(template, "arm_left"))
    half = edge_at(template, at["axilla_left"]) / 2
    for side, sign in (("left", 1), ("right", -1)):
        assert np.linalg.norm(at[f"axilla_{side}"] - edge * (sign, 1, 1)) < half
    fold = (at["breast_inferior_left"][2] + at["breast_inferior_right"][2]) / 2
    assert at["xiphoid"][2] == pytest.approx(0.1 * at["sternal_notch"][2] + 0.9 * fold, abs=6e-3)
    for side, sign in (("left", 1), ("right", -1)):
        mirror, outline = np.array([sign, 1, 1]), curves[f"breast_{side}"]
        medial, lateral = breast_edges(
            template.points, template.triangles,
            at[f"nipple_{side}"] * mirror, at[f"breast_inferior_{side}"] * mirror,
        )  # fmt: skip
        for name, place in (("medial", medial), ("lateral", lateral)):
            assert np.linalg.norm(at[f"breast_{name}_{side}"] - place * mirror) < 6e-3
            mark = at[f"breast_{name}_{side}"]
            assert np.linalg.norm(outline - mark, axis=1).min() < 8e-3
        assert medial[0] < sign * at[f"nipple_{side}"][0] < lateral[0]
        under = fold_below(template.points, template.triangles, at[f"nipple_{side}"])
        assert np.linalg.norm(at[f"breast_inferior_{side}"] - under) < 6e-3


def joint_of(template, name):
    return next(np.array(bone.joint) for bone in template.bones if bone.name == name)


def edge_at(template, place):
    """Mean edge, m, of the triangles round the vertex nearest to ``place``."""
    nearest = np.linalg.norm(template.points - place, axis=1).argmin()
    corners = template.points[template.triangles[(template.triangles == nearest).any(axis=1)]]
    return np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).mean()


def test_the_notch_is_the_corner_of_two_slopes():
    """A chest that recedes by 40°, a neck that leans forward by 20°, on a back: their corner."""
    z = np.linspace(-0.15, 0.09, 49)
    depth = np.where(z < 0, z * np.tan(np.radians(40)), -z * np.tan(np.radians(20)))
    front = np.column_stack([0 * z, depth - 0.05, z])
    assert notch_height(np.vstack([front, front * (1, 0, 1) + (0, 0.2, 0)]), -0.1) == pytest.approx(
        0, abs=2e-3
    )


def test_the_axilla_is_the_front_edge_under_an_arch():
    """A roof z = 0.1 - x² / 0.1 over a gap, its front edge rounded with a radius of 2 cm.

    At 45° on that quarter circle: behind its front, and above its lowest line, by r (1 - √½).
    """
    x = np.linspace(-0.08, 0.08, 33)
    angle = np.radians(np.linspace(0, 90, 31))
    y = np.r_[-0.02 * np.sin(angle[::-1]), np.linspace(0.005, 0.08, 16)]
    lift = np.r_[0.02 * (1 - np.cos(angle[::-1])), 0.05 * np.linspace(0.005, 0.08, 16) ** 2]
    points = np.array([(a + 0.2, b, 0.1 - a * a / 0.1 + c)
                       for a in x for b, c in zip(y, lift, strict=True)])  # fmt: skip
    k = np.arange(len(points)).reshape(len(x), -1)
    a, b, c, d = k[:-1, :-1], k[1:, :-1], k[1:, 1:], k[:-1, 1:]
    triangles = np.vstack([np.stack(t, -1).reshape(-1, 3) for t in ((a, b, c), (a, c, d))])
    r = 0.02 * np.sqrt(0.5)
    for joint in (0.21, 0.23):  # at the arch's top, and 2 cm beside it, where the roof is lower
        edge = axilla(points, triangles, np.array([joint, 0.0, 0.2]))
        lower = (joint - 0.21) ** 2 / 0.1
        assert np.allclose(edge, (joint - 0.01, -r, 0.12 - r - lower), atol=2e-3)


def test_the_fold_of_a_step_is_its_inner_corner():
    """A nipple 6 cm before a wall, the underside straight back to it 5 cm below: the corner."""
    profile = [(-0.06, 0.0), (-0.05, -0.03), (0.0, -0.05), (0.0, -0.09), (0.0, -0.2)]
    points = np.array([(x, y, z) for y, z in profile for x in (-0.01, 0.01)])
    steps = 2 * np.arange(len(profile) - 1)[:, None]
    triangles = np.vstack([np.add(steps, (0, 1, 2)), np.add(steps, (1, 3, 2))])
    found = fold_below(points, triangles, np.array([0.0, -0.06, 0.0]))
    assert np.allclose(found, (0.0, 0.0, -0.05), atol=1e-12)


def test_an_outline_is_drawn_through_its_anchors_and_stays_on_top():
    """A unit circle, its right moved out by 0.2 and its lowest down by 0.3: through both, smoothly.

    Half-way in angle between the top, which stays, and the right, half of 0.2.
    """
    angle = np.linspace(0, 2 * np.pi, 400, endpoint=False)
    circle = np.column_stack([np.cos(angle), 0 * angle, np.sin(angle)])
    drawn = drawn_through(circle, np.array([[1.2, 0.0, 0.0], [0.0, 0.0, -1.3]]))
    assert np.allclose(drawn[[0, 300]], [(1.2, 0, 0), (0, 0, -1.3)], atol=1e-12)
    assert np.allclose(drawn[100], (0, 0, 1), atol=1e-12)
    assert np.allclose(drawn[50] - circle[50], (0.1, 0, 0), atol=1e-12)
    assert np.linalg.norm(np.diff(drawn, axis=0), axis=1).max() < 0.03


def test_the_edges_of_a_breast_on_a_tube():
    """A trunk with the half-axes 0.15 and 0.10: at 0.3 of the nipple's x; as deep as the fold."""
    angle = np.linspace(0, 2 * np.pi, 721)[:-1]
    ring = np.column_stack([0.15 * np.sin(angle), -0.1 * np.cos(angle), 0 * angle])
    points = np.vstack([ring + np.array([0.0, 0.0, z]) for z in (-0.05, 0.05)])
    k, n = np.arange(len(ring)), len(ring)
    after = (k + 1) % n
    triangles = np.vstack([np.stack([k, after, k + n], 1), np.stack([after, after + n, k + n], 1)])
    nipple, fold = (
        np.array([0.08, -0.1 * np.sqrt(1 - (8 / 15) ** 2), 0.0]),
        np.array([0.08, -0.06, -0.05]),
    )
    medial, lateral = breast_edges(points, triangles, nipple, fold)
    assert np.allclose(medial, (0.024, -0.1 * np.sqrt(1 - 0.16**2), 0.0), atol=1e-4)
    assert np.allclose(lateral, (0.12, -0.06, 0.0), atol=1e-4)


def test_a_line_turns_by_the_angle_between_its_halves():
    """Two straight lines of 20 cm that meet at 0.5 rad: 0.5 there, 0 further off than 30 mm."""
    s = np.linspace(0, 0.2, 41)
    up = np.column_stack([0 * s, 0 * s, s])
    on = up[-1] + np.column_stack([0 * s, np.sin(0.5) * s, np.cos(0.5) * s])[1:]
    length, turn, curve = turning(np.vstack([up, on]))
    assert abs(np.nanmax(np.abs(turn)) - 0.5) < 0.02
    assert abs(length[np.nanargmax(np.abs(turn))] - 0.2) < 2e-3
    assert np.allclose(turn[(length < 0.16) & np.isfinite(turn)], 0, atol=1e-3)
    assert np.allclose(curve[0], 0)
    assert len(curve) == len(turn)
