"""The body of a solid's tangent on its loaded shape: FFCx's graph of the law within `solid`."""

from __future__ import annotations

from typing import Any

import numpy as np
import ufl

from . import solid
from .body import of_values
from .expressions import Code
from .terminals import index


def write(
    law: Any, fields: dict[str, Any], made: solid.Solid, ir: Any, options: Any
) -> tuple[str, list[str]]:
    """C of the body, and the names of the fields that it reads, "u" first.

    Args:
        law: forms.common.PointLaw.
        fields: coefficients of the kernel by name.
        made: geometry and points.
        ir: FFCx's representation of the law's values.
        options: FFCx's.
    """
    found = ufl.algorithms.extract_coefficients(law.values)
    used = [found[p] for p in ir.expressions[0].original_coefficient_positions]
    names = [n for n, c in fields.items() if n == "u" or any(c is v for v in used)]
    starts = np.cumsum([0, *(_size(fields[n]) for n in names)])
    outside = {id(fields[n]): int(start) for n, start in zip(names, starts[:-1], strict=True)}
    inside = [(c, k) for c in used for k in range(_size(c))]

    def values(F: list[str]) -> tuple[list[str], list[str | None]]:
        def entry(node: Any) -> Code:
            coefficient, k = inside[int(index(node, ""))]
            is_given = coefficient is law.F
            return Code(F[k] if is_given else f"w[{outside[id(coefficient)] + k}]", "vec")

        return of_values(ir.expressions[0], options, entry)

    return solid.tangent(made, values), names


def _size(coefficient: Any) -> int:
    return int(coefficient.ufl_function_space().ufl_element().dim)
