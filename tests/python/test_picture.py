"""Pictures show what they are said to show: bodies, marked cells, a field, at one scale."""

from __future__ import annotations

import numpy as np
import pytest
from PIL import Image

import supple
from supple.boundary_triangles import triangles_of
from supple.kernels.cells import ELEMENTS
from supple.picture import _MARKED, Panel, draw


def pixels(path):
    return np.asarray(Image.open(path).convert("RGB"), dtype=float)


def like(image, colour):
    """How many pixels have that colour (3,), 0 to 1."""
    return int((np.abs(image / 255 - np.array(colour)).max(axis=2) < 0.05).sum())


@pytest.mark.parametrize("element", ELEMENTS)
def test_triangles_of_the_boundary_close_and_enclose_the_volume(element):
    """∫x·n/3 over them, by the divergence theorem; each edge is passed once either way."""
    mesh = supple.Mesh.box((2, 1, 1), (2.0, 1.0, 1.0), element)
    triangles, rows = triangles_of(mesh.boundary(), mesh.table)
    a, b, c = (mesh.points[triangles[:, k]] for k in range(3))
    assert np.einsum("ti,ti->", np.cross(a, b), c) / 6 == pytest.approx(2.0)
    edges = triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2)
    assert {tuple(e) for e in edges} == {tuple(e[::-1]) for e in edges}
    np.testing.assert_array_equal(np.unique(rows), np.arange(len(mesh.boundary())))


def test_marked_cells_stand_out_wherever_they_lie(tmp_path):
    """Their colour is in the picture if cells are marked, inside the body too, and not else."""
    mesh = supple.Mesh.box((3, 3, 3), (0.1, 0.1, 0.1), "Q1")
    assert like(pixels(draw(tmp_path / "a.png", [Panel(mesh)])), _MARKED) == 0
    inner = draw(tmp_path / "b.png", [Panel(mesh, marked=[13])])  # the cell in the middle
    assert like(pixels(inner), _MARKED) > 200


def test_a_field_of_nodes_or_cells_colours_the_body(tmp_path):
    """Dark blue where low and yellow where high: cividis' ends, in panels of one picture."""
    mesh = supple.Mesh.box((4, 4, 4), (0.1, 0.1, 0.1))
    z = mesh.points[:, 2]
    cells = z[mesh.cells].mean(axis=1)
    for values in (z, cells):
        shown = pixels(draw(tmp_path / "c.png", [Panel(mesh, "z", 1e3 * values, "z (mm)")]))
        assert like(shown, (0.0, 0.13, 0.30)) > 50
        assert like(shown, (0.99, 0.91, 0.15)) + like(shown, (0.85, 0.78, 0.2)) > 50


def test_panels_share_one_scale(tmp_path):
    """A body of half the size takes about a quarter of the area."""
    large = supple.Mesh.box((1, 1, 1), (0.1, 0.1, 0.1), "Q1")
    small = supple.Mesh.box((1, 1, 1), (0.05, 0.05, 0.05), "Q1")
    image = pixels(draw(tmp_path / "d.png", [Panel(large), Panel(small)]))
    bluish = (image[..., 2] - image[..., 0]) > 20
    left, right = np.array_split(bluish, 2, axis=1)
    assert 0.15 < right.sum() / left.sum() < 0.35


def test_a_picture_is_a_png_or_an_svg(tmp_path):
    mesh = supple.Mesh.box((1, 1, 1), (0.1, 0.1, 0.1))
    assert draw(tmp_path / "e.svg", [Panel(mesh, ghost=mesh)]).read_text("utf-8").count("<svg") == 1
    for name, panels in (("e.jpg", [Panel(mesh)]), ("e.png", [])):
        with pytest.raises(supple.InputError, match="a picture needs panels"):
            draw(tmp_path / name, panels)
