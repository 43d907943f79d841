"""Regions by box, brush and sternum."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from supple.errors import InputError
from supple.registration.procedural import torso
from supple.registration.region_of_interest import box_region, brush_region, sternum_region
from supple.registration.still_skin import Body, still_skin
from supple.surface import Surface

GRID = np.stack(np.meshgrid(*[np.arange(5) * 0.01] * 3, indexing="ij"), -1).reshape(-1, 3)


def test_a_box_holds_the_points_between_its_corners() -> None:
    """Of a grid of 10 mm, a box of 20 mm holds 3 × 3 × 2."""
    assert box_region(GRID, (-1e-9, -1e-9, 5e-3), (0.02 + 1e-9, 0.02 + 1e-9, 0.025)).sum() == 18


def test_a_brush_paints_what_is_within_its_radius(tmp_path: Path) -> None:
    """A stroke at a grid point reaches its 6 neighbours at 10 mm and not those at 14 mm."""
    file = tmp_path / "brush.csv"
    file.write_text("x, y, z, radius\n20, 20, 20, 10.5\n0, 0, 0,\n")
    assert brush_region(GRID, file, radius=1e-3).sum() == 7 + 1


def test_a_painted_part_is_found_again(tmp_path: Path) -> None:
    """A part of the skin, written as PLY, paints its own vertices."""
    template = torso()
    mask = np.asarray(template.regions["sternum"])
    Surface(template.points[mask]).write(tmp_path / "part.ply")
    assert np.array_equal(brush_region(template.points, tmp_path / "part.ply", 1e-6), mask)


def test_the_sternums_region_is_what_align_takes() -> None:
    """It is the still skin: no nipple, no back."""
    template = torso()
    mask = sternum_region(template.points, template.triangles)
    body = Body.build(template.points, template.triangles)
    assert np.array_equal(mask, still_skin(body)[0])
    tips = [template.landmarks[f"nipple_{side}"].triangle for side in ("left", "right")]
    assert not mask[template.triangles[np.concatenate(tips)]].any()
    assert not (mask & template.regions["back"]).any()


@pytest.mark.parametrize(
    "rows", ["a,b\n1,2\n", "x,y,z\n1,2,three\n", "x,y,z\nnan,1,1\n", "x,y,z\n9e3,0,0\n"]
)
def test_a_brush_that_paints_nothing_is_refused(tmp_path: Path, rows: str) -> None:
    """Wrong columns, no numbers, or a place with no skin."""
    file = tmp_path / "brush.csv"
    file.write_text(rows)
    with pytest.raises(InputError):
        brush_region(GRID, file)


def test_an_empty_box_is_refused() -> None:
    """Corners in the wrong order, or a box beside the skin."""
    for low, high in (((1, 0, 0), (0, 1, 1)), ((1, 1, 1), (2, 2, 2))):
        with pytest.raises(InputError):
            box_region(GRID, low, high)
