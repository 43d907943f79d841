"""Compressible neo-Hookean solid in two parts, by Lamé's parameters. Mazier 2022, eq. 38.

psi_dev + psi_vol is eq. 56, `neo_hookean`; here the pressure may carry the second part.
"""

# mypy: ignore-errors
from supple.energy import Kinematics, Pa, ln, log_volumetric


def psi_dev(k: Kinematics, mu: Pa = 2e4):
    return mu / 2 * (k.I1 - 3) - mu * ln(k.J)


def psi_vol(J, lmbda: Pa = 3e6):
    return log_volumetric(J, lmbda)
