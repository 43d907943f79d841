"""Stable neo-Hookean solid, no barrier at J = 0. Smith, de Goes, Kim (2018), ACM Trans. Graph. 37.

mu/2 (I1 - 3) - mu/2 ln(I1 + 1) + lambda/2 (J - alpha)², mu = 4/3 mu_Hooke and lambda = lambda_Hooke
+ 5/6 mu_Hooke, which is Hooke's law at small strain; shifted to 0 at rest, where alpha drops out.
"""

from supple.energy import Kinematics, Pa, Ratio, lame, ln

exceptions = {"barrier"}


def psi(k: Kinematics, young: Pa = 3e3, poisson: Ratio = 0.45):
    mu_hooke, lmbda_hooke = lame(young, poisson)
    mu, lmbda = 4 / 3 * mu_hooke, lmbda_hooke + 5 / 6 * mu_hooke
    isochoric = mu / 2 * (k.I1 - 3 - ln((k.I1 + 1) / 4))
    return isochoric + lmbda / 2 * (k.J - 1) ** 2 - 3 / 4 * mu * (k.J - 1)
