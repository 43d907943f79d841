"""Corotational solid, rotation from the polar decomposition: Hooke's law in the strain U - I.

With tr(U - I) = tr U - 3 and (U - I):(U - I) = I1 - 2 tr U + 3. Müller and Gross (2004), GI 2004.
"""

from supple.energy import Kinematics, Pa, Ratio, lame

exceptions = {"barrier"}


def psi(k: Kinematics, young: Pa = 3e3, poisson: Ratio = 0.3):
    mu, lmbda = lame(young, poisson)
    return lmbda / 2 * (k.trace_U - 3) ** 2 + mu * (k.I1 - 2 * k.trace_U + 3)
