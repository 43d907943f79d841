"""What the forms share: kernels as UFL objects, their fields, the measure with its pinned rule."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import ufl

from ..elements import Space, quadrature


@dataclass(frozen=True)
class Composite:
    """A kernel written in C around calls of parts.

    Attributes:
        rows, cols: of A.
        body: statements on A, w, x; ``call_<part>(A, w, inner, x)`` adds a part, all arrays are
            [entry][LANES].
    """

    rows: int
    cols: int
    body: str


@dataclass(frozen=True)
class PointLaw:
    """A solid's law as a function of F alone, for kernels that write the geometry themselves.

    Attributes:
        F: coefficient of nine entries, row-major, that stands for the deformation gradient.
        values: the nine entries of dψ/dF, then the lower triangle of d²ψ/dF² (9 × 9) by rows.
    """

    F: Any
    values: Any


@dataclass(frozen=True)
class Forms:
    """The kernels of one term.

    Attributes:
        space: element that they live on.
        fields: coefficient name → UFL coefficient; "u" (node values) and per-cell fields.
        kernels: kernel name → UFL form, or for point values (expression, points).
        degree: of the quadrature.
        scalars: scalar unknowns behind the nodes' own (pressures).
        inner: fields that composites give to their parts; nobody sets them from outside.
        parts: like `kernels`, called by composites only.
        composites: kernel name → what is made of parts in C.
        law: of which the tangent in lanes is made, of a solid on its loaded shape.
    """

    space: Space
    fields: dict[str, Any]
    kernels: dict[str, Any]
    degree: int
    scalars: int = 0
    inner: dict[str, Any] = field(default_factory=dict)
    parts: dict[str, Any] = field(default_factory=dict)
    composites: dict[str, Composite] = field(default_factory=dict)
    law: PointLaw | None = None

    def is_symmetric(self, name: str) -> bool:
        """Whether a kernel or part is a second derivative: the tangent of what has an energy."""
        return name.endswith("tangent") and "energy" in (*self.kernels, *self.composites)


def measure(space: Space, degree: int) -> Any:
    """dx on the term's own mesh with the very points of `at_points`."""
    points, weights = quadrature(space.name, degree)
    rule = {"quadrature_rule": "custom", "quadrature_degree": int(degree),
            "quadrature_points": points, "quadrature_weights": weights}  # fmt: skip
    return ufl.Measure("dx", domain=space.mesh, metadata=rule)


def volume_scale(space: Space) -> Any:
    """|det ∂x/∂ξ| of the map from the reference cell: volume per unit of quadrature weight."""
    determinant: Any = ufl.JacobianDeterminant(space.mesh)
    return abs(determinant)


def at_points(space: Space, degree: int, *values: Any) -> tuple[Any, Any]:
    """Point values: all entries of ``values``, row-major, one after another, at each point."""
    entries: list[Any] = []
    for value in values:
        rows = value.ufl_shape
        if rows == ():
            entries.append(value)
        else:
            entries += [value[i, j] for i in range(rows[0]) for j in range(rows[1])]
    return ufl.as_vector(entries), quadrature(space.name, degree)[0]
