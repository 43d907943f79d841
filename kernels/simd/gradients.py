"""Tangents through the derivative of stress at each point.

Where a bilinear form takes its arguments by their gradients alone,

    w ∂_K v_a C[aK, bL] ∂_L u_b

C (9, 9) and the inverse Jacobian G of the map from the reference cell are what FFCx is asked for,
as values at points. What the derivatives of shape functions on the reference cell are multiplied
with is then, with the map's determinant and the weight w in one of the two G,

    f[ak, bl] = Σ_K G[k, K] (Σ_L C[aK, bL] G[l, L])
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import basix.ufl
import numpy as np
import ufl
from ufl.algorithms import expand_derivatives
from ufl.algorithms.apply_derivatives import apply_derivatives
from ufl.algorithms.apply_function_pullbacks import apply_function_pullbacks
from ufl.algorithms.apply_geometry_lowering import apply_geometry_lowering
from ufl.algorithms.map_integrands import map_integrand_dags
from ufl.algorithms.remove_complex_nodes import remove_complex_nodes
from ufl.constantvalue import Zero
from ufl.corealg.multifunction import MultiFunction

from .contraction import Slot
from .linear import NotLinear, ScalarGraph
from .tables import number

_NINE = range(9)


@dataclass(frozen=True)
class PointTangent:
    """A bilinear form by values at its points.

    Attributes:
        values: vector of the entries of C, of G (9) and of G times the map's determinant (9), all
            lowered as FFCx lowers expressions.
        stand_in: an expression of the same coefficients and elements that is not.
        points, weights: of the form's rule.
        places: (row, column) of each entry of C.
    """

    values: Any
    stand_in: Any
    points: Any
    weights: Any
    places: list[tuple[int, int]]


class _Constants(MultiFunction):
    """Gradients of arguments replaced by tensors without a place."""

    expr = MultiFunction.reuse_if_untouched

    def __init__(self, gradients: list[Any]) -> None:
        super().__init__()  # type: ignore[no-untyped-call]
        self._gradients = gradients

    def grad(self, o: Any) -> Any:
        (argument,) = o.ufl_operands
        if not isinstance(argument, ufl.Argument):
            return o
        entries = self._gradients[argument.number()]
        return ufl.as_matrix([[entries[3 * a + K] for K in range(3)] for a in range(3)])

    def argument(self, o: Any) -> Any:
        raise NotLinear


def point_tangent(form: Any, symmetric: bool) -> PointTangent | None:
    """Of a bilinear form on a solid; of a symmetric one the lower triangle of C.

    None where an argument enters otherwise than by its gradient.
    """
    mesh = form.ufl_domain()
    if mesh.topological_dimension != 3:
        return None
    element = basix.ufl.element("DG", mesh.ufl_cell().cellname, 0, shape=(9,))
    space = ufl.FunctionSpace(mesh, element)
    test, trial = ufl.TestFunction(space), ufl.TrialFunction(space)
    try:
        constant = map_integrand_dags(_Constants([test, trial]), expand_derivatives(form))
        (integral,) = constant.integrals()
        C = _tensor(integral.integrand(), test, trial, symmetric)
    except NotLinear:
        return None
    G, scale = ufl.JacobianInverse(mesh), _determinant(mesh)
    inverse = [G[k, K] for k in range(3) for K in range(3)]
    geometry = _lowered(ufl.as_vector([*inverse, *(g * scale for g in inverse)]))
    values = ufl.as_vector([*C.values(), *(geometry[i] for i in range(18))])
    stand_in = sum((ufl.inner(c, c) for c in form.coefficients()), scale)
    rule = integral.metadata()
    return PointTangent(values, stand_in, rule["quadrature_points"], rule["quadrature_weights"],
                        list(C))  # fmt: skip


def _tensor(integrand: Any, test: Any, trial: Any, symmetric: bool) -> dict[tuple[int, int], Any]:
    graph = ScalarGraph([_lowered(integrand)])
    rows = graph.coefficients(graph.roots[0], test)
    of_trial = ScalarGraph(list(rows.values()))
    C = {}
    for row, root in zip(rows, of_trial.roots, strict=True):
        for column, value in sorted(of_trial.coefficients(root, trial).items()):
            if not isinstance(value, Zero) and (column <= row or not symmetric):
                C[row, column] = value
    return C


def _determinant(mesh: Any) -> Any:
    determinant: Any = ufl.JacobianDeterminant(mesh)
    return abs(determinant)


def _lowered(integrand: Any) -> Any:
    """As FFCx lowers an expression: values on the reference cell, geometry by its Jacobian."""
    kept = (ufl.classes.Jacobian,)
    lowered = apply_function_pullbacks(remove_complex_nodes(integrand))
    for _ in range(2):
        lowered = apply_derivatives(apply_geometry_lowering(lowered, kept))
    return lowered


def derivatives(element: Any, points: Any) -> dict[str, Any]:
    """Tables D0, D1, D2 of a scalar element's derivatives, (points or 1, shape functions)."""
    values = element.tabulate(1, points)[1:4]
    whole = np.round(values)
    values = np.where(abs(values - whole) < 1e-14, whole, values)
    same = np.abs(values - values[:, :1]).max() < 1e-14
    return {f"D{k}": table[:1] if same else table for k, table in enumerate(values)}


class PulledBack:
    """C of f, from C of the values' entries."""

    def __init__(self, tangent: PointTangent, values: list[str], symmetric: bool) -> None:
        count = len(tangent.places)
        self._C = dict(zip(tangent.places, values, strict=False))
        if symmetric:
            self._C |= {(c, r): value for (r, c), value in self._C.items()}
        self._G, self._scaled = values[count : count + 9], values[count + 9 :]
        self._symmetric, self._weights = symmetric, tangent.weights
        self._half: dict[tuple[int, int], str] = {}
        self.lines: list[str] = []

    def blocks(self, count: int) -> list[tuple[tuple[Slot, ...], str]]:
        """Blocks of ``count`` shape functions; writes ``lines``."""
        if len(self._weights) == 1:
            weight = number(self._weights[0])
            self._scaled = [self._named(f"g_{m}", f"{g} * {weight}")
                            for m, g in enumerate(self._scaled)]  # fmt: skip
        pairs = [(row, column) for row in _NINE for column in _NINE]
        f = {(r, c): self._pulled_back(r, c) for r, c in pairs if r >= c or not self._symmetric}
        slots = [Slot(0, 3, count, m // 3, f"D{m % 3}") for m in _NINE]
        mirrored = ((r, c, (r, c) if (r, c) in f else (c, r)) for r, c in pairs)
        return [((slots[r], slots[c]), f[pair]) for r, c, pair in mirrored if f[pair]]

    def _pulled_back(self, row: int, column: int) -> str:
        """f[ak, bl], "" where it vanishes."""
        a, k = divmod(row, 3)
        halves = [(self._scaled[3 * k + K], self._by_column(3 * a + K, column)) for K in range(3)]
        return self._sum(f"f_{row}_{column}", halves)

    def _by_column(self, row: int, column: int) -> str:
        """Σ_L C[aK, bL] G[l, L]."""
        if (row, column) not in self._half:
            b, direction = divmod(column, 3)
            terms = [(self._G[3 * direction + L], self._C.get((row, 3 * b + L), ""))
                     for L in range(3)]  # fmt: skip
            self._half[row, column] = self._sum(f"h_{row}_{column}", terms)
        return self._half[row, column]

    def _sum(self, name: str, terms: list[tuple[str, str]]) -> str:
        products = [f"{factor} * {value}" for factor, value in terms if value]
        return self._named(name, " + ".join(products)) if products else ""

    def _named(self, name: str, text: str) -> str:
        self.lines.append(f"const vec {name} = {text};")
        return name
