"""Artery wall, two dispersed fibre families. Gasser, Ogden, Holzapfel (2006), J. R. Soc. Interface.

c/2 (I1_bar - 3) + Σ k1/(2 k2) (exp(k2 ⟨e⟩²) - 1), e = κ (I1_bar - 3) + (1 - 3κ)(I4_bar - 1); fibres
pull only. Defaults: media of a rabbit carotid, Holzapfel, Gasser, Ogden (2000), J. Elast. 61.
"""

from supple.energy import Direction, Kinematics, Number, Pa, exp, log_volumetric, positive

exceptions = {"isotropic"}


def psi_dev(
    k: Kinematics, c: Pa = 3e3, k1: Pa = 2363.2, k2: Number(above=0.0) = 0.8393,
    kappa: Number(minimum=0.0, maximum=0.333333) = 0.1,
    fibre1: Direction = (0.87462, 0.48481, 0.0), fibre2: Direction = (0.87462, -0.48481, 0.0),
):  # fmt: skip
    matrix = kappa * (k.I1_bar - 3)
    e = (positive(matrix + (1 - 3 * kappa) * (k.I4_bar(f) - 1)) for f in (fibre1, fibre2))
    fibres = k1 / (2 * k2) * sum(exp(k2 * x**2) - 1 for x in e)
    return c / 2 * (k.I1_bar - 3) + fibres


def psi_vol(J, bulk: Pa = 1e5):
    return log_volumetric(J, bulk)
