"""The identification finds the parameters that made a scan, and says how well it knows them."""

from __future__ import annotations

import importlib.util
import sys
from pathlib import Path

import numpy as np
import pytest

from supple.breast.identify import IdentifySettings, identify
from supple.breast.model import Materials, build_body
from supple.breast.poses import solve_poses
from supple.breast.skin_misfit import SkinMisfit, mean_absolute

_spec = importlib.util.spec_from_file_location(
    "breast_dome", Path(__file__).parent.parent / "python" / "test_breast_model.py"
)
assert _spec is not None
assert _spec.loader is not None
breast_dome = importlib.util.module_from_spec(_spec)
sys.modules["breast_dome"] = breast_dome
_spec.loader.exec_module(breast_dome)


@pytest.fixture(scope="module")
def scan() -> SkinMisfit:
    """The supine skin of a breast of 1.4 kPa under 12 kPa skin, with 0.2 mm of noise."""
    mesh = breast_dome.dome()
    truth = Materials().given({"breast.young": 1400.0, "skin.young": 12e3})
    points = solve_poses(build_body(mesh, truth)).points["supine"]
    rng = np.random.default_rng(5)
    corners = points[np.repeat(mesh.skin, 6, axis=0)]
    weights = rng.dirichlet((1.0, 1.0, 1.0), len(corners))
    seen = np.einsum("kc,kcx->kx", weights, corners) + rng.normal(0.0, 2e-4, (len(corners), 3))
    start = solve_poses(build_body(mesh)).points["supine"]
    return SkinMisfit.overlapping(seen, start, mesh.skin.astype(np.int64))


def test_the_parameters_that_made_the_scan_are_found(scan: SkinMisfit) -> None:
    """Truth 1.4 kPa and 12 kPa, start 1 and 22.72 kPa; the misfit left is the scan's noise."""
    settings = IdentifySettings(evaluations=60, workers=1)
    found = identify(breast_dome.dome(), Materials(), "fixed", scan, settings)
    assert found.values["breast.young"] == pytest.approx(1400.0, rel=0.1)
    assert found.mae_mm <= 0.25
    sd = found.sd["breast.young"]
    assert sd is not None
    assert abs(found.values["breast.young"] - 1400.0) <= 4 * sd


def test_the_same_seed_gives_the_same_answer_in_one_process_and_in_two(scan: SkinMisfit) -> None:
    answers = [
        identify(
            breast_dome.dome(), Materials(), "fixed", scan,
            IdentifySettings(parameters=("breast.young",) * 1 + ("skin.young",), evaluations=13,
                             rtol=1e-9, workers=workers),
        ).values["breast.young"]
        for workers in (1, 2)
    ]  # fmt: skip
    assert answers[0] == pytest.approx(answers[1], rel=1e-4)


def test_distances_are_signed_and_the_worst_are_left_out() -> None:
    """A plane 1 mm above a flat skin: +1 mm everywhere, and an outlier of 40 mm does not count."""
    x, y = (a.ravel() for a in np.meshgrid(np.arange(21.0), np.arange(21.0)))
    points = 1e-2 * np.column_stack([x, y, 0 * x])
    corner = (np.arange(20)[:, None] * 21 + np.arange(20)).ravel()
    triangles = np.concatenate([corner[:, None] + [0, 1, 22], corner[:, None] + [0, 22, 21]])
    scan = points + np.array([1.3e-3, 2.1e-3, 1e-3])
    scan[220, 2] = 0.04
    misfit = SkinMisfit.overlapping(scan, points, triangles)
    assert 100 < len(misfit.scan) < len(scan)
    assert np.median(misfit.signed(points)) == pytest.approx(1e-3)
    assert mean_absolute(misfit.signed(points)) == pytest.approx(1e-3)
