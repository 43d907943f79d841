"""Mooney–Rivlin solid of five terms. Rivlin and Saunders (1951), Phil. Trans. R. Soc. A 243.

c10 x + c01 y + c20 x² + c11 x y + c02 y², x = I1_bar - 3, y = I2_bar - 3. Defaults: of the order of
breast tissue.
"""

from supple.energy import Kinematics, Pa, log_volumetric


def psi_dev(
    k: Kinematics, c10: Pa(signed=True) = 310.0, c01: Pa(signed=True) = 300.0,
    c20: Pa(signed=True) = 450.0, c11: Pa(signed=True) = 220.0, c02: Pa(signed=True) = 470.0,
):  # fmt: skip
    x, y = k.I1_bar - 3, k.I2_bar - 3
    return c10 * x + c01 * y + c20 * x**2 + c11 * x * y + c02 * y**2


def psi_vol(J, bulk: Pa = 2e4):
    return log_volumetric(J, bulk)
