"""Compressible neo-Hookean solid. Mazier 2022, eq. 56."""

from supple.energy import Kinematics, Pa, Ratio, lame, ln


def psi(k: Kinematics, young: Pa = 3e3, poisson: Ratio = 0.3):
    mu, lmbda = lame(young, poisson)
    return mu / 2 * (k.I1 - 3) - mu * ln(k.J) + lmbda / 2 * ln(k.J) ** 2
