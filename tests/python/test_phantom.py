"""The synthetic patient: what its files hold is what its geometry and its truth say."""

from __future__ import annotations

import json
import tomllib
from pathlib import Path

import numpy as np
import pytest
import SimpleITK as sitk

from supple.breast import phantom
from supple.breast.phantom import SIZES, PatientFiles, Size, Solved, view_prone, write_patient
from supple.breast.phantom_image import SIGNAL, draw_labels
from supple.breast.phantom_mechanics import moduli
from supple.breast.phantom_mesh import Box, make_box
from supple.breast.phantom_patient import Patient, draw_patient
from supple.breast.phantom_raster import Grid, paint
from supple.breast.phantom_scan import make_scan
from supple.breast.phantom_skin import sample_skin, voxelise
from supple.breast.phantom_tumour import Poses, Tumour, place_tumour
from supple.breast.tissues import BREAST, Tissue
from supple.errors import InputError

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


def deform(seed: int, size: Size = SMALL) -> Solved:
    """A patient with analytic instead of solved poses."""
    rng = np.random.default_rng(seed)
    patient = draw_patient(rng)
    box = make_box(patient.anatomy, size.cells)
    poses = Poses(box, hang(patient, box, 0.022, 0.0), hang(patient, box, -0.022, 0.012))
    tumour = place_tumour(patient, poses, rng)
    assert tumour is not None
    return Solved(patient, poses, tumour, {})


@pytest.fixture(scope="module")
def solved() -> Solved:
    return deform(3)


@pytest.fixture(scope="module")
def files(solved: Solved, tmp_path_factory: pytest.TempPathFactory) -> PatientFiles:
    folder = tmp_path_factory.mktemp("patient")
    return write_patient(solved, SMALL, np.random.default_rng(5), folder, {"seed": 3})


@pytest.fixture(scope="module")
def truth(files: PatientFiles) -> dict:
    return json.loads(files.truth.read_text())


def read_ply(path: Path) -> tuple[np.ndarray, np.ndarray]:
    import meshio

    mesh = meshio.read(path)
    return np.asarray(mesh.points, dtype=float), mesh.cells_dict["triangle"]


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
    """Body voxels add up to the mesh's volume by Gauss quadrature, where both are in view."""
    wide = Size(SMALL.cells, (2e-3, 2e-3, 2e-3))
    labels = draw_labels(view_prone(solved, wide))
    at_rest = Poses(
        solved.poses.box, solved.patient.anatomy.rest(solved.poses.box.zeta), np.empty(0)
    )
    difference = gauss_volume(solved.poses.prone, solved.poses.box.hexahedra) - gauss_volume(
        at_rest.prone, solved.poses.box.hexahedra
    )
    rest = draw_labels(view_prone(Solved(solved.patient, at_rest, solved.tumour, {}), wide))
    counted = (np.isin(labels, BREAST).sum() - np.isin(rest, BREAST).sum()) * 8e-9
    assert counted == pytest.approx(difference, rel=0.02)


def test_painted_voxels_hold_the_volume_of_the_whole_mesh(solved: Solved) -> None:
    """With all of the mesh in view, voxels add up to its volume by Gauss quadrature."""
    points, box = solved.poses.prone, solved.poses.box
    low, high = points.min(axis=0) - 1e-3, points.max(axis=0) + 1e-3
    shape = tuple(int(n) for n in np.ceil((high - low) / 1.5e-3)[::-1] + 1)
    flat, _ = paint(Grid(low, np.full(3, 1.5e-3), shape), points, box.tetrahedra, box.zeta)
    assert flat.size * 1.5e-3**3 == pytest.approx(gauss_volume(points, box.hexahedra), rel=5e-3)


def test_tumour_voxels_are_the_deformed_ball(
    solved: Solved, files: PatientFiles, truth: dict
) -> None:
    """Their centroid is the true centre; their volume is the ball's times the local J."""
    image = sitk.ReadImage(str(files.labels))
    at = np.argwhere(sitk.GetArrayFromImage(image) == Tissue.TUMOUR)
    centres = np.array(
        [image.TransformIndexToPhysicalPoint([int(i) for i in index[::-1]]) for index in at]
    )
    assert np.linalg.norm(centres.mean(axis=0) - truth["tumour"]["prone_mm"]) < 1.0
    volume = len(at) * float(np.prod(image.GetSpacing()))
    ball = np.pi / 6.0 * truth["tumour"]["diameter_mm"] ** 3
    step, zeta = 1e-4, solved.tumour.zeta
    probes = zeta + step * np.concatenate([np.eye(3), -np.eye(3)])
    before = solved.patient.anatomy.rest(probes)
    after = solved.poses.box.interpolate(solved.poses.prone, probes)
    stretch = np.linalg.det(after[:3] - after[3:]) / np.linalg.det(before[:3] - before[3:])
    assert volume == pytest.approx(ball * stretch, rel=0.15)


@pytest.mark.parametrize("seed", range(3))
def test_air_body_and_chest_are_one_piece_each(seed: int) -> None:
    """No gap opens between mesh and wall: each of the three is connected, face to face."""
    from scipy.ndimage import label

    labels = draw_labels(view_prone(deform(seed), SMALL))
    for codes in ([Tissue.AIR], BREAST, [Tissue.CHEST]):
        _, pieces = label(np.isin(labels, codes))
        assert pieces == 1, codes


def test_case_names_the_files_and_the_prone_tumour(files: PatientFiles, truth: dict) -> None:
    """The case holds what the truth says of the prone pose, and nothing of the supine one."""
    case = tomllib.loads(files.case.read_text())
    assert (files.case.parent / case["image"]["file"]) == files.image
    assert (files.case.parent / case["image"]["labels"]) == files.labels
    assert (files.case.parent / case["scan"]["file"]) == files.scan
    assert np.allclose(case["tumour"]["centre_mm"], truth["tumour"]["prone_mm"], atol=0.006)
    assert case["pose"] == {"image": "prone", "target": "supine"}
    assert set(case) == {"image", "tumour", "scan", "pose"}


def test_scan_lies_on_the_supine_skin_after_undoing_the_misalignment(
    solved: Solved, files: PatientFiles, truth: dict
) -> None:
    """Signed distances to the noise-free skin have mean 0 and standard deviation 1 mm."""
    from scipy.spatial import cKDTree

    points, _ = read_ply(files.scan)
    motion = truth["misalignment"]
    image = (points - motion["translation_mm"]) @ np.array(motion["rotation"])
    thorax = image * 1e-3 - solved.patient.isocentre
    skin = sample_skin(solved.poses.box, solved.poses.supine, 16)
    flat, normals = skin.points.reshape(-1, 3), skin.normals.reshape(-1, 3)
    nearest = cKDTree(flat).query(thorax)[1]
    distance = np.einsum("ni,ni->n", thorax - flat[nearest], normals[nearest])
    assert abs(distance.mean()) < 0.1e-3
    assert distance.std() == pytest.approx(1e-3, rel=0.05)


def test_true_supine_tumour_is_the_same_point_in_both_frames(truth: dict) -> None:
    """R p + t carries the image's supine position to the scanner's."""
    motion = truth["misalignment"]
    carried = np.array(motion["rotation"]) @ truth["tumour"]["supine_mm"] + motion["translation_mm"]
    assert np.allclose(carried, truth["tumour"]["supine_scan_mm"], atol=1e-9)


def test_scan_has_holes_and_faces_outward(solved: Solved) -> None:
    """The edges that one triangle only uses form more than one loop; normals point forward."""
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    scan = make_scan(solved.poses.box, solved.poses.supine, np.random.default_rng(0), SMALL.scan)
    edges = np.sort(scan.triangles[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)
    pairs, uses = np.unique(edges, axis=0, return_counts=True)
    rim = pairs[uses == 1]
    assert uses.max() == 2
    size = len(scan.points)
    graph = coo_array((np.ones(len(rim)), (rim[:, 0], rim[:, 1])), shape=(size, size))
    loops = connected_components(graph, directed=False)[0] - (size - np.unique(rim).size)
    assert loops >= 4
    corners = scan.points[scan.triangles]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    assert normals[:, 1].sum() < 0
    assert np.unique(scan.triangles).size == size


def test_noise_in_air_is_rayleigh_and_tissues_keep_their_order(files: PatientFiles) -> None:
    """Rician noise without signal has mean s sqrt(pi/2) and variance (2 - pi/2) s^2."""
    image = sitk.GetArrayFromImage(sitk.ReadImage(str(files.image))).astype(float)
    labels = sitk.GetArrayFromImage(sitk.ReadImage(str(files.labels)))
    air = image[:, :4][labels[:, :4] == Tissue.AIR]
    assert air.mean() == pytest.approx(SIGNAL["noise"] * np.sqrt(np.pi / 2.0), rel=0.02)
    assert air.var() == pytest.approx(SIGNAL["noise"] ** 2 * (2.0 - np.pi / 2.0), rel=0.05)
    fat, gland, tumour = (np.median(image[labels == t]) for t in BREAST)
    assert fat > 1.7 * gland
    assert gland > 1.1 * tumour


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


def test_same_seed_gives_the_same_files_and_another_seed_others(
    files: PatientFiles, tmp_path: Path
) -> None:
    """Nothing but the seed decides: images and scan are equal byte for byte."""
    again = write_patient(deform(3), SMALL, np.random.default_rng(5), tmp_path / "a", {"seed": 3})
    other = write_patient(deform(4), SMALL, np.random.default_rng(6), tmp_path / "b", {"seed": 4})
    for name in ("image", "scan", "case"):
        content = getattr(files, name).read_bytes()
        assert getattr(again, name).read_bytes() == content
        assert getattr(other, name).read_bytes() != content


def test_failed_writing_leaves_no_file(
    solved: Solved, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """If the last file cannot be written, none appears and nothing is left aside."""

    def fail(*_: object) -> None:
        raise OSError("disk full")

    monkeypatch.setattr(phantom, "write_truth", fail)
    with pytest.raises(OSError, match="disk full"):
        write_patient(solved, SMALL, np.random.default_rng(0), tmp_path, {})
    assert list(tmp_path.iterdir()) == []


def test_unknown_size_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="demo, small"):
        phantom.make_patient(0, tmp_path, size="huge")


def test_tumour_far_away_from_a_point_is_clipped() -> None:
    """Depth in the ball is radius - distance near it and -radius far from it."""
    patient = draw_patient(np.random.default_rng(1))
    zeta = np.array([patient.anatomy.domes[1].azimuth, 0.0, 0.5])
    tumour = Tumour(zeta, patient.anatomy.rest(zeta), 6e-3)
    far = zeta * np.array([-1.0, 1.0, 1.0])
    assert tumour.depth(patient.anatomy, np.stack([zeta, far])) == pytest.approx([6e-3, -6e-3])
