"""Mooney–Rivlin with one fibre family, toe and line. Weiss, Maker, Govindjee (1996), CMAME 135.

The fibre's λ dF/dλ is 0 below λ = 1, c3 (exp(c4 (λ - 1)) - 1) up to lam_max, then c5 λ + c6 with c6
making it continuous, λ² = I4_bar; FEBio's "trans iso Mooney-Rivlin". Defaults: human knee ligament,
Gardiner and Weiss (2003), J. Orthop. Res. 21.
"""

from supple.energy import (
    Direction,
    Ei,
    Kinematics,
    Number,
    Pa,
    choose,
    exp,
    ln,
    log_volumetric,
    sqrt,
)  # fmt: skip

exceptions = {"isotropic"}


def toe(stretch, c3, c4):
    return c3 * (exp(-c4) * (Ei(c4 * stretch) - Ei(c4)) - ln(stretch))


def psi_dev(
    k: Kinematics, c1: Pa = 1.44e6, c2: Pa(minimum=0.0) = 0.0, c3: Pa = 5.7e5,
    c4: Number(above=0.0) = 48.0, c5: Pa = 4.671e8, lam_max: Number(above=1.0) = 1.063,
    fibre: Direction = (1.0, 0.0, 0.0),
):  # fmt: skip
    stretch = sqrt(k.I4_bar(fibre))
    c6 = c3 * (exp(c4 * (lam_max - 1)) - 1) - c5 * lam_max
    line = toe(lam_max, c3, c4) + c5 * (stretch - lam_max) + c6 * ln(stretch / lam_max)
    pulled = choose(stretch - lam_max, line, toe(stretch, c3, c4))
    return c1 * (k.I1_bar - 3) + c2 * (k.I2_bar - 3) + choose(stretch - 1, pulled, 0.0)


def psi_vol(J, bulk: Pa = 1.44e8):
    return log_volumetric(J, bulk)
