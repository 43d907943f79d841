"""Blatz–Ko foam, Poisson's ratio 1/4. Blatz and Ko (1962), Trans. Soc. Rheol. 6, foamed rubber."""

from supple.energy import Kinematics, Pa


def psi(k: Kinematics, mu: Pa = 1e3):
    return mu / 2 * (k.I2 / k.I3 + 2 * k.J - 5)
