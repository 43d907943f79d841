"""Curves of a law: textbook stresses, faces free of stress, the ends of what exists."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import brentq

import supple
from supple.author import limits
from supple.author.curves import along
from supple.author.modes import MODES
from supple.author.points import PointLaw
from supple.author.samples import Range
from supple.laws import read_law

YOUNG, POISSON = 3e3, 0.3
MU = YOUNG / (2 * (1 + POISSON))
LAMBDA = YOUNG * POISSON / ((1 + POISSON) * (1 - 2 * POISSON))
STRETCHES = np.array([0.5, 0.8, 1.0, 1.3, 2.0])

OBLIQUE = '''"""Neo-Hookean matrix with one family of fibres. Made for this test."""
from supple.energy import Direction, Kinematics, Pa, ln
exceptions = {"isotropic"}


def psi(k: Kinematics, mu: Pa = 1e3, fibre_mu: Pa = 4e3, fibre: Direction = (0.6, 0.0, 0.8)):
    matrix = mu / 2 * (k.I1 - 3) - mu * ln(k.J) + mu * ln(k.J) ** 2
    return matrix + fibre_mu / 4 * (k.I4(fibre) - 1) ** 2
'''
LIMITED = '''"""Gent's solid: chains of finite length. Gent (1996), Rubber Chem. Technol. 69(1)."""
from supple.energy import Kinematics, Number, Pa, ln, log_volumetric


def psi_dev(k: Kinematics, mu: Pa = 1e3, limit: Number(minimum=0.1) = 2.0):
    return -mu * limit / 2 * ln(1 - (k.I1_bar - 3) / limit)


def psi_vol(J, bulk: Pa = 1e9):
    return log_volumetric(J, bulk)
'''


def neo_hookean(stretch, others):
    """P_i = mu (λ_i - 1/λ_i) + lambda ln(J)/λ_i; Mazier 2022, eq. 56 in principal stretches."""
    return MU * (stretch - 1 / stretch) + LAMBDA * np.log(stretch * np.prod(others)) / stretch


def lateral(equation):
    return brentq(equation, 0.1, 5.0, xtol=1e-14, rtol=1e-14)


def uniaxial(x):
    t = lateral(lambda t: neo_hookean(t, (x, t)))
    return neo_hookean(x, (t, t)), x * t * t


def equibiaxial(x):
    t = lateral(lambda t: neo_hookean(t, (x, x)))
    return neo_hookean(x, (x, t)), x * x * t


def planar(x):
    t = lateral(lambda t: neo_hookean(t, (x, 1.0)))
    return neo_hookean(x, (1.0, t)), x * t


@pytest.mark.parametrize("mode", [uniaxial, equibiaxial, planar])
def test_free_faces_and_stress_are_those_of_the_principal_stretches(mode):
    """Compressible neo-Hookean; the lateral stretch by bisection of its own scalar equation."""
    curve = supple.curves("neo_hookean", mode.__name__, STRETCHES, young=YOUNG, poisson=POISSON)
    expected = np.array([mode(x) for x in STRETCHES])
    np.testing.assert_allclose(curve.stress, expected[:, 0], rtol=1e-11, atol=1e-11 * YOUNG)
    J = np.linalg.det(curve.deformation)
    np.testing.assert_allclose(J, expected[:, 1], rtol=1e-11)
    true = curve.stress * STRETCHES / expected[:, 1]
    np.testing.assert_allclose(curve.cauchy[:, 0, 0], true, rtol=1e-11, atol=1e-11 * YOUNG)


def test_simple_shear_and_volume_have_their_closed_forms():
    """P12 = mu γ; with F = J^(1/3) I, -p = (mu (λ² - 1) + lambda ln J) / J."""
    shear = supple.curves("neo_hookean", "simple_shear", [-0.7, 0.0, 1.2])
    np.testing.assert_allclose(shear.stress, MU * shear.values, rtol=1e-12, atol=1e-9)
    J = np.array([0.6, 1.0, 1.4])
    volume = supple.curves("neo_hookean", "volumetric", J)
    pressure = -(MU * (J ** (2 / 3) - 1) + LAMBDA * np.log(J)) / J
    np.testing.assert_allclose(volume.stress, pressure, rtol=1e-11, atol=1e-9)


def test_a_nearly_incompressible_law_has_the_stresses_of_rubber():
    """2 (λ - λ^-2)(c1 + c2/λ) and its kin; Treloar (1975), Physics of Rubber Elasticity, ch. 5."""
    x, c1, c2 = STRETCHES, 400.0, 100.0
    expected = {
        "uniaxial": 2 * (x - x**-2) * (c1 + c2 / x),
        "equibiaxial": 2 * (x - x**-5) * (c1 + c2 * x**2),
        "planar": 2 * (x - x**-3) * (c1 + c2),
    }
    for mode, stress in expected.items():
        curve = supple.curves("mooney_rivlin", mode, x, c1=c1, c2=c2, bulk=1e9)
        np.testing.assert_allclose(curve.stress, stress, rtol=3e-4, atol=1e-3)


def test_coincident_stretches_are_exact():
    """Corotational law, linear in U - I: P = E (λ - 1), E/(1 - ν) (λ - 1), E/(1 - ν²) (λ - 1)."""
    strain = STRETCHES - 1
    for mode, modulus in [
        ("uniaxial", YOUNG),
        ("equibiaxial", YOUNG / (1 - POISSON)),
        ("planar", YOUNG / (1 - POISSON**2)),
    ]:
        curve = supple.curves("corotational_polar", mode, STRETCHES)
        np.testing.assert_allclose(curve.stress, modulus * strain, rtol=1e-10, atol=1e-10 * YOUNG)


def test_the_tangent_at_points_is_the_textbooks():
    """A = mu δ_ik δ_jl + (mu - lambda ln J) G_lk... with G = F⁻¹; Bonet and Wood (2008), ch. 6."""
    rng = np.random.default_rng(1)
    F = np.eye(3) + 0.2 * rng.standard_normal((4, 3, 3))
    eye, G = np.eye(3), np.linalg.inv(F)
    log = np.log(np.linalg.det(F))[:, None, None, None, None]
    A = MU * np.einsum("ik,jl->ijkl", eye, eye)
    A = A + LAMBDA * np.einsum("nji,nlk->nijkl", G, G)
    A = A + (MU - LAMBDA * log) * np.einsum("njk,nli->nijkl", G, G)
    found = PointLaw(read_law("neo_hookean")).tangent(F)
    np.testing.assert_allclose(found, A, rtol=1e-11, atol=1e-11 * YOUNG)


def test_fibres_across_the_load_shear_the_cube_and_leave_its_faces_free(tmp_path):
    """Along any axes: P in every entry that no machine holds is zero, and P Fᵀ is symmetric."""
    file = tmp_path / "oblique.py"
    file.write_text(OBLIQUE, encoding="utf-8")
    for axes in ((0, 1, 2), (2, 0, 1)):
        curve = supple.curves(file, "uniaxial", [0.8, 1.0, 1.4], axes=axes)
        P, F = curve.nominal, curve.deformation
        free = P - P * np.eye(3)[0] * np.eye(3)[0][:, None]
        np.testing.assert_allclose(free, 0.0, atol=1e-8)
        kirchhoff = P @ np.swapaxes(F, 1, 2)
        np.testing.assert_allclose(kirchhoff, np.swapaxes(kirchhoff, 1, 2), atol=1e-8)
        assert np.abs(F[0] - np.diag(np.diag(F[0]))).max() > 0.01
        assert abs(curve.stress[1]) < 1e-9


def test_axes_turn_the_test_and_not_the_material(tmp_path):
    """Pulled along z with the fibre along z is pulled along x with the fibre along x."""
    file = tmp_path / "oblique.py"
    file.write_text(OBLIQUE, encoding="utf-8")
    for mode in MODES:
        x = [0.8, 1.3]
        a = supple.curves(file, mode, x, axes=(2, 0, 1), fibre=(0.0, 0.0, 1.0))
        b = supple.curves(file, mode, x, fibre=(1.0, 0.0, 0.0))
        np.testing.assert_allclose(a.nominal, b.nominal, rtol=1e-9, atol=1e-7)


def test_a_law_ends_where_its_chains_are_straight(tmp_path):
    """Gent in simple shear: γ² = limit, both ways; beyond it there is NaN, no number."""
    file = tmp_path / "limited.py"
    file.write_text(LIMITED, encoding="utf-8")
    point, mode = PointLaw(read_law(file)), MODES["simple_shear"]
    curve = along(point, mode, Range(shear=2.0).values(mode))
    found = {x.side: x.value for x in limits.ends(point, curve)}
    assert found == {
        "below": pytest.approx(-np.sqrt(2), abs=1e-4),
        "above": pytest.approx(np.sqrt(2), abs=1e-4),
    }
    assert np.array_equal(np.isfinite(curve.stress), np.abs(curve.values) < np.sqrt(2))


def test_a_cube_that_collapses_sideways_has_an_end():
    """Saint Venant–Kirchhoff, uniaxial: e_t = -ν e, so it is flat at λ = √(1 + 1/ν)."""
    point = PointLaw(read_law("saint_venant_kirchhoff"))
    curve = along(point, MODES["uniaxial"], Range((0.5, 3.0)).values(MODES["uniaxial"]))
    (end,) = limits.ends(point, curve)
    assert end.side == "above"
    assert end.value == pytest.approx(np.sqrt(1 + 1 / POISSON), abs=1e-3)


@pytest.mark.parametrize(
    ("given", "says"),
    [
        ({"mode": "biaxial"}, "mode must be one of uniaxial, equibiaxial, .*got 'biaxial'"),
        ({"values": [1.0, 0.0]}, "each stretch must be above 0, got 0"),
        ({"values": [np.nan]}, "values must be numbers"),
        ({"axes": (0, 0, 1)}, "axes must be 0, 1 and 2 in some order"),
        ({"yuong": 1.0}, "did you mean young"),
        ({"young": -1.0}, "young must lie in"),
    ],
)
def test_a_wrong_request_is_one_sentence(given, says):
    with pytest.raises(supple.InputError, match=says):
        supple.curves("neo_hookean", **({"mode": "uniaxial", "values": [1.1]} | given))
