"""The synthetic patient: what its files hold is what its geometry and its truth say."""

from __future__ import annotations

import numpy as np
import pytest

from supple.breast.phantom import (
    SIZES,
    Solved,
    field_of_view,
    view_prone,
)
from supple.breast.phantom_image import draw_labels
from supple.breast.phantom_mechanics import moduli
from supple.breast.phantom_mesh import Box, make_box
from supple.breast.phantom_patient import Patient, draw_patient
from supple.breast.phantom_raster import Grid, paint
from supple.breast.phantom_skin import sample_skin, voxelise
from supple.breast.phantom_tumour import Poses, Tumour, place_tumour
from supple.breast.tissues import BREAST, Tissue

SMALL = SIZES["small"]
CORNERS = np.array(
    [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 0, 1], [1, 0, 1], [1, 1, 1], [0, 1, 1]]
)


def jacobians(points: np.ndarray, cells: np.ndarray, at: np.ndarray) -> np.ndarray:
    """(q, cells): det of the trilinear map of each hexahedron at local points (q, 3) in [0, 1]."""
    found = []
    for xi in at:
        factors = np.where(CORNERS == 1, xi, 1.0 - xi)
        slopes = [
            np.where(CORNERS[:, i] == 1, 1.0, -1.0) * np.delete(factors, i, axis=1).prod(axis=1)
            for i in range(3)
        ]
        found.append(np.linalg.det(np.einsum("cni,bn->cib", points[cells], np.array(slopes))))
    return np.array(found)


def gauss_volume(points: np.ndarray, cells: np.ndarray) -> float:
    """Volume of trilinear hexahedra; 2 x 2 x 2 Gauss points are exact for it."""
    ends = 0.5 + np.array([-0.5, 0.5]) / np.sqrt(3.0)
    at = np.stack(np.meshgrid(ends, ends, ends), axis=-1).reshape(-1, 3)
    return float(jacobians(points, cells, at).sum() / 8.0)


def hang(patient: Patient, box: Box, ahead: float, aside: float) -> np.ndarray:
    """An analytic pose: every breast shifted in proportion to its height, the chest wall fixed."""
    zeta = box.zeta
    points = patient.anatomy.rest(zeta)
    for dome in patient.anatomy.domes:
        share = zeta[:, 2] * dome.profile(zeta[:, 0], zeta[:, 1])
        points += share[:, None] * np.array([np.sign(dome.azimuth) * aside, -ahead, 0.0])
    return points


def deform(seed: int) -> Solved:
    """A patient with analytic instead of solved poses."""
    rng = np.random.default_rng(seed)
    patient = draw_patient(rng)
    box = make_box(patient.anatomy, SMALL.cells)
    poses = Poses(box, hang(patient, box, 0.022, 0.0), hang(patient, box, -0.022, 0.012))
    tumour = place_tumour(patient, poses, rng)
    assert tumour is not None
    return Solved(patient, poses, tumour, {})


@pytest.fixture(scope="module")
def solved() -> Solved:
    return deform(3)


@pytest.mark.parametrize("size", SIZES)
@pytest.mark.parametrize("seed", range(12))
def test_rest_shape_has_positive_jacobians_at_every_corner(seed: int, size: str) -> None:
    """The determinant of a trilinear map at corners, centre and edges' middles stays above 0."""
    patient = draw_patient(np.random.default_rng(seed))
    box = make_box(patient.anatomy, SIZES[size].cells)
    at = np.stack(np.meshgrid(*[[0.0, 0.5, 1.0]] * 3), axis=-1).reshape(-1, 3)
    least = jacobians(patient.anatomy.rest(box.zeta), box.hexahedra, at)
    assert (least.min(axis=0) > 0.1 * least.max(axis=0)).all()


def test_tetrahedra_fill_an_affine_box_exactly() -> None:
    """Six tetrahedra a hexahedron add up to det A times the box, all of one orientation."""
    box = Box((np.linspace(0, 2, 4), np.linspace(0, 1, 3), np.linspace(0, 3, 5)))
    matrix = np.array([[1.0, 0.2, 0.1], [0.0, 0.9, 0.3], [-0.1, 0.0, 1.2]])
    corners = (box.zeta @ matrix.T)[box.tetrahedra]
    volumes = np.linalg.det(corners[:, 1:] - corners[:, :1]) / 6.0
    assert (volumes > 0).all()
    assert volumes.sum() == pytest.approx(6.0 * np.linalg.det(matrix), rel=1e-12)


def test_paint_inverts_an_affine_map() -> None:
    """Painted coordinates are A^-1 x at each voxel's centre; exactly the voxels inside appear."""
    box = Box((np.linspace(0, 1, 4), np.linspace(0, 1, 3), np.linspace(0, 1, 5)))
    matrix = np.array([[8.0, 1.3, -0.7], [0.4, 7.1, 1.9], [-1.1, 0.6, 9.3]])
    shift = np.array([2.123, 3.217, 2.411])
    grid = Grid(np.zeros(3), np.array([0.5, 0.4, 0.7]), (22, 40, 36))
    flat, zeta = paint(grid, box.zeta @ matrix.T + shift, box.tetrahedra, box.zeta)
    every = grid.centres(np.arange(np.prod(grid.shape)))
    expected = np.linalg.solve(matrix, (every - shift).T).T
    inside = np.flatnonzero(((expected > 0) & (expected < 1)).all(axis=1))
    assert np.array_equal(flat, inside)
    assert np.abs(zeta - expected[inside]).max() < 1e-12


def test_distance_to_a_tilted_plane_skin_is_exact() -> None:
    """A sheared box has a plane skin; signed distances are those to that plane."""
    box = Box((np.linspace(-3, 3, 4), np.linspace(-3, 3, 4), np.linspace(0, 1, 3)))
    points = box.zeta @ np.array([[1.0, 0.0, 0.3], [0.0, 1.0, -0.2], [0.0, 0.0, 1.0]])
    grid = Grid(np.array([-1.0, -1.0, 0.0]), np.array([0.1, 0.1, 0.1]), (25, 21, 21))
    voxels = voxelise(grid, box, points, sample_skin(box, points, 30), reach=0.3)
    normal = np.array([-0.3, 0.2, 1.0]) / np.linalg.norm([-0.3, 0.2, 1.0])
    exact = (grid.centres(voxels.flat) - points[box.skin[0, 0]]) @ normal
    near = np.abs(voxels.outside) < 0.25
    assert (voxels.outside > 0).any()
    assert np.abs(voxels.outside - exact)[near].max() < 1e-12


def test_rigid_motion_of_the_patient_is_aligned_away(solved: Solved) -> None:
    """After the best rigid alignment nothing of a purely rigid motion is left."""
    poses, move = solved.poses, solved.patient.misalignment
    moved = Poses(poses.box, poses.prone, move.apply(poses.prone))
    zeta = poses.box.samples(1).reshape(-1, 3)[::50]
    assert moved.motion(zeta).min() > 1e-3
    assert moved.motion_after_alignment(zeta).max() < 1e-12


def test_labels_hold_the_volume_of_the_deformed_mesh(solved: Solved) -> None:
    """From rest to prone, body voxels grow by as much as the mesh does by Gauss quadrature."""
    patient, box = solved.patient, solved.poses.box
    grid = field_of_view(solved.poses, SMALL)
    rest = Poses(box, patient.anatomy.rest(box.zeta), solved.poses.supine)
    counts, volumes = [], []
    for poses in (rest, solved.poses):
        labels = draw_labels(view_prone(Solved(patient, poses, solved.tumour, {}), grid))
        counts.append(np.isin(labels, BREAST).sum())
        volumes.append(gauss_volume(poses.prone, box.hexahedra))
    grown = (counts[1] - counts[0]) * grid.spacing.prod()
    assert grown == pytest.approx(volumes[1] - volumes[0], rel=5e-3)


def test_painted_voxels_hold_the_volume_of_the_whole_mesh(solved: Solved) -> None:
    """With all of the mesh in view, voxels add up to its volume by Gauss quadrature."""
    points, box = solved.poses.prone, solved.poses.box
    low, high = points.min(axis=0), points.max(axis=0)
    shape = np.array([190, 150, 220])  # so that the flat top and bottom fall between voxels
    grid = Grid(low + (high - low) / shape[::-1] / 2, (high - low) / shape[::-1], tuple(shape))
    fine, nodes = box.refined(points, 4)
    flat, _ = paint(grid, nodes, fine.tetrahedra, fine.zeta)
    counted = flat.size * grid.spacing.prod()
    assert counted == pytest.approx(gauss_volume(points, box.hexahedra), rel=2e-4)


@pytest.mark.parametrize("seed", range(3))
def test_air_body_and_chest_are_one_piece_each(seed: int) -> None:
    """No gap opens between mesh and wall: each of the three is connected, face to face."""
    from scipy.ndimage import label

    solved = deform(seed)
    labels = draw_labels(view_prone(solved, field_of_view(solved.poses, SMALL)))
    for codes in ([Tissue.AIR], BREAST, [Tissue.CHEST]):
        _, pieces = label(np.isin(labels, codes))
        assert pieces == 1, codes


def test_moduli_are_those_of_the_linear_solid(solved: Solved) -> None:
    """At small strain 2 (c1 + c2) = E / 2(1 + nu), bulk = E / 3(1 - 2 nu), E of the tissues."""
    tissues = solved.patient.tissues
    found = moduli(solved.patient, solved.poses.box, solved.tumour)
    young = found["bulk"] * 3.0 * (1.0 - 2.0 * tissues.poisson)
    shear = 2.0 * (found["c1"] + found["c2"])
    assert np.allclose(shear, young / (2.0 * (1.0 + tissues.poisson)), rtol=1e-12)
    assert young.min() == pytest.approx(tissues.fat)
    assert tissues.gland < young.max() < tissues.tumour


def test_misalignment_is_a_rotation_within_its_limits() -> None:
    """R is orthogonal with det +1 and turns by its angle, at most 20 degrees; t at most 100 mm."""
    for seed in range(50):
        move = draw_patient(np.random.default_rng(seed)).misalignment
        assert np.allclose(move.rotation @ move.rotation.T, np.eye(3), atol=1e-14)
        assert np.linalg.det(move.rotation) == pytest.approx(1.0)
        assert np.trace(move.rotation) == pytest.approx(1.0 + 2.0 * np.cos(move.angle))
        assert np.rad2deg(move.angle) <= 20.0
        assert np.linalg.norm(move.translation) <= 0.1


def test_tumour_far_away_from_a_point_is_clipped() -> None:
    """Depth in the ball is radius - distance near it and -radius far from it."""
    patient = draw_patient(np.random.default_rng(1))
    zeta = np.array([patient.anatomy.domes[1].azimuth, 0.0, 0.5])
    tumour = Tumour(zeta, patient.anatomy.rest(zeta), 6e-3)
    far = zeta * np.array([-1.0, 1.0, 1.0])
    assert tumour.depth(patient.anatomy, np.stack([zeta, far])) == pytest.approx([6e-3, -6e-3])
