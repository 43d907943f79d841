"""The smooth displacement of the skin that bones and shapes leave."""

from __future__ import annotations

import numpy as np

from supple.registration.offset import matern
from supple.registration.procedural import torso
from supple.registration.rig import Rig
from supple.registration.skin import vertex_normals
from supple.surface import Surface


def test_its_precision_far_from_the_scan_is_the_fields() -> None:
    """Where no scan point lands, the core's matrix is Lindgren et al.'s."""
    from scipy.sparse import csc_array

    template, rig = torso(), Rig(torso())
    rig.set_scan(Surface(template.points + 5.0, template.triangles), thin=False)
    found = rig.offset(template.points, prior=2e-3, length=0.08, per_area=1e6, reach=0.025)
    count = len(template.points)
    matrix = csc_array((found.values, found.row, found.start), (count, count))
    expected = matern(template.points, template.triangles, 2e-3, 0.08)
    assert abs(matrix - expected).max() < 1e-10 * abs(expected).max()
    assert (found.height == 0).all()


def test_it_finds_a_skin_that_grew_evenly() -> None:
    """A skin 2 mm further out all over, seen without noise: the displacement is 2 mm inside."""
    template, rig = torso(), Rig(torso())
    normals = vertex_normals(template.points, template.triangles)
    rig.set_scan(Surface(template.points + 2e-3 * normals, template.triangles), thin=False)
    found = rig.offset(template.points, prior=4e-3, length=0.08, per_area=1e8, reach=0.025)
    assert np.allclose(found.along, normals, atol=1e-12)
    assert abs(float(np.median(found.height)) - 2e-3) < 1e-4
