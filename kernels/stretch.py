"""The seed of `Kinematics.trace_U`: a closed form whose derivative is never taken."""

from __future__ import annotations

from typing import Any

import ufl

from .functions import Frozen


def trace_seed(I1: Any, I2: Any, J: Any) -> Any:
    """tr U from the closed-form eigenvalues of C, the sign of J on the smallest stretch.

    Source: Smith (1961), Commun. ACM 4(4), trigonometric eigenvalues of a symmetric 3 x 3 matrix.
    Good to about the square root of rounding where stretches coincide, which two Newton steps mend.
    """
    q = I1 / 3
    p = ufl.sqrt(ufl.max_value((I1**2 - 3 * I2) / 9, 1e-30 * q**2))
    r = (J**2 - I2 * q + I1 * q**2 - q**3) / (2 * p**3)
    phi = ufl.acos(ufl.max_value(ufl.min_value(r, 1.0), -1.0)) / 3
    largest = q + 2 * p * ufl.cos(phi)
    smallest = q + 2 * p * ufl.cos(phi + 2.0943951023931953)
    middle = I1 - largest - smallest
    root = [ufl.sqrt(ufl.max_value(x, 0.0)) for x in (largest, middle, smallest)]
    sign = ufl.conditional(ufl.lt(J, 0.0), -1.0, 1.0)
    return Frozen(root[0] + root[1] + sign * root[2])
