"""Holmes–Mow solid (cartilage). Holmes and Mow (1990), J. Biomech. 23.

h/(4β) (exp(Q) - 1), Q = β/h ((2μ - λ)(I1 - 3) + λ (I2 - 3)) - 2β ln J, h = λ + 2μ; FEBio's E, v,
beta.
"""

from supple.energy import Kinematics, Number, Pa, Ratio, exp, lame, ln


def psi(k: Kinematics, young: Pa = 5e5, poisson: Ratio = 0.1, beta: Number(above=0.0) = 0.35):
    mu, lmbda = lame(young, poisson)
    h = lmbda + 2 * mu
    linear = (2 * mu - lmbda) * (k.I1 - 3) + lmbda * (k.I2 - 3)
    return h / (4 * beta) * (exp(beta * (linear / h - 2 * ln(k.J))) - 1)
