"""Cases are read strictly, bad input is refused early, the pipeline meets a known truth."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import SimpleITK as sitk

import supple
from supple.breast.breast_case import Case, parse_point, parse_seeds, read_breast_case
from supple.breast.demo import compare, shortfalls
from supple.breast.image import read_image
from supple.breast.phantom import PatientFiles, make_patient
from supple.breast.predict import (
    painted_skin,
    predict,
    require_in_breast,
    require_inside,
    require_nipple,
)
from supple.breast.segment import segment
from supple.breast.tetra import BreastMesh
from supple.breast.tissues import Tissue
from supple.breast.torso import torso_skin
from supple.errors import InputError


@pytest.fixture(scope="module")
def patient(tmp_path_factory: pytest.TempPathFactory) -> PatientFiles:
    return make_patient(3, tmp_path_factory.mktemp("patient"), size="small")


def _case(folder: Path, text: str) -> Path:
    (folder / "prone.mha").touch()
    path = folder / "case.toml"
    path.write_text(f'[image]\nfile = "prone.mha"\n[tumour]\ncentre_mm = [1, 2, 3]\n{text}')
    return path


def test_a_case_says_all_that_a_prediction_needs(tmp_path: Path) -> None:
    case = read_breast_case(_case(tmp_path, """diameter_mm = 12
nipple_mm = [4, 5, 6]
[pose]
image = "prone"
target = "supine"
[model]
support = "sliding"
edge_mm = 20
[seeds]
chest = [[0, 1, 2], [3, 4, 5]]
[material.breast]
law = "corotational_polar"
young = 1500.0
density = 950.0
[material.tumour]
young = 6000.0
[material.skin]
young = 1e4
thickness = 1.5e-3
[identify]
parameters = ["breast.young"]
seed = 7
"""))  # fmt: skip
    assert case.tumour_mm == (1.0, 2.0, 3.0)
    assert case.nipple_mm == (4.0, 5.0, 6.0)
    assert (case.support, case.edge_mm) == ("sliding", 20.0)
    assert case.seeds == {Tissue.CHEST: [(0.0, 1.0, 2.0), (3.0, 4.0, 5.0)]}
    made = case.materials
    assert (made.law, made.density, made.thickness) == ("corotational_polar", 950.0, 1.5e-3)
    assert made.breast == {"young": 1500.0, "poisson": 0.45}
    assert (made.tumour, made.skin) == ({"young": 6000.0}, {"young": 1e4})
    assert (case.identify.parameters, case.identify.seed) == (("breast.young",), 7)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ('[scan]\nfile = "prone.mha"\nstill = "none.csv"', r"\[scan\] still.*does not exist"),
        ("diametre_mm = 12", "diametre_mm.*diameter_mm"),
        ("[scam]\n", "scam.*scan"),
        ('[scan]\nfile = "none.ply"', r"\[scan\] file.*does not exist"),
        ('[material.breast]\nlaw = "neo_hookeen"', "neo_hookean"),
        ("[material.breast]\nyong = 1000.0", "yong.*young"),
        ("[material.breast]\npoisson = 0.5", "poisson"),
        ("[material.breast]\ndensity = -1.0", "density"),
        ('[material.breast]\nlaw = "mine.py"', "allow-energy-files"),
        ('[identify]\nparameters = ["breast.yong"]', "breast.yong"),
        ('[pose]\nimage = "supine"', "prone"),
        ('[model]\nsupport = "slidding"', "sliding"),
        ("[seeds]\nchest = [[1, 2]]", "chest.*3 numbers"),
    ],
)
def test_a_wrong_case_is_refused_in_a_sentence(tmp_path: Path, text: str, message: str) -> None:
    with pytest.raises(InputError, match=message) as error:
        read_breast_case(_case(tmp_path, text))
    assert "\n" not in str(error.value)


@pytest.mark.parametrize("text", ["1,2", "1,2,x", "1;2;3", "nan,0,0", "inf,0,0", ""])
def test_what_is_no_point_is_refused(text: str) -> None:
    with pytest.raises(InputError, match="--tumour"):
        parse_point(text, "--tumour")


def test_seeds_name_a_tissue() -> None:
    assert parse_seeds(("fat:1,2,3", "fat:4,5,6"))[Tissue.FAT] == [(1, 2, 3), (4, 5, 6)]
    with pytest.raises(InputError, match="air, fat, gland, chest"):
        parse_seeds(("bone:1,2,3",))


def test_a_tumour_outside_of_image_or_breast_is_refused() -> None:
    voxels = np.zeros((10, 10, 10), np.uint8)
    voxels[:, 4:8] = Tissue.FAT
    labels = sitk.GetImageFromArray(voxels)
    labels.SetSpacing([2.0, 2.0, 2.0])
    require_inside(labels, (9.0, 9.0, 9.0))
    require_in_breast(labels, (9.0, 9.0, 9.0))
    with pytest.raises(InputError, match=r"in the image \(x -1 to 19"):
        require_inside(labels, (9.0, -90.0, 9.0))
    with pytest.raises(InputError, match=r"in the breast.* 7 mm from its tissue"):
        require_in_breast(labels, (9.0, 0.0, 9.0))


def test_a_scan_in_metres_is_found_out_before_any_work(
    patient: PatientFiles, tmp_path: Path
) -> None:
    scan = supple.Surface.read(patient.scan)
    scan.write(tmp_path / "metres.ply", unit="m")
    case = replace(read_breast_case(patient.case), scan=tmp_path / "metres.ply")
    with pytest.raises(InputError, match=r"metres\.ply.*unit='m'"):
        predict(case, lambda name: tmp_path / name)
    assert [path.name for path in tmp_path.iterdir()] == ["metres.ply"]


def test_painted_skin_is_what_the_scan_is_aligned_by(patient: PatientFiles, tmp_path: Path) -> None:
    """All skin within 20 mm of one stroke; a stroke off the skin is refused before any work."""
    case = read_breast_case(patient.case)
    labels = segment(read_image(case.image).image, case.seeds).labels
    skin = torso_skin(labels).points
    x, y, z = 1e3 * skin[len(skin) // 2]
    painted = replace(case, still=tmp_path / "painted.csv")
    (tmp_path / "painted.csv").write_text(f"x,y,z,radius\n{x},{y},{z},20\n")
    near = np.linalg.norm(1e3 * skin - [x, y, z], axis=1) <= 20
    assert (painted_skin(painted, labels) == near).all()
    assert painted_skin(case, labels) is None
    (tmp_path / "painted.csv").write_text("x,y,z\n9000,0,0\n")
    with pytest.raises(InputError, match=r"brush of painted\.csv must hold points of the skin"):
        predict(painted, lambda name: tmp_path / name)


def test_a_prediction_without_a_scan_writes_all_files_and_says_what_it_assumed(
    patient: PatientFiles, tmp_path: Path
) -> None:
    """A coarse patient with assumed stiffness: every check holds, the tumour moves backwards."""
    stages: list[str] = []
    case: Case = replace(read_breast_case(patient.case), scan=None)
    result = predict(case, lambda name: tmp_path / name, lambda stage, _: stages.append(stage))
    assert {path.name for path in tmp_path.iterdir()} == {
        "prone.vtu", "rest.vtu", "supine.vtu", "supine_skin.ply", "labels.mha", "report.html",
    }  # fmt: skip
    assert all(check.passed for check in result.checks.values()), result.checks
    assert result.tumour.prone_mm == pytest.approx(case.tumour_mm)
    assert result.tumour.supine_mm[1] > result.tumour.prone_mm[1] + 5
    assert any("assumption" in text for text in result.warnings)
    assert (result.skin_mae_mm, result.truth) == (None, None)
    assert list(dict.fromkeys(stages)) == [
        "read", "segment", "mesh", "poses", "rest", "supine", "check", "write",
    ]  # fmt: skip
    json.dumps(result.to_dict(), allow_nan=False)
    supine = supple.Mesh.read(tmp_path / "supine.vtu")
    assert supine.volume == pytest.approx(1e-6 * result.mesh.volume_ml, rel=0.1)


@pytest.mark.slow
def test_with_a_scan_the_tumour_is_found_to_a_fifth_of_the_rigid_error(
    patient: PatientFiles, tmp_path: Path
) -> None:
    """Truth from hexahedra of Mooney–Rivlin; DESIGN §9: 3 mm and 1/5, skin 2 mm."""
    result = predict(read_breast_case(patient.case), lambda name: tmp_path / name)
    result = replace(result, truth=compare(result, patient.truth))
    assert not shortfalls(result)
    assert result.parameters["breast.young"].sd is not None


def test_a_nipple_off_the_skin_or_of_the_other_breast_is_refused() -> None:
    """Two skin triangles, 0.1 m to either side of the midline: one is the right breast's."""
    corner = np.array([[0.0, 0.0, 0.0], [0.02, 0.0, 0.0], [0.0, 0.0, 0.02]])
    points = np.vstack([corner + shift for shift in ([-0.11, 0, 0], [0.09, 0, 0])])
    skin, none = np.arange(6, dtype=np.int32).reshape(2, 3), np.empty((0, 3), np.int32)
    mesh = BreastMesh(points, np.empty((0, 4), np.int32), np.empty(0, np.uint8), skin, none, none,
                      {}, ())  # fmt: skip
    case = Case(Path("prone.mha"), (-100.0, 30.0, 5.0))
    require_nipple(replace(case, nipple_mm=(-105.0, -3.0, 5.0)), mesh)
    with pytest.raises(InputError, match=r"on the breast's skin, got \(-105, -40, 5\), 40 mm from"):
        require_nipple(replace(case, nipple_mm=(-105.0, -40.0, 5.0)), mesh)
    with pytest.raises(InputError, match="of the breast with the tumour"):
        require_nipple(replace(case, nipple_mm=(95.0, 0.0, 5.0)), mesh)
