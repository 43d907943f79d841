"""Demiray's isotropic exponential solid, an isotropic Fung. Demiray (1972), J. Biomech. 5.

mu/(2 b) (exp(b (I1_bar - 3)) - 1); small-strain shear modulus mu.
"""

from supple.energy import Kinematics, Number, Pa, exp, log_volumetric


def psi_dev(k: Kinematics, mu: Pa = 1e3, b: Number(above=0.0) = 3.0):
    return mu / (2 * b) * (exp(b * (k.I1_bar - 3)) - 1)


def psi_vol(J, bulk: Pa = 1e4):
    return log_volumetric(J, bulk)
