"""The breast as a body: values by tissue, supports, poses of a hanging dome, carried points."""

from __future__ import annotations

import numpy as np
import pytest

import supple
from supple.breast.model import Materials, build_body, tissue_values
from supple.breast.poses import MaterialPoint, solve_or_advise, solve_poses
from supple.breast.tetra import BreastMesh
from supple.breast.tissues import Tissue
from supple.errors import ConvergenceError, InputError


def dome(depth: float = 0.06, cells: int = 8) -> BreastMesh:
    """A dome that hangs towards -y from a clamped base y = 0; depth in m (DESIGN §9's shape)."""
    box = supple.Mesh.box((cells, cells, 4), (2.0, 2.0, 1.0), origin=(-1.0, -1.0, 0.0))
    square, share = box.points[:, :2], box.points[:, 2]
    longest = np.abs(square).max(axis=1)
    length = np.linalg.norm(square, axis=1)
    disk = square * (longest / np.maximum(length, 1e-12))[:, None]
    radius = np.linalg.norm(disk, axis=1)
    height = 6e-3 + (depth - 6e-3) * np.sqrt(np.maximum(0.0, 1.0 - (0.98 * radius) ** 2))
    x, z = 0.065 * disk.T
    points = np.column_stack([x, -share * height, z])
    volumes = np.linalg.det(points[box.cells[:, 1:]] - points[box.cells[:, :1]])
    swapped = np.where((volumes > 0)[:, None], box.cells, box.cells[:, [1, 0, 2, 3]])
    mesh = supple.Mesh(points, swapped, "P1")
    facets = mesh.boundary()
    base = (points[facets][:, :, 1] > -1e-9).all(axis=1)
    tissue = np.full(len(swapped), Tissue.FAT, np.uint8)
    centre = points[swapped].mean(axis=1)
    tissue[np.linalg.norm(centre - (0.0, -depth / 2, 0.0), axis=1) < 0.02] = Tissue.GLAND
    none = np.empty((0, 3), np.int32)
    return BreastMesh(
        points, swapped.astype(np.int32), tissue, facets[~base].astype(np.int32),
        facets[base].astype(np.int32), none, {}, (),
    )  # fmt: skip


@pytest.fixture(scope="module")
def mesh() -> BreastMesh:
    return dome()


def test_gland_and_tumour_differ_only_where_they_are_given(mesh: BreastMesh) -> None:
    plain = tissue_values(Materials(), mesh.tissue)
    assert {name: set(value) for name, value in plain.items()} == {
        "young": {1e3},
        "poisson": {0.45},
    }
    mixed = tissue_values(Materials(gland={"young": 3e3}), mesh.tissue)
    gland = mesh.tissue == Tissue.GLAND
    assert set(mixed["young"][gland]) == {3e3}
    assert set(mixed["young"][~gland]) == {1e3}


def test_a_stiffer_breast_keeps_the_ratio_of_its_tissues_and_poisson() -> None:
    made = Materials(gland={"young": 2e3}, tumour={"young": 6e3})
    stiffer = made.given({"breast.young": 500.0, "skin.young": 1e4})
    assert (stiffer.breast["young"], stiffer.gland["young"]) == (500.0, 1000.0)
    assert (stiffer.tumour["young"], stiffer.skin["young"]) == (3000.0, 1e4)
    assert made.stiffer(2.0).breast == {"young": 2e3, "poisson": 0.45}


def test_an_unknown_parameter_is_refused_with_those_known() -> None:
    with pytest.raises(InputError, match=r"breast\.young.*got 'breast\.yong'"):
        Materials().of("breast.yong")
    with pytest.raises(InputError, match="fixed, sliding"):
        build_body(dome(cells=4), support="loose")


def test_prone_hangs_and_supine_sinks_and_the_round_trip_closes(mesh: BreastMesh) -> None:
    """Gravity -y stretches the dome towards -y, +y flattens it; rest put prone again is prone."""
    poses = solve_poses(build_body(mesh))
    depth = {pose: -points[:, 1].min() for pose, points in poses.points.items()}
    assert depth["prone"] > depth["rest"] + 1e-3 > depth["supine"] + 2e-3
    assert poses.least_volume_ratio() > 0
    assert poses.round_trip_mm() <= 1e-3
    base = np.unique(mesh.chest)
    assert np.array_equal(poses.points["supine"][base], mesh.points[base])


def test_a_point_is_carried_by_its_cell_as_an_affine_map_carries_it(mesh: BreastMesh) -> None:
    """Barycentric coordinates do not change under x -> A x + b: the answer is A p + b."""
    point = np.array([0.011, -0.021, -0.007])
    carried = MaterialPoint.at(point, mesh.points, mesh.cells)
    A, b = np.array([[1.1, 0.2, 0.0], [0.0, 0.9, 0.1], [0.3, 0.0, 1.2]]), np.array([1.0, 2.0, 3.0])
    assert carried.on(mesh.points, mesh.cells) == pytest.approx(point, abs=1e-15)
    assert carried.on(mesh.points @ A.T + b, mesh.cells) == pytest.approx(A @ point + b, abs=1e-14)
    assert carried.weights.min() >= 0


def test_a_breast_far_too_soft_fails_and_says_how_stiff_one_would_do() -> None:
    soft = Materials(breast={"young": 100.0, "poisson": 0.45})
    with pytest.raises(ConvergenceError, match="times stiffer has both shapes") as error:
        solve_or_advise(dome(depth=0.08), soft, "fixed")
    assert error.value.cause
    assert 0 <= error.value.load_factor < 1
