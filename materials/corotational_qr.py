"""Corotational solid, rotation from the QR factors of the cell's edges. Mazier 2022, eq. 75.

An energy with an exact tangent, not SOFA's force, which is no gradient and differs at second order.
It depends on the order of the cell's vertices, so it is not isotropic.
"""

from supple.energy import Kinematics, Pa, Ratio, inner, lame, tr

exceptions = {"isotropic", "barrier"}


def psi(k: Kinematics, young: Pa = 3e3, poisson: Ratio = 0.3):
    mu, lmbda = lame(young, poisson)
    return lmbda / 2 * tr(k.qr_strain) ** 2 + mu * inner(k.qr_strain, k.qr_strain)
