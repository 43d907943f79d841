"""A mesh lies in itself or it does not, by construction."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

import supple
from supple import overlap
from supple.box_pairs import meeting
from supple.kernels.cells import ELEMENTS


def pair(shift, element="P1", cells=(2, 2, 2), other=None, size=(1.0, 1.0, 1.0)):
    """A unit cube and a second box, of its own cells, as one mesh of two parts."""
    one = supple.Mesh.box(cells, (1.0, 1.0, 1.0), element)
    two = supple.Mesh.box(other or cells, size, element, shift)
    cells = np.vstack([one.cells, two.cells + len(one.points)])
    return supple.Mesh(np.vstack([one.points, two.points]), cells, element)


def wound(turns, element):
    """A bar bent to a ring of inner radius 0.25 m: past one turn its ends are in one place."""
    bar = supple.Mesh.box((24, 2, 2), (1.0, 0.1, 0.1), element)
    angle, r = 2 * np.pi * turns * bar.points[:, 0], 0.25 + bar.points[:, 1]
    ring = np.column_stack([r * np.sin(angle), r * np.cos(angle), bar.points[:, 2]])
    return bar, bar.moved(ring)


@pytest.mark.parametrize("element", ELEMENTS)
def test_a_ring_that_is_wound_too_far_overlaps_at_its_ends(element):
    """0.95 turns leave a gap; at 1.1 the cells of the first and last tenth are in one place."""
    assert not len(overlap.overlapping(wound(0.95, element)[1]))
    bar, ring = wound(1.1, element)
    cells = np.unique(overlap.owners(ring)[overlap.overlapping(ring)])
    middles = bar.points[bar.cells[cells]].mean(axis=1)[:, 0]
    from_end = np.minimum(middles, 1 - middles)
    assert len(cells)
    assert from_end.max() < 0.1 / 1.1 + 1 / 24
    for end in (middles < 0.5, middles > 0.5):
        assert (from_end[end] < 1 / 24).any()


@pytest.mark.parametrize("element", ["P1", "Q1", "P2"])
@pytest.mark.parametrize(
    "shift", [(1.0, 0.0, 0.0), (1.0, 0.3, 0.2), (1.0, 1.0, 0.0), (1.0, 1.0, 1.0), (1 - 1e-9, 0, 0)]
)
def test_parts_that_touch_at_faces_edges_or_corners_do_not_overlap(element, shift):
    """Aligned or not, with the same cells or others, and in each other by rounding."""
    for other in ((2, 2, 2), (3, 4, 1)):
        assert not len(overlap.overlapping(pair(shift, element, other=other)))


@pytest.mark.parametrize("shift", [(0.5, 0.0, 0.0), (0.9, 0.0, 0.0), (1 - 1e-4, 0.0, 0.0)])
def test_parts_in_each_other_overlap_even_where_no_edge_pierces_a_face(shift):
    """All edges of the shifted cube lie in the planes of the other's faces, or cross its edges."""
    assert len(overlap.overlapping(pair(shift)))


def test_a_part_within_another_overlaps_without_touching_its_boundary():
    """Named are the facets of the inner box: just below them the place is covered twice."""
    mesh = pair((0.25, 0.25, 0.25), size=(0.4, 0.4, 0.4))
    inner = np.flatnonzero(mesh.boundary().min(axis=1) >= 27)  # the cube has 27 nodes
    np.testing.assert_array_equal(overlap.overlapping(mesh), inner)


def test_a_spike_through_a_face_names_spike_and_face():
    """A thin box through the middle of a face, all of its sampled places outside the cube."""
    mesh = pair((0.9, 0.52, 0.27), other=(1, 1, 1), size=(1.0, 0.05, 0.05))
    rows = overlap.overlapping(mesh)
    middles = mesh.points[mesh.boundary()[rows]].mean(axis=1)
    assert (np.isclose(middles[:, 0], 1.0)).any()  # of the face
    assert (middles[:, 0] > 1.1).any()  # of the spike


def test_how_often_a_surface_encloses_a_place():
    """Outside 0, in one cube 1, in both 2, also where rays meet edges and corners of the mesh."""
    mesh = pair((0.5, 0.0, 0.0))
    grid = np.linspace(0.125, 0.875, 4)
    places = np.stack(np.meshgrid(2 * grid - 0.5, grid, grid), axis=-1).reshape(-1, 3)
    expected = sum(((places[:, 0] > x) & (places[:, 0] < x + 1)).astype(int) for x in (0.0, 0.5))
    expected[(places[:, 0] < 0) | (places[:, 0] > 1.5)] = 0
    triangles, _ = overlap.triangles_of(mesh.boundary(), mesh.table)
    np.testing.assert_array_equal(overlap.windings(mesh.points, triangles, places), expected)


def test_meeting_boxes_are_those_of_every_pair_compared():
    """Against all pairs, for boxes of very different sizes, in two and three dimensions."""
    rng = np.random.default_rng(0)
    for dim in (2, 3):
        low = [rng.uniform(-1, 1, (n, dim)) for n in (200, 150)]
        high = [x + rng.exponential(0.1, x.shape) ** 2 * 5 for x in low]
        i, j = meeting(low[0], high[0], low[1], high[1])
        met = (low[0][:, None] <= high[1]) & (low[1] <= high[0][:, None])
        expected = np.argwhere(met.all(axis=2))
        np.testing.assert_array_equal(sorted(zip(i, j, strict=True)), expected)


def test_a_rest_shape_that_overlaps_itself_is_refused_where_asked():
    """Each node of a ring of 0.9 turns is prescribed to come from one of 1.1 turns.

    So the rest shape is known; its cells are positive, and its ends are in one place.
    """
    _, loaded = wound(0.9, "P1")
    _, rest = wound(1.1, "P1")
    body = supple.Body(loaded, "neo_hookean", young=1e3, poisson=0.3)
    body.prescribe(np.arange(len(loaded.points)), loaded.points - rest.points)
    assert len(overlap.overlapping(body.rest_shape(load_steps=8).mesh))
    with pytest.raises(supple.ConvergenceError, match="rest shape overlaps itself") as caught:
        body.rest_shape(load_steps=8, check_overlap=True)
    np.testing.assert_allclose(caught.value.points, rest.points, atol=1e-12)
    assert set(caught.value.cells) <= set(range(len(rest.cells)))
    assert len(caught.value.cells)


def test_a_given_shape_that_overlaps_is_not_held_against_its_rest_shape():
    """Two boxes in each other stay as they are: both shapes overlap at the same facets."""
    mesh = pair((0.9, 0.0, 0.0))
    body = supple.Body(mesh, "neo_hookean", young=1e3, poisson=0.3)
    body.prescribe(np.arange(len(mesh.points)), (0.0, 0.0, 0.0))
    assert len(overlap.overlapping(body.rest_shape(check_overlap=True).mesh))


@pytest.mark.parametrize("element", ELEMENTS)
def test_no_cell_of_a_sound_mesh_is_turned_over(element):
    assert not len(overlap.turned_over(supple.Mesh.box((2, 3, 2), (1.0, 1.0, 1.0), element)))


def test_a_cell_on_its_neighbours_side_is_named():
    """A block's first cell mirrored in the block's own face, its nodes reordered to be positive.

    It leaves three facets of its neighbours open and shares one, from the same side; so does that
    neighbour, which shares others too.
    """
    mesh = supple.Mesh.box((2, 2, 2), (1.0, 1.0, 1.0))
    uses = [np.isin(mesh.cells, face).sum(axis=1) == 3 for face in itertools.combinations(
        mesh.cells[0], 3)]  # fmt: skip
    inner = next(k for k, mask in enumerate(uses) if mask.sum() == 2)
    face = np.array(list(itertools.combinations(mesh.cells[0], 3))[inner])
    (apex,) = np.setdiff1d(mesh.cells[0], face)
    a, b, c = mesh.points[face]
    normal = np.cross(b - a, c - a) / np.linalg.norm(np.cross(b - a, c - a))
    away = (mesh.points[apex] - a) @ normal
    points = np.vstack([mesh.points, mesh.points[apex] - 1.9 * away * normal])
    cell = [*face, len(mesh.points)] if away < 0 else [*face[::-1], len(mesh.points)]
    turned = supple.Mesh(points, np.vstack([[cell], mesh.cells[1:]]), "P1")
    assert 0 in overlap.turned_over(turned)
    assert len(overlap.overlapping(turned))


def test_a_mesh_given_in_itself_is_told_of_by_its_rest_shape():
    """Two blocks pushed into each other, held apart from each other: no refusal, a warning."""
    one = supple.Mesh.box((1, 1, 2), (0.02, 0.02, 0.04), "P1")
    points = np.vstack([one.points, np.add(one.points, (0.005, 0.003, 0.001))])
    mesh = supple.Mesh(points, np.vstack([one.cells, one.cells + len(one.points)]), "P1")
    body = supple.Body(mesh, "neo_hookean", density=1000.0, young=3e3, poisson=0.3)
    body.fix(lambda p: p[:, 2] > 0.0395).gravity((0.0, 0.0, -1.0))
    assert not body.rest_shape().warnings
    (warning,) = body.rest_shape(check_overlap=True).warnings
    assert "given mesh overlaps itself" in warning
