"""What energy files see: invariants and stretches against eigenvalues, volumetric pairs."""

from __future__ import annotations

import numpy as np
import pytest

from supple.kernels import energy
from supple.kernels.kinematics import Kinematics, Unavailable
from supple.kernels.membrane_kinematics import SurfaceKinematics
from supple.kernels.tensors import Tensor

F = np.array([[1.1, 0.2, 0.0], [0.1, 0.9, 0.15], [-0.05, 0.1, 1.2]])
EDGES = np.array([[1.0, 0.2, 0.1], [0.1, 0.9, 0.3], [0.0, 0.2, 1.1]])
STRETCHES = np.linalg.svd(F, compute_uv=False)


@pytest.fixture
def k():
    return Kinematics(F.view(Tensor), EDGES.view(Tensor))


def test_invariants_are_those_of_the_stretches(k):
    """I1 = Σ λ², I2 = Σ λi² λj², I3 = J² = Π λ², the barred ones at unit volume, tr U = Σ λ."""
    a, b, c = STRETCHES**2
    J = a**0.5 * b**0.5 * c**0.5
    assert pytest.approx(a + b + c) == k.I1
    assert pytest.approx(a * b + b * c + c * a) == k.I2
    assert pytest.approx(a * b * c) == k.I3
    assert pytest.approx(J) == k.J
    assert k.I1_bar == pytest.approx((a + b + c) / J ** (2 / 3))
    assert k.I2_bar == pytest.approx((a * b + b * c + c * a) / J ** (4 / 3))
    assert k.trace_U == pytest.approx(STRETCHES.sum())


def test_tensors_are_those_of_the_polar_decomposition(k):
    """C = FᵀF = U², B = FFᵀ, E = (C - I)/2; U symmetric with the stretches for eigenvalues."""
    np.testing.assert_allclose(k.C, F.T @ F)
    np.testing.assert_allclose(k.B, F @ F.T)
    np.testing.assert_allclose(k.E, (F.T @ F - np.eye(3)) / 2)
    np.testing.assert_allclose(k.U @ k.U, F.T @ F, atol=1e-14)
    np.testing.assert_allclose(np.linalg.eigvalsh(k.U)[::-1], STRETCHES)


def test_fibre_invariants_are_squared_lengths_and_angles(k):
    """I4 = |F f|², I8 = F f · F s."""
    f, s = (np.array(v).view(Tensor) for v in ([1.0, 0, 0], [0, 0.6, 0.8]))
    assert k.I4(f) == pytest.approx((F @ f) @ (F @ f))
    assert k.I8(f, s) == pytest.approx((F @ f) @ (F @ s))


def test_qr_strain_is_that_of_numpys_factors(k):
    """sym(R R0⁻¹) - I, R and R0 of the edges after and before, diagonals positive."""

    def upper(a):
        r = np.linalg.qr(a)[1]
        return np.sign(np.diag(r))[:, None] * r

    ratio = upper(F @ EDGES) @ np.linalg.inv(upper(EDGES))
    np.testing.assert_allclose(k.qr_strain, (ratio + ratio.T) / 2 - np.eye(3), atol=1e-14)


@pytest.mark.parametrize("name", ["log_volumetric", "quadratic_volumetric", "ogden_volumetric"])
@pytest.mark.parametrize("J", [0.7, 1.0, 1.3])
def test_mixed_form_of_a_volumetric_energy_is_the_energy_at_its_best_pressure(name, J):
    """max over p of p g(J) - U*(p) is U(J), so the mixed and the displacement form agree."""
    from scipy.optimize import minimize_scalar

    v = getattr(energy, name)(J, 1e4)
    best = minimize_scalar(
        lambda p: v.conjugate(p) - p * v.g, bounds=(-9e3, 3.6e3), options={"xatol": 1e-4}
    )
    assert -best.fun == pytest.approx(v.U, abs=1e-6)
    assert getattr(energy, name)(1.0, 1e4).U == 0.0


def test_lame_constants_are_those_of_the_textbook():
    """E = μ (3λ + 2μ)/(λ + μ), ν = λ/(2 (λ + μ))."""
    mu, lmbda = energy.lame(3e3, 0.3)
    assert mu * (3 * lmbda + 2 * mu) / (lmbda + mu) == pytest.approx(3e3)
    assert lmbda / (2 * (lmbda + mu)) == pytest.approx(0.3)


def test_sums_over_stretches_are_those_of_the_singular_values(k):
    """Σ λ^α for exponents of either sign, and Σ ln²λ."""
    for alpha in (-2.5, 0.7, 2.0, 11.0):
        assert k.stretch_sum(alpha) == pytest.approx((STRETCHES**alpha).sum(), rel=1e-13)
    assert k.log_stretch_squares == pytest.approx((np.log(STRETCHES) ** 2).sum(), rel=1e-13)


def test_further_strains_and_fibre_invariants_are_their_definitions(k):
    """Ē = (C J^(-2/3) - I)/2, ε = sym F - I, I4_bar = J^(-2/3) I4, I5 = |C f|²."""
    f, C = np.array([0.0, 0.6, 0.8]).view(Tensor), F.T @ F
    unit = np.linalg.det(F) ** (-2 / 3)
    np.testing.assert_allclose(k.E_bar, (unit * C - np.eye(3)) / 2)
    np.testing.assert_allclose(k.small_strain, (F + F.T) / 2 - np.eye(3))
    assert k.I4_bar(f) == pytest.approx(unit * f @ C @ f)
    assert k.I5(f) == pytest.approx(np.asarray(f) @ C @ C @ np.asarray(f))


def test_a_membrane_has_the_invariants_of_its_plane():
    """I1_s = λ1² + λ2², J_s = λ1 λ2, λ3 = 1/J_s; the sums over stretches take all three."""
    m = SurfaceKinematics(np.diag([1.44, 0.81]).view(Tensor))
    assert pytest.approx(2.25) == m.I1_s
    assert pytest.approx(1.08) == m.J_s
    assert m.J == 1.0
    assert m.trace_U == pytest.approx(1.2 + 0.9 + 1 / 1.08)
    assert m.stretch_sum(3.0) == pytest.approx(1.2**3 + 0.9**3 + 1.08**-3)
    assert pytest.approx(2.25 + 1.08**-2) == m.I1


@pytest.mark.parametrize("word", ["I1_s", "J_s"])
def test_a_solid_has_no_plane(k, word):
    """Said in one sentence with the word to use."""
    with pytest.raises(Unavailable, match=rf"k\.{word} is of a membrane's plane; use it in"):
        getattr(k, word)


def test_axes_are_orthonormal_and_right_handed():
    """The first kept, the second's part across it, their vector product."""
    f = np.array([2.0, 1.0, -2.0]).view(Tensor) / 3
    q = np.column_stack(energy.axes(f, np.array([0.3, 1.0, 0.2]).view(Tensor)))
    np.testing.assert_allclose(q.T @ q, np.eye(3), atol=1e-15)
    np.testing.assert_allclose(q[:, 0], f)
    assert np.linalg.det(q) == pytest.approx(1.0)
    assert q[:, 1] @ [0.3, 1.0, 0.2] > 0


def test_choose_takes_the_first_above_zero_only():
    """At zero itself the second."""
    assert [energy.choose(x, 1.0, 2.0) for x in (-1.0, 0.0, 1e-300)] == [2.0, 2.0, 1.0]
