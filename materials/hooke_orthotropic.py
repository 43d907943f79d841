"""Hooke's law in small strain, orthotropic. Lekhnitskii (1963), Theory of Elasticity, chapter 1.

Axes f, s, n = f × s; poisson_ij: contraction along j of tension along i; poisson_ji = poisson_ij
young_j/young_i. Stable where ``space`` is above 0. FEBio's E1, v12, G12, … with 1, 2, 3 = f, s, n.
"""

from supple.energy import Direction, Kinematics, Number, Pa, axes, dot

exceptions = {"objective", "isotropic", "barrier"}


def psi(
    k: Kinematics, young_f: Pa = 6e3, young_s: Pa = 4e3, young_n: Pa = 3e3,
    poisson_fs: Number = 0.3, poisson_sn: Number = 0.25, poisson_nf: Number = 0.2,
    shear_fs: Pa = 2e3, shear_sn: Pa = 1.5e3, shear_nf: Pa = 1.2e3,
    fibre: Direction = (1.0, 0.0, 0.0), sheet: Direction = (0.0, 1.0, 0.0),
):  # fmt: skip
    f, s, n = axes(fibre, sheet)
    ff, ss, nn = (dot(a, k.small_strain * a) for a in (f, s, n))
    fs, sn, nf = (dot(a, k.small_strain * b) for a, b in ((f, s), (s, n), (n, f)))
    ratios = ((poisson_fs, young_s / young_f), (poisson_sn, young_n / young_s),
              (poisson_nf, young_f / young_n))  # fmt: skip
    sf, ns, fn = (poisson * ratio for poisson, ratio in ratios)
    space = 1 - poisson_fs * sf - poisson_sn * ns - poisson_nf * fn - 2 * sf * ns * fn
    rows = (
        (young_f, ff, ss, poisson_sn * ns, sf + poisson_nf * poisson_sn),
        (young_s, ss, nn, poisson_nf * fn, ns + poisson_fs * poisson_nf),
        (young_n, nn, ff, poisson_fs * sf, fn + poisson_sn * poisson_fs),
    )
    normal = sum(y * ((1 - loss) * a**2 / 2 + both * a * b) for y, a, b, loss, both in rows) / space
    return normal + 2 * (shear_fs * fs**2 + shear_sn * sn**2 + shear_nf * nf**2)
