"""Fung-type exponential skin, a membrane that keeps its volume. Fung (1993), Biomechanics, ch. 7.

mu/(2 b) (exp(b (I1_s + 1/J_s² - 3)) - 1): isotropic, 1/J_s the stretch of its thickness. Small
strain: shear modulus mu, Young's 3 mu.
"""

from supple.energy import Kinematics, Number, Pa, exp


def psi_surface(k: Kinematics, mu: Pa = 7.5e3, b: Number(above=0.0) = 3.0):
    return mu / (2 * b) * (exp(b * (k.I1_s + 1 / k.J_s**2 - 3)) - 1)
