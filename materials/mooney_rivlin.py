"""Nearly incompressible Mooney–Rivlin solid, uncoupled. Mooney (1940); Rivlin (1948)."""

from supple.energy import Kinematics, Pa, log_volumetric


def psi_dev(k: Kinematics, c1: Pa(minimum=0.0) = 400.0, c2: Pa(minimum=0.0) = 100.0):
    return c1 * (k.I1_bar - 3) + c2 * (k.I2_bar - 3)


def psi_vol(J, bulk: Pa = 1e4):
    return log_volumetric(J, bulk)
