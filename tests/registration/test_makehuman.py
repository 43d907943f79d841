"""The torso made from MakeHuman's body: a symmetric, closed-but-for-its-cuts, movable woman."""

from __future__ import annotations

from functools import cache
from pathlib import Path

import numpy as np
import pytest

from supple.registration.makehuman import torso
from supple.registration.posture import Posture, posed
from supple.registration.template import BONES, CURVES, LANDMARKS, REGIONS, Template


@cache
def _made(folder: Path) -> Template:
    return torso(folder / "data/template_makehuman", folder / "data/template_mpfb2")


@pytest.fixture(scope="session")
def template(shared: Path) -> Template:
    return _made(shared)


def _edges(triangles: np.ndarray) -> np.ndarray:
    """Directed edges (3 t, 2)."""
    return triangles[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2)


def _rims(t: Template) -> list[np.ndarray]:
    """Loops of edges that have a triangle on one side only: their vertices in order."""
    edges = {tuple(e) for e in _edges(t.triangles).tolist()}
    following = {a: b for a, b in edges if (b, a) not in edges}
    loops = []
    while following:
        loop = [min(following)]
        while (after := following.pop(loop[-1])) != loop[0]:
            loop.append(after)
        loops.append(np.array(loop))
    return loops


def _section(points: np.ndarray, triangles: np.ndarray, height: float) -> np.ndarray:
    """Where edges of the surface cross a height, (k, 2) m."""
    a, b = points[_edges(triangles)].transpose(1, 0, 2)
    crossing = (a[:, 2] < height) & (b[:, 2] >= height)
    a, b = a[crossing], b[crossing]
    return (a + (b - a) * ((height - a[:, 2]) / (b - a)[:, 2])[:, None])[:, :2]


def test_it_has_all_parts_of_a_template(template):
    """The issue: 9 bones, at least 55 blendshapes, about 2,200 vertices, the named drawing."""
    assert tuple((b.name, b.parent) for b in template.bones) == BONES
    assert 55 <= len(template.blendshapes) <= 80
    assert 2000 < len(template.points) < 2400
    assert set(template.landmarks) == set(LANDMARKS)
    assert set(template.curves) == set(CURVES)
    assert set(template.regions) == set(REGIONS)
    assert all(mask.any() for mask in template.regions.values())
    assert "CC0" in template.source


def test_left_is_the_image_of_right(template):
    """x → −x carries vertices, triangles, weights, joints, landmarks, curves, regions onto each."""
    t, image, flip = template, template.mirror, np.array([-1.0, 1, 1])
    assert np.abs(t.points[image] * flip - t.points).max() <= 1e-9
    ordered = {tuple(np.roll(r, -r.argmin())) for r in t.triangles}
    assert ordered == {tuple(np.roll(r, -r.argmin())) for r in image[t.triangles][:, ::-1]}
    names = [bone.name for bone in t.bones]
    pair = [names.index(_other(name)) for name in names]
    assert np.abs(t.weights[image][:, pair] - t.weights).max() <= 1e-9
    assert np.abs(t.joints[pair] * flip - t.joints).max() <= 1e-9
    for places in (t.landmark_points(), t.curve_points()):
        for name, place in places.items():
            assert np.abs(places[_other(name)] * flip - place).max() <= 1e-9, name
    for name, mask in t.regions.items():
        np.testing.assert_array_equal(mask[image], t.regions[_other(name)], name)


def test_blendshapes_of_a_pair_are_images_and_others_symmetric(template):
    """Mirrored displacements are those of the shape of the other side, with its bounds."""
    t = template
    for name, shape, bounds in zip(
        t.blendshape_names, t.blendshapes, t.blendshape_bounds, strict=True
    ):
        k = t.blendshape_names.index(_other(name))
        assert np.abs(t.blendshapes[k][t.mirror] * (-1, 1, 1) - shape).max() <= 1e-9, name
        np.testing.assert_array_equal(t.blendshape_bounds[k], bounds)


def _other(name: str) -> str:
    if name.endswith("_left"):
        return name.removesuffix("_left") + "_right"
    return name.removesuffix("_right") + "_left" if name.endswith("_right") else name


def test_it_is_one_surface_with_four_planar_cuts(template):
    """Each edge once each way: a manifold; open only at neck, hips, arms; χ = 2 − 4 = −2."""
    edges = _edges(template.triangles)
    assert len(np.unique(edges, axis=0)) == len(edges)
    rims = _rims(template)
    assert len(rims) == 4
    for rim in rims:
        p = template.points[rim] - template.points[rim].mean(axis=0)
        assert np.linalg.svd(p, compute_uv=False)[2] < 1e-9
    undirected = np.unique(np.sort(edges, axis=1), axis=0)
    assert len(np.unique(edges)) == len(template.points)
    assert len(template.points) - len(undirected) + len(template.triangles) == -2


def test_closed_at_its_cuts_it_holds_a_torso_outward(template):
    """Signed volume by Gauss with a fan over each cut: that of a torso without limbs, positive.

    A woman of 1.6 m and 55 kg has 55 l (density 1.0); trunk and neck are about half of that,
    here without pelvis (Dempster 1955: trunk 0.497 of the body).
    """
    t = template
    corners = t.points[t.triangles]
    volume = np.einsum("td,td->", corners[:, 0], np.cross(corners[:, 1], corners[:, 2])) / 6
    for rim in _rims(t):
        p = t.points[rim][::-1]  # a cap runs against its rim
        volume += np.einsum("kd,kd->", np.cross(p, np.roll(p, -1, axis=0)),
                            np.broadcast_to(p.mean(axis=0), p.shape)) / 6  # fmt: skip
    assert 0.015 < volume < 0.030


def test_girths_are_those_of_a_woman(template):
    """A tape over the nipples reads 80 to 110 cm, and more than one under the breasts."""
    from scipy.spatial import ConvexHull

    landmarks = template.landmark_points()
    trunk = (template.weights[:, [5, 6]].sum(axis=1) < 0.5)[template.triangles].all(axis=1)
    tape = [
        ConvexHull(_section(template.points, template.triangles[trunk], z)).area
        for z in (landmarks["nipple_left"][2], landmarks["breast_inferior_left"][2] - 0.01)
    ]
    assert 0.80 < tape[0] < 1.10
    assert 0.07 < tape[0] - tape[1] < 0.25


def test_triangles_are_fit_to_be_moved(template):
    """No angle below 8°, no edge beyond 4.5 cm, none of the breasts' beyond 2.5 cm."""
    p, t = template.points, template.triangles
    sides = [p[t[:, (i + 1) % 3]] - p[t[:, i]] for i in range(3)]
    lengths = np.linalg.norm(sides, axis=2)
    cosine = [-np.einsum("td,td->t", sides[i], sides[i - 1]) / lengths[i] / lengths[i - 1]
              for i in range(3)]  # fmt: skip
    assert np.degrees(np.arccos(cosine)).min() > 8
    assert lengths.max() < 0.045
    assert lengths[:, template.regions["breast_left"][t].all(axis=1)].max() < 0.025


def test_each_bone_moves_something_nearly_alone(template):
    """So that a fit can see it; nipples follow their breast's bone, and no other."""
    names = [bone.name for bone in template.bones]
    largest = dict(zip(names, template.weights.max(axis=0), strict=True))
    assert min(largest.values()) > 0.5, largest
    for side in ("left", "right"):
        nipple = template.landmarks[f"nipple_{side}"]
        shares = template.weights[:, names.index(f"breast_{side}")]
        assert (shares[template.triangles[nipple.triangle]] > 0.9).all()


#: Turns (degrees, about x, y, z) of left bones; right ones are their images.
_POSES = {
    "arms_down": {"arm": (0, 25, 0)},
    "arms_up": {"shoulder": (0, -30, 0), "arm": (0, -70, 0)},
    "supine": {"arm": (0, -30, 0), "breast": (0, 0, 20)},
    "bent": {"chest": (25, 0, 0), "neck": (20, 0, 0), "arm": (40, 0, 0)},
}


@pytest.mark.parametrize("pose", _POSES)
def test_no_triangle_folds_over_as_the_body_moves(template, pose):
    """Normals stay within 90° of those that the bones carry along, areas above a tenth."""
    from scipy.spatial.transform import Rotation

    t = template
    turns, shifts = np.tile(np.eye(3), (len(t.bones), 1, 1)), np.zeros((len(t.bones), 3))
    for k, bone in enumerate(t.bones):
        angles = np.array(_POSES[pose].get(bone.name.split("_")[0], (0, 0, 0)), dtype=float)
        own = angles * ((1, -1, -1) if bone.name.endswith("_right") else 1)
        turns[k] = Rotation.from_rotvec(own, degrees=True).as_matrix()
        if bone.parent >= 0:  # joints stay together
            turns[k] = turns[bone.parent] @ turns[k]
            arm = t.joints[k] - t.joints[bone.parent]
            shifts[k] = shifts[bone.parent] + turns[bone.parent] @ arm - arm
    rest = Posture.rest(t)
    moved = posed(t, Posture(turns, shifts, rest.scales, rest.blend))
    before, after = (_normals(p, t.triangles) for p in (t.points, moved))
    carried = np.einsum("tk,kij,tj->ti", t.weights[t.triangles].mean(axis=1), turns, before)
    assert (np.einsum("ti,ti->t", carried, after) > 0).all()
    sizes = np.linalg.norm(after, axis=1) / np.linalg.norm(before, axis=1)
    assert sizes.min() > 0.1


def _normals(points: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """Twice the area times the normal (t, 3)."""
    a, b, c = (points[triangles[:, i]] for i in range(3))
    return np.cross(b - a, c - a)


def test_a_common_motion_of_the_bones_moves_the_skin_rigidly(template, rotation):
    """Weights that sum to 1 leave R x + t exactly, to rounding."""
    shift = np.array([0.1, -0.7, 0.3])
    posture = Posture.rest(template).moved(rotation, shift, template.joints)
    expected = template.points @ rotation.T + shift
    np.testing.assert_allclose(posed(template, posture), expected, atol=1e-13)


def test_landmarks_lie_where_anatomy_has_them(template):
    """Order along the body; notch to nipple 18–24 cm (Westreich 1997: 20.9 ± 2.1 cm)."""
    m = template.landmark_points()
    z = {name: place[2] for name, place in m.items()}
    assert z["sternal_notch"] > z["axilla_left"] > z["nipple_left"] > z["breast_inferior_left"]
    assert z["nipple_left"] > z["xiphoid"] >= z["breast_inferior_left"] - 0.01
    x = [m[f"{name}_left"][0] for name in ("breast_medial", "nipple", "breast_lateral", "axilla")]
    assert x == sorted(x)
    assert m["sternal_notch"][0] == m["xiphoid"][0] == 0
    assert 0.18 < np.linalg.norm(m["sternal_notch"] - m["nipple_left"]) < 0.24
    near = np.abs(template.points - m["nipple_left"])[:, [0, 2]].max(axis=1) < 0.05
    assert m["nipple_left"][1] < template.points[near, 1].min() + 2e-3  # its rim is in front


def test_curves_run_where_they_are_named(template):
    """Arrows along x = 0 between notch and xiphoid, head to head; outlines around nipples."""
    m, curves = template.landmark_points(), template.curve_points()
    upper, lower = curves["sternum_arrow_upper"], curves["sternum_arrow_lower"]
    assert max(np.abs(upper[:, 0]).max(), np.abs(lower[:, 0]).max()) < 1e-12
    np.testing.assert_allclose(upper[0], m["sternal_notch"], atol=1e-6)
    np.testing.assert_allclose(lower[0], m["xiphoid"], atol=1e-6)
    assert upper[-1, 2] > lower[-1, 2] > upper[-1, 2] - 0.02
    for side in ("left", "right"):
        assert template.curves[f"breast_{side}"].closed
        around = (curves[f"breast_{side}"] - m[f"nipple_{side}"])[:, [0, 2]]
        angle = np.unwrap(np.arctan2(*np.vstack([around, around[:1]]).T))
        assert abs(angle[-1] - angle[0]) == pytest.approx(2 * np.pi)
        step = np.linalg.norm(np.diff(curves[f"breast_{side}"], axis=0), axis=1)
        assert step.max() < 0.01


def test_blendshapes_are_movements_of_a_body_within_bounds(template):
    """Each moves 1 mm to 15 cm at its bounds; a breast's shape leaves the other side alone."""
    low, high = template.blendshape_bounds.T
    assert ((low <= 0) & (high > 0) & (low > -2) & (high < 2)).all()
    size = np.linalg.norm(template.blendshapes, axis=2).max(axis=1) * np.maximum(-low, high)
    assert ((size > 1e-3) & (size < 0.15)).all()
    for name, shape in zip(template.blendshape_names, template.blendshapes, strict=True):
        if name.startswith("breast_") and name.endswith("_left"):
            assert np.abs(shape[template.points[:, 0] < -0.031]).max() == 0, name


def test_no_blendshape_is_a_mixture_of_the_others(template):
    """Unit shapes are independent: least squares by those before leaves 15 % of each."""
    unit = template.blendshapes.reshape(len(template.blendshapes), -1)
    unit = unit / np.linalg.norm(unit, axis=1, keepdims=True)
    left = np.abs(np.diag(np.linalg.qr(unit.T, mode="r")))
    assert left.min() > 0.15


@pytest.mark.slow
def test_a_finer_spacing_only_adds_vertices(shared, template):
    """Without MPFB's table as with it: the same torso; old vertices stay where they were."""
    from scipy.spatial import cKDTree

    folder = shared / "data/template_makehuman"
    same = torso(folder)
    np.testing.assert_array_equal(same.points, template.points)
    np.testing.assert_array_equal(same.mirror, template.mirror)
    fine = torso(folder, spacing=0.012)
    assert len(fine.points) > 1.3 * len(template.points)
    coarse = torso(folder, spacing=1.0)
    assert cKDTree(fine.points).query(coarse.points)[0].max() < 1e-9
    there = fine.landmark_points()
    for name, place in template.landmark_points().items():
        assert np.linalg.norm(place - there[name]) < 5e-3, name
