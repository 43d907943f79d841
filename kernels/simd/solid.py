"""Tangent of a solid on its loaded shape from dψ/dF and d²ψ/dF² at each point, the rest by hand.

The unknown is u' with F = (I + ∇u')⁻¹; FFCx would differentiate through that inverse and through
the cell's geometry, whose products would then be in every entry. Here its graph is that of the law
alone, a function of F. With L = ∂ξ/∂X (to the reference cell from the shape at rest),
h_i = Lᵀ ∂φ_i/∂ξ, P = dψ/dF, A = d²ψ/dF² and the volume c at rest, R_i[a] = c Σ P[aR] h_i[R]. From
dF = -F ∇du' F follow dh_i = dFᵀ F⁻ᵀ h_i and dc = c tr(F ∇du'); together, b of the column's node j,

    K_ij[a, b] = c Σ h_i[R] B[aR, bS] h_j[S],
    B[aR, bS] = P[aR] δ_bS - P[aS] δ_Rb - Σ_k A[aR, kS] F[kb]
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from itertools import product

import numpy as np

from .tables import Array, number

_THREE = range(3)
_PAIRS = [(i, j) for i in _THREE for j in _THREE]
#: Entries of the lower triangle of A, rows and columns aR, in their order.
LOWER = [(p, q) for p in range(9) for q in range(p + 1)]

#: Entries (aR, bS) of a tensor in C; those that vanish are None or not there.
Tensor = dict[tuple[int, int], str | None]
#: (names of F's entries) → (statements, C of the values; None where it vanishes)
Values = Callable[[list[str]], tuple[list[str], list[str | None]]]


@dataclass(frozen=True)
class Solid:
    """Shape functions and points.

    Attributes:
        gradients: of the shape functions (points, nodes, 3) on the reference cell.
        weights: of the points (points,).
    """

    gradients: Array
    weights: Array

    @property
    def is_linear(self) -> bool:
        """Whether it is P1 at one point: gradients -1, -1, -1 and the three unit vectors."""
        unit = np.vstack([-np.ones(3), np.eye(3)])
        return self.gradients.shape == (1, 4, 3) and np.array_equal(self.gradients[0], unit)


def tangent(solid: Solid, values: Values) -> str:
    """C of the body that adds K to A; ``values`` gives P's nine entries, then `LOWER` of A's."""
    lines, entries = values([f"F{a}{R}" for a, R in _PAIRS])
    A: Tensor = {}
    for (p, q), value in zip(LOWER, entries[9:], strict=True):
        A[p, q] = A[q, p] = value
    definitions, B = _with_moving_geometry(A, entries[:9])
    write = _linear_tangent if solid.is_linear else _tangent
    return write(solid, [*lines, *definitions], B)


def _with_moving_geometry(A: Tensor, P: list[str | None]) -> tuple[list[str], Tensor]:
    """Statements that define B, and its entries."""
    lines, B = [], Tensor()
    for (a, R), (b, S) in product(_PAIRS, _PAIRS):
        row, column = 3 * a + R, 3 * b + S
        moduli = ((A[row, 3 * k + S], f"F{k}{b}") for k in _THREE)
        text = "".join(f" - {value} * {f}" for value, f in moduli if value)
        if R != S and b == R and P[3 * a + S]:
            text = f" - {P[3 * a + S]}{text}"
        if R != S and b == S and P[row]:
            text = f"{P[row]}{text}"
        if text:
            B[row, column] = f"B{row}_{column}"
            lines.append(_const(f"B{row}_{column}", text))
    return lines, B


def _tangent(solid: Solid, lines: list[str], B: Tensor) -> str:
    n = solid.gradients.shape[1]
    define = (f"h[i][{R}] = d[0] * L0{R} + d[1] * L1{R} + d[2] * L2{R};" for R in _THREE)
    entries = [f"A[(3 * i + {a}) * {3 * n} + 3 * j + {b}] += "
               f"t{a}{b}0 * h[j][0] + t{a}{b}1 * h[j][1] + t{a}{b}2 * h[j][2];"
               for a, b in _PAIRS]  # fmt: skip
    return _over_points(solid, [
        *lines, f"vec h[{n}][3];", *_over_nodes(solid, define),
        f"for (int i = 0; i < {n}; ++i) {{", *_half(B, ["h[i][0]", "h[i][1]", "h[i][2]"]),
        f"for (int j = 0; j < {n}; ++j) {{", *entries, "}", "}",
    ])  # fmt: skip


def _half(B: Tensor, h: list[str]) -> list[str]:
    """t[a, bS] = c Σ_R h[R] B[aR, bS]."""
    lines = [_const(f"s{R}", f"c * {h[R]}") for R in _THREE]
    for a in _THREE:
        for b, S in _PAIRS:
            text = _dot((B.get((3 * a + R, 3 * b + S)), f"s{R}") for R in _THREE)
            lines.append(_const(f"t{a}{b}{S}", text))
    return lines


def _linear_tangent(solid: Solid, lines: list[str], B: Tensor) -> str:
    """h_i is row i - 1 of L, and all rows and columns of K sum to zero: h_0 = -h_1 - h_2 - h_3."""
    lines = [*_linear_geometry(solid), *lines]
    for i in _THREE:
        lines += [line.replace(" s", f" s{i}").replace(" t", f" t{i}")
                  for line in _half(B, [f"L{i}{R}" for R in _THREE])]  # fmt: skip
        for j, (a, b) in product(_THREE, _PAIRS):
            text = _dot((f"t{i}{a}{b}{S}", f"L{j}{S}") for S in _THREE)
            lines.append(_const(f"K{i}{a}{j}{b}", text))
            lines.append(f"A[{12 * (3 * i + 3 + a) + 3 * j + 3 + b}] += K{i}{a}{j}{b};")
    for a, b in _PAIRS:
        for i in _THREE:
            row = " + ".join(f"K{i}{a}{j}{b}" for j in _THREE)
            column = " + ".join(f"K{j}{a}{i}{b}" for j in _THREE)
            lines.append(_const(f"N{i}{a}{b}", row))
            lines.append(f"A[{12 * (3 * i + 3 + a) + b}] -= N{i}{a}{b};")
            lines.append(f"A[{12 * a + 3 * i + 3 + b}] -= {column};")
        lines.append(f"A[{12 * a + b}] += N0{a}{b} + N1{a}{b} + N2{a}{b};")
    return "\n".join(lines)


def _const(name: str, text: str) -> str:
    return f"const vec {name} = {text.removeprefix(' ')};"


def _dot(terms: Iterable[tuple[str | None, str]]) -> str:
    return " + ".join(f"{a} * {b}" for a, b in terms if a) or "(vec){0}"


def _inverse(of: str, to: str, determinant: str) -> list[str]:
    """Statements that define the inverse of a 3 × 3 matrix, and its determinant."""
    lines = []
    for i, j in _PAIRS:
        (k, m), (p, q) = ((j + 1) % 3, (j + 2) % 3), ((i + 1) % 3, (i + 2) % 3)
        minor = f"{of}{k}{p} * {of}{m}{q} - {of}{k}{q} * {of}{m}{p}"
        lines.append(_const(f"{to}{i}{j}_", minor))
    expansion = " + ".join(f"{of}{i}0 * {to}0{i}_" for i in _THREE)
    lines += [_const(determinant, expansion), _const(f"{determinant}_inv", f"1.0 / {determinant}")]
    return lines + [_const(f"{to}{i}{j}", f"{to}{i}{j}_ * {determinant}_inv") for i, j in _PAIRS]


def _kinematics(weight: str) -> list[str]:
    """F, L and c from J = ∂x/∂ξ and D = ∂u'/∂ξ; G = I + ∇u', M is the inverse of J."""
    lines = _inverse("J", "M", "det")
    lines += [_const(f"G{a}{k}", ("1.0 + " if a == k else "")
                     + _dot((f"D{a}{r}", f"M{r}{k}") for r in _THREE))
              for a, k in _PAIRS]  # fmt: skip
    lines += _inverse("G", "F", "ratio")
    lines += [_const(f"L{r}{R}", _dot((f"M{r}{k}", f"F{k}{R}") for k in _THREE))
              for r, R in _PAIRS]  # fmt: skip
    return [*lines, _const("c", f"supple_abs(det) * {weight} * ratio")]


def _linear_geometry(solid: Solid) -> list[str]:
    lines = [_const(f"{to}{a}{r}", f"{of}[{3 * r + 3 + a}] - {of}[{a}]")
             for to, of in (("J", "x"), ("D", "w")) for a, r in _PAIRS]  # fmt: skip
    return lines + _kinematics(number(solid.weights[0]))


def _over_points(solid: Solid, lines: list[str]) -> str:
    points, nodes, _ = solid.gradients.shape
    rows = (", ".join(number(v) for v in row) for row in solid.gradients.reshape(-1, 3))
    braces = ", ".join(f"{{{row}}}" for row in rows)
    weights = ", ".join(number(v) for v in solid.weights)
    sums = [f"{to}{a}{r} += {of}[3 * i + {a}] * d[{r}];"
            for to, of in (("J", "x"), ("D", "w")) for a, r in _PAIRS]  # fmt: skip
    nought = ", ".join(f"{to}{a}{r} = {{0}}" for to in "JD" for a, r in _PAIRS)
    return "\n".join([
        f"static const double slope[{points * nodes}][3] = {{{braces}}};",
        f"static const double weight[] = {{{weights}}};",
        f"for (int iq = 0; iq < {points}; ++iq) {{",
        f"vec {nought};",
        *_over_nodes(solid, sums),
        *_kinematics("weight[iq]"),
        *lines,
        "}",
    ])  # fmt: skip


def _over_nodes(solid: Solid, lines: Iterable[str]) -> list[str]:
    n = solid.gradients.shape[1]
    return [f"for (int i = 0; i < {n}; ++i) {{", f"const double* d = slope[{n} * iq + i];",
            *lines, "}"]  # fmt: skip
