"""∫ N_a N_b dV of an element's shape functions: what projects point values onto the nodes."""

from __future__ import annotations

import ufl

from ..elements import LOAD_DEGREE, scalar_element
from ..elements import space as make_space
from .common import Forms, measure


def mass(element: str) -> Forms:
    """The one kernel mass (nodes × nodes), m³, on the mesh itself."""
    space, degree = make_space(element), LOAD_DEGREE[element]
    V = ufl.FunctionSpace(space.mesh, scalar_element(element))
    product = ufl.TestFunction(V) * ufl.TrialFunction(V) * measure(space, degree)
    return Forms(space, {}, {"mass": product}, degree)
