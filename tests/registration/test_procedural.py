"""The template made by code: a sound mesh, symmetric, of a woman's size, with shapes of its own."""

from __future__ import annotations

import signal
import time

import numpy as np
import pytest

from supple.errors import InputError
from supple.registration import procedural_body as body
from supple.registration.procedural import torso
from supple.registration.procedural_mesh import NECK_END, WAIST_END, border
from supple.registration.template import BONES, LANDMARKS, Template
from supple.surface import Surface

FLIP = np.array([-1.0, 1.0, 1.0])


@pytest.fixture(scope="module")
def template() -> Template:
    return torso()


@pytest.fixture(scope="module")
def fine() -> Template:
    return torso(0.012)


def loops(triangles: np.ndarray) -> list[np.ndarray]:
    """Closed lines of vertices along the border; every border vertex has one successor."""
    edges = border(triangles)
    follows = dict(edges.tolist())
    assert len(follows) == len(edges)
    found = []
    while follows:
        line = [next(iter(follows))]
        while line[-1] in follows:
            line.append(follows.pop(line[-1]))
        assert line[0] == line[-1]
        found.append(np.array(line[:-1]))
    return found


def capped(template: Template) -> tuple[np.ndarray, np.ndarray]:
    """The torso closed by a fan from the middle of each border loop."""
    points, triangles = list(template.points), list(template.triangles)
    for loop in loops(template.triangles):
        points.append(template.points[loop].mean(axis=0))
        triangles += [(b, a, len(points) - 1) for a, b in zip(loop, np.roll(loop, -1), strict=True)]
    return np.array(points), np.array(triangles)


def section(template: Template, height: float) -> np.ndarray:
    """Points (k, 2) m where the edges of the trunk cross a height; the arms left out."""
    arms = template.weights[:, [name.startswith("arm") for name, _ in BONES]].max(axis=1) > 0.1
    edges = template.triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2)
    edges = edges[~arms[edges].any(axis=1)]
    a, b = template.points[edges].transpose(1, 0, 2)
    a, b = (x[(a[:, 2] - height) * (b[:, 2] - height) < 0] for x in (a, b))
    s = (height - a[:, 2]) / (b[:, 2] - a[:, 2])
    return (a + s[:, None] * (b - a))[:, :2]


def tape(points: np.ndarray) -> float:
    """Length of a tape around (k, 2) m: of their convex hull."""
    from scipy.spatial import ConvexHull

    return float(ConvexHull(points).area)


def test_the_skin_is_a_manifold_with_four_openings(template: Template) -> None:
    """Every edge has one or two triangles; one loop each at the neck, the hip and both arms.

    A sphere with four holes has Euler characteristic -2.
    """
    edges = np.sort(template.triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    unique, count = np.unique(edges, axis=0, return_counts=True)
    assert set(count) == {1, 2}
    assert len(template.points) - len(unique) + len(template.triangles) == -2
    middles = np.array([template.points[loop].mean(axis=0) for loop in loops(template.triangles)])
    assert len(middles) == 4
    on_midline = middles[np.abs(middles[:, 0]) < 1e-12]
    assert np.isclose(on_midline[:, 2].min(), WAIST_END, atol=1e-9)
    neck = (on_midline[on_midline[:, 2].argmax()] - body.NECK) @ body.NECK_AXIS
    assert np.isclose(neck, NECK_END, atol=1e-9)


def test_normals_point_outwards_and_the_volume_is_a_womans(template: Template) -> None:
    """Gauss' theorem on the closed torso: 42.6 % (trunk) of 50 to 75 kg at 1.0 to 1.05 kg/l.

    De Leva (1996), J. Biomech. 29, 1223–1230, table 4, females.
    """
    points, triangles = capped(template)
    a, b, c = points[triangles].transpose(1, 0, 2)
    volume = np.einsum("nd,nd->", a, np.cross(b, c)) / 6
    assert 0.426 * 50e-3 / 1.05 < volume < 0.426 * 75e-3, volume
    surface = Surface(template.points, template.triangles)
    middles = template.points[template.triangles].mean(axis=1)
    assert (np.einsum("nd,nd->n", body.normals(middles), surface.normals) > 0.5).all()


def test_both_sides_are_mirror_images_to_the_last_bit(template: Template) -> None:
    """Points, triangles, weights, blendshapes, joints, landmarks and curves."""
    t, m = template, template.mirror
    assert np.array_equal(t.points[m] * FLIP, t.points)
    flipped = np.sort(m[t.triangles], axis=1)
    assert {*map(tuple, flipped)} == {*map(tuple, np.sort(t.triangles, axis=1))}
    swapped = [_other(name) for name, _ in BONES]
    order = [[name for name, _ in BONES].index(name) for name in swapped]
    assert np.array_equal(t.weights[m][:, order], t.weights)
    assert np.array_equal(t.joints[order] * FLIP, t.joints)
    names = list(t.blendshape_names)
    order = [names.index(_other(name)) for name in names]
    assert np.array_equal(t.blendshapes[order][:, m] * FLIP, t.blendshapes)
    landmarks, curves = t.landmark_points(), t.curve_points()
    for name, place in landmarks.items():
        assert np.allclose(landmarks[_other(name)] * FLIP, place, atol=1e-15), name
    assert np.allclose(curves["breast_left"] * FLIP, curves["breast_right"], atol=1e-15)
    for name, region in t.regions.items():
        assert np.array_equal(t.regions[_other(name)][m], region), name


def _other(name: str) -> str:
    stem, _, side = name.rpartition("_")
    return {"left": f"{stem}_right", "right": f"{stem}_left"}.get(side, name)


def test_sizes_are_those_of_an_average_woman(fine: Template) -> None:
    """Within 1.5 standard deviations of the means of 1,986 women in the ANSUR II survey.

    Gordon et al. (2014), Natick/TR-15/007. The waist there is at the navel, so only its upper
    bound is taken; the least girth is at least that of the 5th percentile, 0.65 m.
    """
    bust, fold = section(fine, -0.010), section(fine, -0.085)
    assert abs(tape(bust) - 0.947) < 1.5 * 0.083, tape(bust)
    assert abs(np.ptp(bust[:, 0]) - 0.279) < 1.5 * 0.018
    assert abs(np.ptp(bust[:, 1]) - 0.247) < 1.5 * 0.027
    assert 0.10 < tape(bust) - tape(fold) < 0.22  # cups A to D
    waist = min(tape(section(fine, z)) for z in np.arange(-0.18, -0.08, 0.02))
    assert 0.65 < waist < 0.861 + 0.5 * 0.100, waist
    assert abs(tape(section(fine, WAIST_END + 0.005)) - 1.021) < 1.5 * 0.076
    neck = max(loops(fine.triangles), key=lambda loop: fine.points[loop, 2].mean())
    ends = fine.points[neck]
    girth = np.linalg.norm(ends - np.roll(ends, 1, axis=0), axis=1).sum()
    assert abs(girth - 0.330) < 1.5 * 0.019, girth


def test_breasts_lie_where_surgeons_find_them(template: Template) -> None:
    """Notch to nipple 21 cm, nipple to fold 5 to 9 cm, between nipples 18 to 24 cm.

    Westreich (1997), Plast. Reconstr. Surg. 100, 468–479; Smith et al. (1986), ibid. 78, 331–335.
    """
    at = template.landmark_points()
    assert set(LANDMARKS) <= set(at)
    nipple = at["nipple_left"]
    assert 0.19 < np.linalg.norm(at["sternal_notch"] - nipple) < 0.23
    assert 0.05 < np.linalg.norm(at["breast_inferior_left"] - nipple) < 0.09
    assert 0.18 < 2 * nipple[0] < 0.24
    assert at["breast_medial_left"][0] < nipple[0] < at["breast_lateral_left"][0]
    assert at["breast_lateral_left"][0] < at["axilla_left"][0] + 0.01
    assert nipple[1] < template.points[:, 1].min() + 0.002, "the nipple is foremost"
    assert at["xiphoid"][2] < nipple[2] < at["sternal_notch"][2]


def test_curves_lie_on_the_sternum_and_around_the_breasts(template: Template) -> None:
    """Arrows run from the notch down and from the xiphoid up; a closed outline rings the nipple."""
    at, curves = template.landmark_points(), template.curve_points()
    upper, lower = curves["sternum_arrow_upper"], curves["sternum_arrow_lower"]
    assert np.abs(upper[:12, 0]).max() < 1e-12
    assert np.abs(lower[:12, 0]).max() < 1e-12
    assert (np.diff(upper[:12, 2]) < 0).all()
    assert (np.diff(lower[:12, 2]) > 0).all()
    assert np.linalg.norm(upper[0] - at["sternal_notch"]) < 0.01
    assert np.linalg.norm(lower[0] - at["xiphoid"]) < 0.01
    assert template.curves["breast_left"].closed
    about = (curves["breast_left"] - at["nipple_left"])[:, [0, 2]]
    turns = np.unwrap(np.arctan2(*np.vstack([about, about[:1]]).T))
    assert np.isclose(abs(turns[-1] - turns[0]), 2 * np.pi)
    for part in (*template.curves.values(), *template.landmarks.values()):
        assert np.allclose(part.barycentric.sum(axis=1), 1, atol=1e-12)
        assert part.barycentric.min() >= 0


@pytest.mark.parametrize("spacing", [0.032, 0.024, 0.017])
def test_triangles_are_good_at_any_spacing(spacing: float) -> None:
    """Quality 4 √3 area / Σ edge²: 1 if equilateral."""
    made = torso(spacing)
    corners = made.points[made.triangles]
    edges = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2)
    area = Surface(made.points, made.triangles).areas
    quality = 4 * np.sqrt(3) * area / (edges**2).sum(axis=1)
    assert quality.min() > 0.3, quality.min()
    assert quality.mean() > 0.93


def test_triangles_are_finer_on_the_breasts(template: Template) -> None:
    """Edges of the breasts are at most 0.8 of the back's."""
    corners = template.points[template.triangles]
    edges = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2)
    on = {name: edges[mask[template.triangles].all(axis=1)].mean()
          for name, mask in template.regions.items()}  # fmt: skip
    assert on["breast_left"] < 0.8 * on["back"], on


def test_weights_are_local_and_follow_the_anatomy(template: Template) -> None:
    """A breast moves at its nipple with its bone, an arm at its end, the neck at its top."""
    weights = template.weights
    names = [name for name, _ in BONES]
    nearest = np.linalg.norm(
        template.points - template.landmark_points()["nipple_left"], axis=1
    ).argmin()
    assert weights[nearest, names.index("breast_left")] > 0.9
    for part, region in (("neck", "neck"), ("arm_left", "arm_left"), ("arm_right", "arm_right")):
        loop = [line for line in loops(template.triangles)
                if template.regions[region][line].all()]  # fmt: skip
        assert len(loop) == 1
        assert weights[loop[0], names.index(part)].min() > 0.95, part
    on_left = template.points[:, 0] > 0
    right = [k for k, name in enumerate(names) if name.endswith("right")]
    assert (weights[on_left][:, right] == 0).all()
    hip = template.points[:, 2] < -0.2
    assert (weights[hip, names.index("abdomen")] > 0.999).all()


def test_weights_are_smooth(template: Template) -> None:
    """No bone's weight jumps by more than 0.5 over an edge."""
    edges = template.triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2)
    a, b = template.weights[edges].transpose(1, 0, 2)
    assert np.abs(a - b).max() < 0.5


def test_joints_lie_inside(template: Template) -> None:
    """The solid angle of the closed torso seen from each joint is 4 π (van Oosterom's formula)."""
    points, triangles = capped(template)
    for joint in template.joints:
        a, b, c = (points[triangles] - joint).transpose(1, 0, 2)
        x, y, z = (np.linalg.norm(v, axis=1) for v in (a, b, c))
        top = np.einsum("nd,nd->n", a, np.cross(b, c))
        dots = [np.einsum("nd,nd->n", v, w) * r for v, w, r in ((a, b, z), (a, c, y), (b, c, x))]
        angle = 2 * np.arctan2(top, x * y * z + sum(dots)).sum()
        assert np.isclose(angle, 4 * np.pi, atol=1e-6), joint


def test_it_is_made_in_less_than_a_second_and_always_the_same(template: Template) -> None:
    """Bit for bit; CPU time, so that other work on the machine does not count."""
    start = time.process_time()
    again = torso()
    assert time.process_time() - start < 1.0
    for name in ("points", "triangles", "weights", "blendshapes", "mirror"):
        assert np.array_equal(getattr(again, name), getattr(template, name)), name
    assert 2000 <= len(template.points) <= 2400


@pytest.mark.parametrize("spacing", [0.0, -0.01, 0.1, np.nan])
def test_a_spacing_that_makes_no_torso_is_refused(spacing: float) -> None:
    with pytest.raises(InputError, match="spacing"):
        torso(spacing)


def test_ctrl_c_still_reaches_python() -> None:
    """Mmg's own handler would end the process."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)  # which a shell's "&" ignores
    try:
        torso(0.036)
        with pytest.raises(KeyboardInterrupt):
            signal.raise_signal(signal.SIGINT)
    finally:
        signal.signal(signal.SIGINT, before)
