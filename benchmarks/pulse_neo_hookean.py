"""fenicsx-pulse's NeoHookean with its Compressible2."""

from supple.energy import Kinematics, Pa, ogden_volumetric


def psi_dev(k: Kinematics, mu: Pa = 1e3):
    return mu / 2 * (k.I1_bar - 3)


def psi_vol(J, bulk: Pa = 1e4):
    return ogden_volumetric(J, bulk)
