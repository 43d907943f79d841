"""Measures of bodies whose volumes, distances and spread are known without the code."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from supple import MeshError
from supple.registration.breast_patch import breast_patch, volumes
from supple.registration.geodesic import Ways, length
from supple.registration.measures import SIDES, grade, measured
from supple.registration.posture import Posture, posed
from supple.registration.spread import axes, posed_many

from .plate import RADIUS, cap, cap_volume, plate

HEIGHT = 0.03


def smooth(r):
    """A bump without a kink at its foot, of volume π h a² (1/2 - 2/π²)."""
    return np.where(r < RADIUS, HEIGHT * np.cos(np.pi * r / 2 / RADIUS) ** 2, 0.0)


SMOOTH_VOLUME = np.pi * HEIGHT * RADIUS**2 * (0.5 - 2 / np.pi**2)


@pytest.fixture(scope="module")
def torso():
    """A small and a large smooth bump on a bent chest."""
    return plate(24, lambda r: 1.3 * smooth(r), smooth, bend=3.0)


@pytest.fixture(scope="module")
def found(torso):
    return measured(torso, Posture.rest(torso), torso.points)


def test_volume_of_a_spherical_cap_on_a_plane_converges_at_order_2():
    """π h (3 a² + h²) / 6; a mesh of chords is inside of it by h², the wall is the plane."""
    errors = []
    for cells in (20, 40, 80):
        torso = plate(cells, cap(HEIGHT), cap(HEIGHT))
        patch = breast_patch(torso, "left")
        errors.append(float(volumes(patch, torso.points)) / cap_volume(HEIGHT) - 1)
    assert abs(errors[2]) < 5e-3, errors
    assert abs(errors[0]) / abs(errors[2]) > 12, errors


def test_the_chest_wall_is_the_soap_film_of_the_outline():
    """A bump on the chest y = k x² / 2: its volume, and what is between the film and the chest.

    With s along the outline's tilted plane, c its cosine, the outline is an ellipse, on which the
    film is A + B (s² - z²): B = k c² / (2 (1 + c²)), A = B a². Its integral less the chest's over
    the disc is A π a² + B π a⁴ / 4 (1/c² - 1) - k π a⁴ / 8; k π a⁴ / 8 where the plane is not
    tilted.
    """
    k, a = 4.0, RADIUS
    c2 = 1 / (1 + (0.08 * k) ** 2)
    B = k * c2 / (2 * (1 + c2))
    film = B * np.pi * a**4 + B * np.pi * a**4 / 4 * (1 / c2 - 1) - k * np.pi * a**4 / 8
    torso = plate(60, smooth, smooth, bend=k)
    found = float(volumes(breast_patch(torso, "right"), torso.points))
    assert found == pytest.approx(SMOOTH_VOLUME + film, rel=4e-3)


def test_a_mirrored_body_has_no_asymmetry():
    torso = plate(32, smooth, smooth, bend=3.0)
    found = measured(torso, Posture.rest(torso), torso.points)
    assert abs(found.of("volume_difference").value) < 1e-9
    assert abs(found.of("nipple_height_difference").value) < 1e-9
    assert found.of("mirrored_rms").value < 1e-9
    for name in ("volume", "projection", "base_width", "nipple_notch", "nipple_midline"):
        left, right = (found.of(name, side).value for side in SIDES)
        assert left == pytest.approx(right, rel=1e-9)


def test_twice_the_size_is_eight_times_the_volume_and_twice_every_length(torso, found):
    double = measured(torso, Posture.rest(torso), 2 * torso.points)
    for row, other in zip(found.rows, double.rows, strict=True):
        power = {"ml": 3, "mm": 1, "%": 0}[row.unit]
        assert other.value == pytest.approx(2**power * row.value, rel=1e-6, abs=1e-6), row.name


def test_measures_do_not_change_when_the_patient_is_turned_and_moved(torso, found, rotation):
    moved = Posture.rest(torso).moved(rotation, np.array([0.5, -2.0, 0.3]), torso.joints)
    again = measured(torso, moved, posed(torso, moved))
    for row, other in zip(found.rows, again.rows, strict=True):
        assert other.value == pytest.approx(row.value, rel=1e-6, abs=1e-6), row.name
    assert again.ptosis == found.ptosis


def test_distances_are_those_of_the_plane():
    """Flat plate: nipples at (±80, 0), notch at (0, 100), fold 60 mm below: Pythagoras."""
    flat = plate(32, *[lambda r: 1e-9 * (r < RADIUS)] * 2)
    found = measured(flat, Posture.rest(flat), flat.points)
    for side in SIDES:
        of = {name: found.of(name, side).value for name in
              ("nipple_notch", "nipple_notch_skin", "nipple_midline", "nipple_fold", "ptosis",
               "nipple_fold_skin", "base_width", "base_height")}  # fmt: skip
        assert of["nipple_notch"] == pytest.approx(np.hypot(80, 100), abs=1e-6)
        assert of["nipple_notch_skin"] == pytest.approx(np.hypot(80, 100), rel=2e-3)
        assert of["nipple_midline"] == pytest.approx(80, abs=1e-6)
        assert of["nipple_fold"] == pytest.approx(60, abs=1e-6)
        assert of["nipple_fold_skin"] == pytest.approx(60, rel=2e-3)
        assert of["ptosis"] == pytest.approx(-60, abs=1e-6)
        assert of["base_width"] == pytest.approx(120, abs=0.5)
        assert of["base_height"] == pytest.approx(120, abs=0.5)


def test_projection_is_the_height_over_the_chest():
    found = (lambda t: measured(t, Posture.rest(t), t.points))(plate(32, cap(0.04), cap(0.02)))
    assert found.of("projection", "left").value == pytest.approx(40, rel=0.01)
    assert found.of("projection", "right").value == pytest.approx(20, rel=0.01)


def test_the_way_along_a_bent_sheet_is_straight_when_unrolled():
    """The sheet unrolls: the way from nipple to notch is the chord across the unrolled one.

    The parabola y = k x² / 2 is x/2 √(1 + k² x²) + asinh(k x) / (2 k) long.
    """
    k, x = 5.0, 0.08
    torso = plate(40, *[lambda r: 0 * r] * 2, bend=k)
    marks = torso.landmarks
    ways = Ways(torso.points, torso.triangles)
    way = ways.shortest(marks["nipple_left"], marks["sternal_notch"])
    chord = np.hypot(x / 2 * np.sqrt(1 + (k * x) ** 2) + np.arcsinh(k * x) / (2 * k), 0.1)
    assert float(length(torso.points, torso.triangles, way)) == pytest.approx(chord, rel=1e-3)
    ends = way.at(torso.points, torso.triangles)[[0, -1]]
    expected = [torso.landmark_points()[name] for name in ("nipple_left", "sternal_notch")]
    assert np.abs(ends - expected).max() < 1e-12


def test_no_way_leads_over_a_gap():
    torso = plate(20)
    apart = torso.triangles[~(np.abs(torso.points[torso.triangles][..., 0]) < 0.012).any(axis=1)]
    ways = Ways(torso.points, apart)
    from supple.registration.template import OnSurface

    left, right = (OnSurface(np.array([np.argmax(sign * torso.points[apart][:, 0, 0])]),
                             np.ones((1, 3)) / 3) for sign in (1, -1))  # fmt: skip
    with pytest.raises(MeshError, match="do not touch"):
        ways.shortest(left, right)


def test_the_outline_must_go_around_its_nipple():
    torso = plate(20)
    curves = dict(torso.curves)
    curves["breast_left"] = torso.curves["sternum_arrow_upper"]
    with pytest.raises(MeshError, match="breast_left"):
        breast_patch(replace(torso, curves=curves), "left")


@pytest.mark.parametrize(
    ("ptosis", "overhang", "expected"),
    [(-30, 0, "none"), (-30, 15, "pseudoptosis"), (0, 0, "1"), (-9, 20, "1"), (9, 40, "1"),
     (20, 40, "2"), (20, 25, "3"), (35, 60, "3")],
)  # fmt: skip
def test_ptosis_is_graded_as_regnault_does(ptosis, overhang, expected):
    """Minor at the level of the fold, moderate below it, major at the lowest contour."""
    assert grade(1e-3 * ptosis, 1e-3 * overhang) == expected


def test_a_standard_deviation_is_the_blendshapes_times_its_slope(torso):
    """A coefficient of sd s adds a tenth of a bump: the volume's sd is s V / 10, on its side."""
    unknowns = 9 * len(torso.bones) + 2
    covariance = np.zeros((unknowns, unknowns))
    covariance[-2, -2] = 0.5**2
    rest = Posture.rest(torso)
    found = measured(torso, rest, torso.points, covariance)
    assert found.of("volume", "left").sd == pytest.approx(
        0.5e6 * 1.3 * SMOOTH_VOLUME / 10, rel=0.02
    )
    assert found.of("volume", "right").sd == pytest.approx(0, abs=1e-9)
    ahead = 0.5e3 * 1.3 * HEIGHT / 10 / np.hypot(1, 3.0 * 0.08)  # across the chest's slope
    assert found.of("projection", "left").sd == pytest.approx(ahead, rel=0.01)
    assert found.of("volume_difference").sd == pytest.approx(found.of("volume", "left").sd)


def test_the_spread_is_that_of_random_postures(torso):
    """1,000 postures drawn from the covariance, measured one by one: sds within 10 %."""
    rng = np.random.default_rng(5)
    unknowns = 9 * len(torso.bones) + 2
    root = rng.normal(size=(unknowns, unknowns)) * 3e-4
    root[-2:] *= 300
    covariance = root @ root.T
    rest = Posture.rest(torso)
    found = measured(torso, rest, torso.points, covariance)
    steps = rng.multivariate_normal(np.zeros(unknowns), covariance, size=1000)
    at, _ = posed_many(torso, [rest.stepped(step) for step in steps])
    patch = breast_patch(torso, "left")
    drawn = 1e6 * volumes(patch, at)
    assert drawn.std() == pytest.approx(found.of("volume", "left").sd, rel=0.1)
    marks = torso.landmarks
    place = [np.einsum("c,scd->sd", marks[name].barycentric[0],
                       at[:, torso.triangles[marks[name].triangle[0]]])
             for name in ("nipple_left", "sternal_notch")]  # fmt: skip
    drawn = 1e3 * np.linalg.norm(place[0] - place[1], axis=1)
    assert drawn.std() == pytest.approx(found.of("nipple_notch", "left").sd, rel=0.1)


def test_offsets_along_the_normals_spread_as_independent_ones_do():
    """Flat plate, offsets of sd s at each vertex: a nipple on a vertex is s from the chest wall.

    The wall there is a mean of many, so its own part is small; the draws are within 10 %.
    """
    from scipy.sparse import eye_array

    flat = plate(32, *[lambda r: 5e-3 * (1 - r / RADIUS) * (r < RADIUS)] * 2)
    n, unknowns = len(flat.points), 9 * len(flat.bones) + 2
    s = 1e-4
    found = measured(flat, Posture.rest(flat), flat.points, np.zeros((unknowns, unknowns)),
                     eye_array(n).tocsr() / s**2)  # fmt: skip
    nipple = flat.landmarks["nipple_left"]
    share = np.sqrt((nipple.barycentric[0] ** 2).sum())
    assert found.of("projection", "left").sd == pytest.approx(1e3 * s * share, rel=0.15)


def test_the_axes_of_a_covariance_sum_to_it():
    rng = np.random.default_rng(2)
    root = rng.normal(size=(8, 5)) * np.logspace(-4, 2, 8)[:, None]
    steps = axes(root @ root.T, 8)
    assert len(steps) == 5
    assert np.allclose(steps.T @ steps, root @ root.T, rtol=1e-9)


@pytest.mark.parametrize("shapes", [2, 0])
def test_many_postures_are_posed_as_one_is(torso, shapes):
    torso = replace(torso, blendshapes=torso.blendshapes[:shapes],
                    blendshape_names=torso.blendshape_names[:shapes],
                    blendshape_bounds=torso.blendshape_bounds[:shapes])  # fmt: skip
    rng = np.random.default_rng(0)
    steps = 0.1 * rng.normal(size=(3, 9 * len(torso.bones) + shapes))
    postures = [Posture.rest(torso).stepped(step) for step in steps]
    many, rotations = posed_many(torso, postures)
    for at, turned, posture in zip(many, rotations, postures, strict=True):
        assert np.abs(at - posed(torso, posture)).max() < 1e-14
        assert np.array_equal(turned, posture.rotations)
