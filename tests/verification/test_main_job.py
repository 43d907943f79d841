"""The main job: synthetic patients whose truth is known, and real prone images end to end."""

from __future__ import annotations

import json

import numpy as np
import pytest

from supple.breast.breast_case import Case
from supple.breast.demo import demo, shortfalls
from supple.breast.predict import predict

pytestmark = pytest.mark.slow

#: Image in the data folder, and a place inside one of its breasts, LPS mm.
REAL = {
    "uta11_69b91dc2_prone_T1tse_nonFS.nii.gz": (-55.0, 30.0, -20.0),
    "uta4_case3_prone_T1.nii.gz": (79.7, 12.2, -3.8),
    "uta4_case1_dicom_scrubbed.tar.xz": (-70.0, 20.0, -20.0),
}


@pytest.mark.parametrize("seed", range(5))
def test_the_tumour_of_a_synthetic_patient_is_found_within_3_mm(seed, tmp_path):
    """Truth by another mesh, element and energy: ≤ 3 mm, ≤ 1/5 of rigid alignment, skin ≤ 2 mm."""
    (tmp_path / "patient").mkdir()
    result = demo(seed, lambda name: tmp_path / name)
    assert shortfalls(result) == []
    truth = json.loads((tmp_path / "patient/truth.json").read_text(encoding="utf-8"))
    moved = truth["tumour"]["moved_after_best_rigid_mm"]
    assert moved >= 20.0, "a patient whose tumour hardly moves proves nothing"
    assert all(check.passed for check in result.checks.values()), result.checks


@pytest.mark.parametrize("image", REAL)
def test_a_real_prone_image_gives_a_supine_breast(image, shared, tmp_path):
    """Every check of the program passes; supine lies flatter on the chest than prone."""
    case = Case(shared / "data/mri_mimbcd" / image, REAL[image], 12.0)
    result = predict(case, lambda name: tmp_path / name)
    assert all(check.passed for check in result.checks.values()), result.checks
    prone, supine = np.array(result.tumour.prone_mm), np.array(result.tumour.supine_mm)
    assert supine[1] > prone[1] + 5.0, "supine gravity pulls towards the back, +y"
    assert result.tumour.depth_mm > 0.0
