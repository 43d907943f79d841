"""Hooke's law in small strain, isotropic. Timoshenko and Goodier (1951), Theory of Elasticity, §6.

Linear, so a body swells as it turns; saint_venant_kirchhoff and corotational_polar do not.
"""

from supple.energy import Kinematics, Pa, Ratio, inner, lame, tr

exceptions = {"objective", "barrier"}


def psi(k: Kinematics, young: Pa = 3e3, poisson: Ratio = 0.3):
    mu, lmbda = lame(young, poisson)
    return lmbda / 2 * tr(k.small_strain) ** 2 + mu * inner(k.small_strain, k.small_strain)
