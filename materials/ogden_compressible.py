"""Compressible Ogden solid of three terms. Ogden (1972), Proc. R. Soc. Lond. A 328.

FEBio's "Ogden unconstrained" with m_i = alpha_i, c_i = mu_i alpha_i, cp = lmbda; alpha any real
number but 0. Small strain: shear modulus Σ mu alpha/2, Lamé's first constant lmbda.
"""

from supple.energy import Kinematics, Number, Pa, ln


def psi(
    k: Kinematics, mu1: Pa(signed=True) = 500.0, alpha1: Number = 2.0,
    mu2: Pa(signed=True) = 20.0, alpha2: Number = 8.0,
    mu3: Pa(signed=True) = -50.0, alpha3: Number = -3.0, lmbda: Pa(minimum=0.0) = 2e3,
):  # fmt: skip
    terms = ((mu1, alpha1), (mu2, alpha2), (mu3, alpha3))
    shear = sum(m / a * (k.stretch_sum(a) - 3 - a * ln(k.J)) for m, a in terms)
    return shear + lmbda / 2 * (k.J - 1) ** 2
