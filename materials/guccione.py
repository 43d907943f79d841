"""Guccione's transversely isotropic myocardium. Guccione et al. (1991), J. Biomech. Eng. 113.

c/2 (exp(Q) - 1), Q = b_f Ē_ff² + b_t (Ē_ss² + Ē_nn² + 2 Ē_sn²) + 2 b_fs (Ē_fs² + Ē_fn²), isochoric;
written with Ē:Ē and |Ē f|², so that no sheet direction is needed.
"""

from supple.energy import Direction, Kinematics, Number, Pa, dot, exp, inner, log_volumetric

exceptions = {"isotropic"}


def psi_dev(
    k: Kinematics, c: Pa = 876.0, b_f: Number = 18.48, b_t: Number = 3.58, b_fs: Number = 1.627,
    fibre: Direction = (1.0, 0.0, 0.0),
):  # fmt: skip
    row = k.E_bar * fibre
    along, length = dot(fibre, row) ** 2, inner(row, row)
    across = inner(k.E_bar, k.E_bar) - 2 * length + along
    return c / 2 * (exp(b_f * along + b_t * across + 2 * b_fs * (length - along)) - 1)


def psi_vol(J, bulk: Pa = 1e5):
    return log_volumetric(J, bulk)
