"""The synthetic patient's files: solved by the engine, written, read again."""

from __future__ import annotations

import json
import tomllib
from pathlib import Path

import numpy as np
import pytest
import SimpleITK as sitk

from supple.breast import phantom
from supple.breast.phantom import SIZES, PatientFiles, Solved, solve_patient, write_patient
from supple.breast.phantom_image import SIGNAL
from supple.breast.phantom_mechanics import build_truth, solve_poses
from supple.breast.phantom_scan import make_scan
from supple.breast.phantom_skin import sample_skin
from supple.breast.tissues import BREAST, Tissue
from supple.errors import InputError

SMALL = SIZES["small"]


@pytest.fixture(scope="module")
def solved() -> Solved:
    return solve_patient(np.random.default_rng(3), SMALL)


@pytest.fixture(scope="module")
def files(solved: Solved, tmp_path_factory: pytest.TempPathFactory) -> PatientFiles:
    folder = tmp_path_factory.mktemp("patient")
    return write_patient(solved, SMALL, np.random.default_rng(5), folder, {"seed": 3})


@pytest.fixture(scope="module")
def truth(files: PatientFiles) -> dict:
    return json.loads(files.truth.read_text(encoding="utf-8"))


def read_ply(path: Path) -> tuple[np.ndarray, np.ndarray]:
    import meshio

    mesh = meshio.read(path)
    return np.asarray(mesh.points, dtype=float), mesh.cells_dict["triangle"]


def test_case_names_the_files_and_the_prone_tumour(files: PatientFiles, truth: dict) -> None:
    """The case holds what the truth says of the prone pose, and nothing of the supine one."""
    case = tomllib.loads(files.case.read_text(encoding="utf-8"))
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


def test_same_seed_gives_the_same_files_and_another_seed_others(tmp_path: Path) -> None:
    """Nothing but the seed decides: what is written is equal byte for byte."""
    first, again, other = (
        phantom.make_patient(seed, tmp_path / name, size="small", use_labels=False)
        for seed, name in ((7, "first"), (7, "again"), (8, "other"))
    )
    for name in ("image", "labels", "scan", "case"):
        content = getattr(first, name).read_bytes()
        assert getattr(again, name).read_bytes() == content
        assert getattr(other, name).read_bytes() != content
    assert "labels" not in tomllib.loads(first.case.read_text(encoding="utf-8"))["image"]


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


def test_unknown_size_and_negative_seed_are_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="demo, small"):
        phantom.make_patient(0, tmp_path, size="huge")
    with pytest.raises(InputError, match="seed must be at least 0"):
        phantom.make_patient(-1, tmp_path)
    assert list(tmp_path.iterdir()) == []


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


def test_chest_wall_carries_the_weight(solved: Solved) -> None:
    """Reactions of the fixed nodes add up to minus density x volume x gravity, both poses."""
    patient, box = solved.patient, solved.poses.box
    truth = build_truth(patient, box)
    solve_poses(truth, None)
    corners = patient.anatomy.rest(box.zeta)[box.tetrahedra]
    volume = np.linalg.det(corners[:, 1:] - corners[:, :1]).sum() / 6.0
    weight = patient.tissues.density * volume * 9.81
    for state, sign in ((truth.prone, 1.0), (truth.supine, -1.0)):
        total = np.asarray(state.reactions).reshape(-1, 3).sum(axis=0)
        assert total == pytest.approx([0.0, sign * weight, 0.0], abs=1e-3 * weight)


def test_breast_hangs_prone_and_flattens_supine(solved: Solved) -> None:
    """The skin's front lies before the rest shape prone and behind it supine; the base stays."""
    box, poses = solved.poses.box, solved.poses
    rest = solved.patient.anatomy.rest(box.zeta)
    prone, flat, supine = (p[box.skin][..., 1].min() for p in (poses.prone, rest, poses.supine))
    assert prone < flat - 5e-3
    assert supine > flat + 5e-3
    assert np.abs(poses.prone - rest)[box.fixed].max() < 1e-15


def test_tumour_moves_20_mm_after_the_best_rigid_alignment(truth: dict) -> None:
    """Against the chest wall and against the least-squares fit of the whole front."""
    tumour = truth["tumour"]
    straight = np.linalg.norm(np.subtract(tumour["supine_mm"], tumour["prone_mm"]))
    assert tumour["moved_mm"] == pytest.approx(straight, rel=1e-9)
    assert min(tumour["moved_mm"], tumour["moved_after_best_rigid_mm"]) >= 20.0
