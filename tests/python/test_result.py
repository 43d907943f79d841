"""result.json and the geometry that it needs."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from supple.breast.result import (
    Check,
    MeshFigures,
    Parameter,
    Result,
    Truth,
    Tumour,
    breast_side,
    clock_position,
    closest_on_skin,
    estimate_nipple,
    write_aside,
)
from supple.errors import InputError

SQUARE = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], dtype=float)
HALVES = np.array([[0, 1, 2], [0, 2, 3]])


def result(**changes: object) -> Result:
    tumour = Tumour.locate([0.05, -0.1, 0.01], [0.06, -0.05, 0.03], [0.05, -0.09, 0.0], skin())
    given: dict[str, Any] = {
        "tumour": tumour,
        "parameters": {"breast.young": Parameter(1000.0, "Pa")},
        "mesh": MeshFigures(100, 400, 0.3, 512.0),
        "seconds": {"total": 12.0},
        "checks": {"volume": Check(True, "0.4 %")},
        "versions": {"supple": "0.1"},
        **changes,
    }
    return Result(**given)


def skin() -> tuple[np.ndarray, np.ndarray]:
    """The plane y = -0.08 m."""
    return np.array([[-1, -0.08, -1], [1, -0.08, -1], [1, -0.08, 1], [-1, -0.08, 1.0]]), HALVES


@pytest.mark.parametrize(
    ("point", "distance"),
    [
        ((0.6, 0.3, 0.5), 0.5),  # over a face
        ((0.5, -3.0, 4.0), 5.0),  # beside an edge
        ((-2.0, -1.0, 2.0), 3.0),  # beyond a corner
        ((0.5, 0.5, 0.0), 0.0),  # on the diagonal
    ],
)
def test_depth_is_the_shortest_way_to_the_square(point: tuple[float, ...], distance: float) -> None:
    found, place = closest_on_skin(point, SQUARE, HALVES)
    assert found == pytest.approx(distance, abs=1e-14)
    foot = np.clip(np.array(point), 0, [1, 1, 0])
    assert np.allclose(place.on(SQUARE, HALVES), foot, atol=1e-14)


def test_depth_in_a_sphere_is_radius_minus_distance_to_its_centre() -> None:
    """A fine lat-long sphere of radius 50 mm: 50 - |p| to the sagitta of its cells (0.15 mm)."""
    u, v = np.meshgrid(np.linspace(0, np.pi, 60), np.linspace(0, 2 * np.pi, 121))
    points = 0.05 * np.stack([np.sin(u) * np.cos(v), np.sin(u) * np.sin(v), np.cos(u)], -1)
    index = np.arange(u.size).reshape(u.shape)
    a, b, c, d = index[:-1, :-1], index[1:, :-1], index[1:, 1:], index[:-1, 1:]
    tri = np.concatenate([np.stack(t, -1).reshape(-1, 3) for t in ((a, b, c), (a, c, d))])
    inside = np.random.default_rng(0).normal(size=(20, 3)) * 0.015
    for p in inside:
        depth, _ = closest_on_skin(p, points.reshape(-1, 3), tri)
        assert depth == pytest.approx(0.05 - np.linalg.norm(p), abs=1.5e-4)


def test_a_triangle_without_area_is_an_edge() -> None:
    found, _ = closest_on_skin([0.5, 0.0, 2.0], SQUARE, [[0, 1, 1]])
    assert found == pytest.approx(2.0)


@pytest.mark.parametrize(
    ("dx", "dz", "clock"),
    [
        (0, 20, "12:00"),  # towards the head
        (20, 0, "3:00"),  # towards the patient's left, on the right of a surgeon who faces her
        (0, -20, "6:00"),
        (-20, 0, "9:00"),
        (-20, 20, "10:30"),
        (20, 34.64, "1:00"),
        (1, 3, "central"),
    ],
)
def test_the_clock_is_that_of_a_surgeon_who_faces_the_patient(
    dx: float, dz: float, clock: str
) -> None:
    found, distance = clock_position([1e-3 * dx, 0.7, 1e-3 * dz], [0.0, -0.2, 0.0])
    assert found == clock
    assert distance == pytest.approx(np.hypot(dx, dz))


def test_left_is_plus_x_of_the_midline() -> None:
    assert breast_side([0.08, 0, 0]) == "left"
    assert breast_side([-0.08, 0, 0]) == "right"
    assert breast_side([0.08, 0, 0], midline_x=0.1) == "right"


def test_the_skin_carries_the_nipple() -> None:
    """The foremost node of each side, in the moved skin at the moved node."""
    points = np.array([[-1, -3, 0], [-1, -1, 1], [-2, -1, 0], [1, -2, 0], [2, 0, 0], [1, 0, 1.0]])
    tri = np.array([[1, 2, 0], [3, 4, 5]])
    moved = points + np.arange(18).reshape(6, 3)
    assert np.allclose(estimate_nipple(points, tri, "right").on(moved, tri), moved[0])
    assert np.allclose(estimate_nipple(points, tri, "left").on(moved, tri), moved[3])
    with pytest.raises(InputError, match="left breast"):
        estimate_nipple(points - [9, 0, 0], tri, "left")


def test_the_file_holds_the_keys_of_the_design(tmp_path: Path) -> None:
    result(skin_mae_mm=1.2).write(tmp_path / "result.json")
    read = json.loads((tmp_path / "result.json").read_text(encoding="utf-8"))
    assert read["tumour"]["prone_mm"] == pytest.approx([50, -100, 10])
    assert read["tumour"]["supine_mm"] == pytest.approx([60, -50, 30])
    assert read["tumour"]["depth_mm"] == pytest.approx(30)
    assert read["tumour"]["clock"] == "12:30"
    assert read["tumour"]["breast"] == "left"
    assert read["tumour"]["ellipsoid95_mm"] is None
    assert read["tumour"]["ellipsoid95_reason"]
    assert read["skin_mae_mm"] == 1.2
    assert read["parameters"]["breast.young"] == {"value": 1000.0, "unit": "Pa", "sd": None}
    assert set(read["mesh"]) == {"nodes", "cells", "min_quality", "volume_ml"}
    assert read["checks"]["volume"] == {"passed": True, "figure": "0.4 %"}
    assert (read["frame"], read["unit"]) == ("LPS", "mm")
    assert read["seconds"]["total"] == 12.0
    assert "truth" not in read


def test_a_synthetic_patient_adds_the_truth() -> None:
    assert result(truth=Truth(1.5, 22.0)).to_dict()["truth"] == {
        "tumour_error_mm": 1.5,
        "rigid_error_mm": 22.0,
    }


def test_a_figure_that_is_no_number_leaves_the_old_file(tmp_path: Path) -> None:
    path = tmp_path / "result.json"
    path.write_text("old")
    with pytest.raises(InputError, match="finite"):
        result(skin_mae_mm=float("nan")).write(path)
    assert path.read_text(encoding="utf-8") == "old"
    assert [p.name for p in tmp_path.iterdir()] == ["result.json"]


def test_an_interruption_leaves_no_half_file(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def stop(*_: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr("os.replace", stop)
    with pytest.raises(KeyboardInterrupt):
        write_aside(tmp_path / "x.html", "text")
    assert list(tmp_path.iterdir()) == []
