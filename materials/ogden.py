"""Ogden solid of three terms, nearly incompressible. Ogden (1972), Proc. R. Soc. Lond. A 326.

Σ mu/alpha (λ1_bar^α + λ2_bar^α + λ3_bar^α - 3), alpha any real number but 0; small-strain shear
modulus Σ mu alpha/2. FEBio: m_i = alpha_i, c_i = mu_i alpha_i. Defaults: Treloar's rubber, ibid.
"""

from supple.energy import Kinematics, Number, Pa, log_volumetric


def psi_dev(
    k: Kinematics, mu1: Pa(signed=True) = 6.3e5, alpha1: Number = 1.3,
    mu2: Pa(signed=True) = 1.2e3, alpha2: Number = 5.0,
    mu3: Pa(signed=True) = -1e4, alpha3: Number = -2.0,
):  # fmt: skip
    terms = ((mu1, alpha1), (mu2, alpha2), (mu3, alpha3))
    return sum(m / a * (k.J ** (-a / 3) * k.stretch_sum(a) - 3) for m, a in terms)


def psi_vol(J, bulk: Pa = 1e7):
    return log_volumetric(J, bulk)
