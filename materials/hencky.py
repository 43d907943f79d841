"""Hencky solid: Hooke's law in logarithmic strain. Hencky (1928), Z. Techn. Phys. 9."""

from supple.energy import Kinematics, Pa, Ratio, lame, ln


def psi(k: Kinematics, young: Pa = 3e3, poisson: Ratio = 0.3):
    mu, lmbda = lame(young, poisson)
    return mu * k.log_stretch_squares + lmbda / 2 * ln(k.J) ** 2
