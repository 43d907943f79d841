"""Nearly incompressible bodies: mixed and mean dilatation do not lock, the displacement form does.

Reference numbers that this project did not produce:

- OpenGeoSys, Tests/Data/LargeDeformation (CooksMembrane, Indentation3D): uncoupled neo-Hookean
  solid, linear cells, with the F-bar method and without; its Newton stops at steps of 3e-6 m (Cook)
  and 5e-7 m (block), so its digits beyond the third or fourth are not converged.
- Small strains: 16.442 for the middle of Cook's loaded edge with E = 1.12499998,
  nu = 0.499999975, the value that papers on mixed elements compare with.
"""

from __future__ import annotations

import numpy as np
import pytest

import supple

#: Formulations free of locking with the cells that one side of the body is cut into, coarse.
FREE = {"mixed": ("P2", 8), "mean-dilatation": ("Q1", 16)}


def neo_hookean(mesh, formulation, young, poisson):
    """mu/2 (I1_bar - 3) + K/2 ln²J."""
    mu, bulk = young / (2 + 2 * poisson), young / (3 - 6 * poisson)
    return supple.Body(mesh, "mooney_rivlin", formulation=formulation, c1=mu / 2, c2=0.0, bulk=bulk)


def cook(element, n, formulation, force, young=240.565, poisson=0.4999, at=(48.0, 60.0)):
    """u_y, mm, of Cook's membrane (48 by 44 and 16 mm, plane strain) under ``force`` N/mm.

    One cell in thickness, n by n in the plane; rollers on both faces z keep it plane.
    """
    box = supple.Mesh.box((n, n, 1), (1.0, 1.0, 1.0), element)
    x, y, z = box.points.T
    mesh = box.moved(np.column_stack([48 * x, 44 * x + y * (44 - 28 * x), z]))
    body = neo_hookean(mesh, formulation, young, poisson)
    body.prescribe(lambda p: abs(p[:, 2] - 0.5) > 0.5 - 1e-9, (np.nan, np.nan, 0.0))
    body.fix(lambda p: p[:, 0] < 1e-9)
    state = body.traction(lambda p: p[:, 0] > 48 - 1e-9, (0.0, force / 16, 0.0)).solve()
    return state.u[np.linalg.norm(mesh.points[:, :2] - at, axis=1) < 1e-9, 1].mean()


def block(element, n, formulation, pressure):
    """u_z, mm, of the loaded corner of a cube of 1 mm: an eighth of a block pressed on its middle.

    Rollers on x = 0, y = 0 and z = 0; the top moves in z only; ``pressure`` MPa on a quarter of it.
    """
    mesh = supple.Mesh.box((n, n, n), (1.0, 1.0, 1.0), element)
    body = neo_hookean(mesh, formulation, 240.56595906120816, 0.49989998666488866)
    body.prescribe(np.arange(len(mesh.points)), np.where(mesh.points < 1e-9, 0.0, np.nan))
    body.prescribe(lambda p: p[:, 2] > 1 - 1e-9, (0.0, 0.0, np.nan))
    body.traction(lambda p: (p[:, 2] > 1 - 1e-9) & (p[:, :2].max(axis=1) < 0.5 + 1e-9),
                  (0.0, 0.0, -pressure))  # fmt: skip
    return body.solve().u[np.linalg.norm(mesh.points - [0, 0, 1], axis=1).argmin(), 2]


@pytest.mark.parametrize(("n", "expected"), [(4, 2.28672214), (10, 2.84069217), (20, 3.88119972)])
def test_locked_membrane_is_that_of_opengeosys(n, expected):
    """Displacement form, nu = 0.499, the same meshes as OpenGeoSys: locked alike to 2e-4."""
    assert cook("Q1", n, "displacement", 100.0, poisson=0.499) == pytest.approx(expected, rel=2e-4)


@pytest.mark.parametrize(("n", "expected"), [(10, 6.74628396), (20, 6.85893648)])
def test_mean_dilatation_follows_the_f_bar_method_of_opengeosys(n, expected):
    """nu = 0.499, the same meshes; the two methods differ by terms that vanish with the mesh."""
    found = cook("Q1", n, "mean-dilatation", 100.0, poisson=0.499)
    assert found == pytest.approx(expected, rel=0.12 / n)


@pytest.mark.parametrize("formulation", FREE)
def test_membrane_is_near_its_limit_on_coarse_meshes(formulation):
    """nu = 0.4999: within 2 % of 6.89 mm, OpenGeoSys' value on its finest mesh."""
    element, n = FREE[formulation]
    assert cook(element, n, formulation, 100.0) == pytest.approx(6.89140918, rel=0.02)


@pytest.mark.parametrize("element", ["P1", "Q1"])
def test_displacement_form_locks_on_the_same_meshes(element):
    """nu = 0.4999: less than half of what the membrane gives."""
    assert cook(element, 16, "displacement", 100.0) < 0.5 * 6.89140918


@pytest.mark.slow
@pytest.mark.parametrize(("element", "formulation", "n"), [
    ("P2", "mixed", 4), ("Q2L", "mixed", 4), ("Q1", "mean-dilatation", 8)])  # fmt: skip
def test_membrane_of_small_strains_has_the_published_limit(element, formulation, n):
    """16.442 by Richardson's extrapolation of three meshes with the order that they show: 0.5 %."""
    u = [
        1e5 * cook(element, k * n, formulation, 1e-5, 1.12499998, 0.499999975, (48.0, 52.0))
        for k in (1, 2, 4)
    ]
    ratio = (u[1] - u[0]) / (u[2] - u[1])
    assert 1.5 < ratio < 6, u  # of order 0.6 to 2.6: the clamped corner is singular
    assert u[2] + (u[2] - u[1]) / (ratio - 1) == pytest.approx(16.442, rel=5e-3)


def test_locked_block_is_that_of_opengeosys():
    """8 × 8 × 8 trilinear cells under 40 MPa, displacement form: -0.0165345 mm to 1e-4."""
    assert block("Q1", 8, "displacement", 40.0) == pytest.approx(-0.016534484, rel=1e-4)


@pytest.mark.parametrize(("element", "formulation", "n"), [
    ("P2", "mixed", 4),
    pytest.param("Q2L", "mixed", 4, marks=pytest.mark.slow),
    ("Q1", "mean-dilatation", 8),
])  # fmt: skip
def test_block_is_near_its_limit_on_coarse_meshes(element, formulation, n):
    """-0.10954 mm under 40 MPa, OpenGeoSys' F-bar value on 8 × 8 × 8 cells: within 2 %."""
    found = block(element, n, formulation, 40.0)
    assert found == pytest.approx(-0.109539481, rel=0.02)


def test_displacement_form_of_the_block_locks():
    """Linear tetrahedra keep 5 % of the displacement, trilinear hexahedra 15 %."""
    for element in ("P1", "Q1"):
        assert abs(block(element, 8, "displacement", 40.0)) < 0.3 * 0.109539481


@pytest.mark.slow
def test_strongly_compressed_block_is_that_of_both_formulations():
    """Under 320 MPa, where the corner sinks by two thirds of the height: 3 % between them."""
    mixed, mean = block("P2", 4, "mixed", 320.0), block("Q1", 8, "mean-dilatation", 320.0)
    assert mixed == pytest.approx(mean, rel=0.03)
    assert -0.75 < mixed < -0.65
    assert abs(block("Q1", 8, "displacement", 320.0)) < 0.3 * abs(mixed)
