"""Holzapfel–Ogden myocardium, stress free. Holzapfel, Ogden (2009), Phil. Trans. A 367, eq. 5.38.

The matrix takes I1_bar, which has no stress at rest; fibres and sheets, of the whole I4, pull only.
Defaults: Table 1, simple shear of pig myocardium.
"""

from supple.energy import Direction, Kinematics, Number, Pa, axes, exp, ogden_volumetric, positive

exceptions = {"isotropic"}


def psi_dev(
    k: Kinematics, a: Pa = 59.0, b: Number(above=0.0) = 8.023,
    a_f: Pa = 18472.0, b_f: Number(above=0.0) = 16.026,
    a_s: Pa = 2481.0, b_s: Number(above=0.0) = 11.12,
    a_fs: Pa = 216.0, b_fs: Number(above=0.0) = 11.436,
    fibre: Direction = (1.0, 0.0, 0.0), sheet: Direction = (0.0, 1.0, 0.0),
):  # fmt: skip
    along, across, _ = axes(fibre, sheet)
    f, s, fs = positive(k.I4(along) - 1), positive(k.I4(across) - 1), k.I8(along, across)
    terms = ((a_f, b_f, f), (a_s, b_s, s), (a_fs, b_fs, fs))
    matrix = a / (2 * b) * (exp(b * (k.I1_bar - 3)) - 1)
    return matrix + sum(m / (2 * c) * (exp(c * x**2) - 1) for m, c, x in terms)


def psi_vol(J, bulk: Pa = 1e5):
    return ogden_volumetric(J, bulk)
