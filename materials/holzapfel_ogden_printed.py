"""Holzapfel–Ogden as printed in Mazier 2022, eq. 71: under stress at rest, for comparison only.

I1 is neither isochoric nor balanced by -a ln J, so P = a I at F = I; fibres push too. Constants of
the published script, ten times the text's. Use holzapfel_ogden for anything else.
"""

from supple.energy import Direction, Kinematics, Number, Pa, exp, ogden_volumetric

exceptions = {"stress_free", "isotropic"}


def psi_dev(
    k: Kinematics, a: Pa = 1e6, b: Number(above=0.0) = 5.0,
    a_f: Pa = 1.6e5, b_f: Number(above=0.0) = 12.8, a_s: Pa = 1.8e5, b_s: Number(above=0.0) = 10.0,
    a_fs: Pa = 9e3, b_fs: Number(above=0.0) = 12.0,
    fibre: Direction = (0.0, 1.0, 1.0), sheet: Direction = (0.0, 1.0, -1.0),
):  # fmt: skip
    f, s, fs = k.I4(fibre) - 1, k.I4(sheet) - 1, k.I8(fibre, sheet)
    terms = ((a_f, b_f, f), (a_s, b_s, s), (a_fs, b_fs, fs))
    matrix = a / (2 * b) * exp(b * (k.I1 - 3))
    return matrix + sum(m / (2 * c) * (exp(c * x**2) - 1) for m, c, x in terms)


def psi_vol(J, bulk: Pa = 1e9):
    return ogden_volumetric(J, bulk)
