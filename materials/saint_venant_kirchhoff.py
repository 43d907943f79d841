"""Saint Venant–Kirchhoff solid: Hooke's law between S and E. Mazier 2022, eq. 67."""

from supple.energy import Kinematics, Pa, Ratio, inner, lame, tr

exceptions = {"barrier"}


def psi(k: Kinematics, young: Pa = 3e3, poisson: Ratio = 0.3):
    mu, lmbda = lame(young, poisson)
    return lmbda / 2 * tr(k.E) ** 2 + mu * inner(k.E, k.E)
