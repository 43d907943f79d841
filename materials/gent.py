"""Gent solid, stiffening to a limit of I1_bar - 3. Gent (1996), Rubber Chem. Technol. 69.

Its energy is no number past the limit: a solve that gets there cuts its step.
"""

from supple.energy import Kinematics, Number, Pa, ln, log_volumetric


def psi_dev(k: Kinematics, mu: Pa = 1e3, limit: Number(above=0.0) = 10.0):
    return -mu / 2 * limit * ln(1 - (k.I1_bar - 3) / limit)


def psi_vol(J, bulk: Pa = 1e4):
    return log_volumetric(J, bulk)
