"""Arruda–Boyce eight-chain solid, five terms. Arruda and Boyce (1993), J. Mech. Phys. Solids 41.

mu/N^(i-1) c_i (I1_bar^i - 3^i), N = links of a chain, the square of its limiting stretch. FEBio has
the same mu, N; SOFA fixes N = 8.
"""

from supple.energy import Kinematics, Number, Pa, log_volumetric


def psi_dev(k: Kinematics, mu: Pa = 1e3, links: Number(above=0.0) = 8.0):
    c = ((1, 1 / 2, 3), (2, 1 / 20, 9), (3, 11 / 1050, 27), (4, 19 / 7000, 81),
         (5, 519 / 673750, 243))  # fmt: skip
    return sum(mu * w / links ** (i - 1) * (k.I1_bar**i - at_rest) for i, w, at_rest in c)


def psi_vol(J, bulk: Pa = 1e4):
    return log_volumetric(J, bulk)
