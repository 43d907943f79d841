"""Nearly incompressible neo-Hookean solid, uncoupled. Simo, Taylor, Pister (1985), CMAME 51.

FEBio's "incomp neo-Hookean" (G = mu, k = bulk) and SOFA's "NeoHookean".
"""

from supple.energy import Kinematics, Pa, log_volumetric


def psi_dev(k: Kinematics, mu: Pa = 1e3):
    return mu / 2 * (k.I1_bar - 3)


def psi_vol(J, bulk: Pa = 1e4):
    return log_volumetric(J, bulk)
