"""Fung's orthotropic exponential solid. Fung, Fronek, Patitucci (1979), Am. J. Physiol. 237.

c/2 (exp(Q) - 1), Q quadratic in the isochoric Ē along f, s, n = f × s, with shears. FEBio: c a_ii =
2 mu_i + lambda_ii, c a_ij = lambda_ij, c g_ij = mu_i + mu_j.
"""

from supple.energy import Direction, Kinematics, Number, Pa, axes, dot, exp, log_volumetric

exceptions = {"isotropic"}


def psi_dev(
    k: Kinematics, c: Pa = 2e3,
    a_ff: Number = 2.0, a_ss: Number = 1.5, a_nn: Number = 1.0,
    a_fs: Number = 0.5, a_sn: Number = 0.4, a_nf: Number = 0.3,
    g_fs: Number = 1.2, g_sn: Number = 0.9, g_nf: Number = 1.0,
    fibre: Direction = (1.0, 0.0, 0.0), sheet: Direction = (0.0, 1.0, 0.0),
):  # fmt: skip
    f, s, n = axes(fibre, sheet)
    ff, ss, nn = dot(f, k.E_bar * f), dot(s, k.E_bar * s), dot(n, k.E_bar * n)
    fs, sn, nf = dot(f, k.E_bar * s), dot(s, k.E_bar * n), dot(n, k.E_bar * f)
    normal = a_ff * ff**2 + a_ss * ss**2 + a_nn * nn**2
    coupled = 2 * (a_fs * ff * ss + a_sn * ss * nn + a_nf * nn * ff)
    shear = 2 * (g_fs * fs**2 + g_sn * sn**2 + g_nf * nf**2)
    return c / 2 * (exp(normal + coupled + shear) - 1)


def psi_vol(J, bulk: Pa = 1e5):
    return log_volumetric(J, bulk)
