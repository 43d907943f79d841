"""Veronda–Westmann solid, nearly incompressible. Veronda and Westmann (1970), J. Biomech. 3, skin.

c1 (exp(c2 (I1_bar - 3)) - 1) - c1 c2/2 (I2_bar - 3), as in FEBio and SOFA; small-strain shear
modulus c1 c2.
"""

from supple.energy import Kinematics, Number, Pa, exp, log_volumetric


def psi_dev(k: Kinematics, c1: Pa = 300.0, c2: Number(above=0.0) = 2.0):
    return c1 * (exp(c2 * (k.I1_bar - 3)) - 1) - c1 * c2 / 2 * (k.I2_bar - 3)


def psi_vol(J, bulk: Pa = 1e4):
    return log_volumetric(J, bulk)
