"""Yeoh solid, a cubic in I1_bar, nearly incompressible. Yeoh (1993), Rubber Chem. Technol. 66.

FEBio's "Yeoh" has the same c1, c2, c3. Defaults: of the order of breast tissue.
"""

from supple.energy import Kinematics, Pa, log_volumetric


def psi_dev(
    k: Kinematics, c1: Pa = 300.0, c2: Pa(signed=True) = 200.0, c3: Pa(signed=True) = 100.0
):
    x = k.I1_bar - 3
    return c1 * x + c2 * x**2 + c3 * x**3


def psi_vol(J, bulk: Pa = 1e4):
    return log_volumetric(J, bulk)
