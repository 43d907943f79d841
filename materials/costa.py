"""Costa's orthotropic myocardium. Costa, Holmes, McCulloch (2001), Phil. Trans. R. Soc. A 359.

c/2 (exp(Q) - 1), Q = Σ b_ij Ē_ij² along fibre, sheet and sheet normal, both shears counted; Ē is
isochoric, where SOFA's "Costa" takes E. Defaults: Usyk, Mazhari, McCulloch (2000), J. Elast. 61.
"""

from supple.energy import Direction, Kinematics, Number, Pa, axes, dot, exp, log_volumetric

exceptions = {"isotropic"}


def psi_dev(
    k: Kinematics, c: Pa = 880.0, b_ff: Number = 8.0, b_ss: Number = 6.0, b_nn: Number = 3.0,
    b_fs: Number = 12.0, b_fn: Number = 3.0, b_sn: Number = 3.0,
    fibre: Direction = (1.0, 0.0, 0.0), sheet: Direction = (0.0, 1.0, 0.0),
):  # fmt: skip
    f, s, n = axes(fibre, sheet)
    ff, ss, nn = dot(f, k.E_bar * f), dot(s, k.E_bar * s), dot(n, k.E_bar * n)
    fs, fn, sn = dot(f, k.E_bar * s), dot(f, k.E_bar * n), dot(s, k.E_bar * n)
    normal = b_ff * ff**2 + b_ss * ss**2 + b_nn * nn**2
    return c / 2 * (exp(normal + 2 * (b_fs * fs**2 + b_fn * fn**2 + b_sn * sn**2)) - 1)


def psi_vol(J, bulk: Pa = 1e5):
    return log_volumetric(J, bulk)
