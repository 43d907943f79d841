"""Residual and tangent of a solid from dψ/dF and d²ψ/dF² at each point, geometry written by hand.

FFCx differentiates through the cell's geometry, so that products of its inverse Jacobian are in
every entry; here its graph is that of the law alone, a function of F. With L = ∂ξ/∂X (the inverse
of the Jacobian at rest), h_i = Lᵀ ∂φ_i/∂ξ, P = dψ/dF, A = d²ψ/dF² and a volume c at rest,

    R_i[a] = c Σ P[aR] h_i[R]                 K_ij[a, b] = c Σ h_i[R] A[aR, bS] h_j[S]

On the loaded shape the unknown is u' with F = (I + ∇u')⁻¹, so that dF = -F ∇du' F,
dh_i = dFᵀ F⁻ᵀ h_i and dc = c tr(F ∇du'). Together, b and h_j of the column's node,

    K_ij[a, b] = c Σ h_i[R] B[aR, bS] h_j[S],
    B[aR, bS] = P[aR] δ_bS - P[aS] δ_Rb - Σ_k A[aR, kS] F[kb]
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable
from dataclasses import dataclass

import numpy as np

from .tables import Array, number

_WORD = re.compile(r"\w+")
_THREE = range(3)
_PAIRS = [(i, j) for i in _THREE for j in _THREE]
#: Entries of the lower triangle of A, rows and columns aR, in the order of `Law.entries`.
LOWER = [(p, q) for p in range(9) for q in range(p + 1)]

#: (names of F's entries) → (statements, C of the values; None where it vanishes)
Values = Callable[[list[str]], tuple[list[str], list[str | None]]]


@dataclass(frozen=True)
class Solid:
    """What a kernel is written from.

    Attributes:
        gradients: of the shape functions (points, nodes, 3) on the reference cell.
        weights: of the points (points,).
        inverse: whether the mesh is the loaded shape.
    """

    gradients: Array
    weights: Array
    inverse: bool

    @property
    def is_linear(self) -> bool:
        """Whether it is P1 at one point: gradients -1, -1, -1 and the three unit vectors."""
        unit = np.vstack([-np.ones(3), np.eye(3)])
        return self.gradients.shape == (1, 4, 3) and np.array_equal(self.gradients[0], unit)


def residual(solid: Solid, stress: Values) -> str:
    """C of the body that adds R to A; ``stress`` gives the nine entries of P."""
    lines, P = stress(_names("F"))
    lines += [_const(f"Q{a}{r}", f"c * ({_dot((P[3 * a + R], f'L{r}{R}') for R in _THREE)})")
              for a, r in _PAIRS]  # fmt: skip
    if solid.is_linear:
        lines += [f"A[{3 * r + 3 + a}] += Q{a}{r};" for a, r in _PAIRS]
        lines += [f"A[{a}] -= Q{a}0 + Q{a}1 + Q{a}2;" for a in _THREE]
        return "\n".join([*_linear_geometry(solid), *lines])
    sums = (f"A[3 * i + {a}] += Q{a}0 * d[0] + Q{a}1 * d[1] + Q{a}2 * d[2];" for a in _THREE)
    return _over_points(solid, [*lines, *_over_nodes(solid, sums)])


def tangent(solid: Solid, moduli: Values) -> str:
    """C of the body that adds K to A, its lower triangle where it is symmetric.

    Args:
        moduli: gives the entries `LOWER` of A; where the mesh is the loaded shape behind P's nine.
    """
    lines, entries = moduli(_names("F"))
    P, entries = (entries[:9], entries[9:]) if solid.inverse else ([], entries)
    A: dict[tuple[int, int], str | None] = {}
    for (p, q), value in zip(LOWER, entries, strict=True):
        A[p, q] = A[q, p] = value
    if solid.inverse:
        lines += _pulled_back(A, P)
    write = _linear_tangent if solid.is_linear else _tangent
    return write(solid, lines, A)


def _pulled_back(A: dict[tuple[int, int], str | None], P: list[str | None]) -> list[str]:
    """Statements that define B; A becomes B."""
    lines, B = [], {}
    for a, R in _PAIRS:
        for b, S in _PAIRS:
            text = "".join(f" - {A[3 * a + R, 3 * k + S]} * F{k}{b}"
                           for k in _THREE if A[3 * a + R, 3 * k + S])  # fmt: skip
            plus, minus = P[3 * a + R] if b == S else None, P[3 * a + S] if b == R else None
            if b == S == R:
                plus = minus = None
            text = (plus or "") + (f" - {minus}" if minus else "") + text
            B[3 * a + R, 3 * b + S] = f"B{3 * a + R}_{3 * b + S}"
            lines.append(_const(f"B{3 * a + R}_{3 * b + S}", text or "(vec){0}"))
    A.update(B)
    return lines


def _tangent(solid: Solid, lines: list[str], A: dict[tuple[int, int], str | None]) -> str:
    n = solid.gradients.shape[1]
    define = (f"h[i][{R}] = d[0] * L0{R} + d[1] * L1{R} + d[2] * L2{R};" for R in _THREE)
    half = _half(A, "i")
    lines = [*lines, f"vec h[{n}][3];", *_over_nodes(solid, define)]
    rows = [f"for (int i = 0; i < {n}; ++i) {{", *half,
            f"for (int j = 0; j < {n if solid.inverse else 'i'}; ++j) {{",
            *_entries("i", "j", f"{3 * n}", _PAIRS), "}"]  # fmt: skip
    if not solid.inverse:
        rows += _entries("i", "i", f"{3 * n}", [(a, b) for a, b in _PAIRS if b <= a])
    return _over_points(solid, [*lines, *rows, "}"])


def _half(A: dict[tuple[int, int], str | None], i: str) -> list[str]:
    """t[a, bS] = c Σ_R h_i[R] A[aR, bS]."""
    lines = [_const(f"s{R}", f"c * h[{i}][{R}]") for R in _THREE]
    for a in _THREE:
        for b, S in _PAIRS:
            text = _dot((A[3 * a + R, 3 * b + S], f"s{R}") for R in _THREE)
            lines.append(_const(f"t{a}{b}{S}", text))
    return lines


def _entries(i: str, j: str, width: str, pairs: Iterable[tuple[int, int]]) -> list[str]:
    return [f"A[(3 * {i} + {a}) * {width} + 3 * {j} + {b}] += "
            f"t{a}{b}0 * h[{j}][0] + t{a}{b}1 * h[{j}][1] + t{a}{b}2 * h[{j}][2];"
            for a, b in pairs]  # fmt: skip


def _linear_tangent(solid: Solid, lines: list[str], A: dict[tuple[int, int], str | None]) -> str:
    """h_i is row i - 1 of L, and all rows and columns of K sum to zero: h_0 = -h_1 - h_2 - h_3."""
    lines = [*_linear_geometry(solid), *lines]
    K: dict[tuple[int, int, int, int], str] = {}
    for i in _THREE:
        half = [line.replace(f"h[{i}][", f"L{i}").replace("];", ";") for line in _half(A, str(i))]
        block = []
        for j in range(3 if solid.inverse else i + 1):
            for a, b in _PAIRS:
                if not solid.inverse and i == j and b > a:
                    continue
                name = K[i, a, j, b] = f"K{i}{a}{j}{b}"
                block.append(f"{name} = {_dot((f't{a}{b}{S}', f'L{j}{S}') for S in _THREE)};")
                block.append(f"A[{12 * (3 * i + 3 + a) + 3 * j + 3 + b}] += {name};")
        used = set(_WORD.findall("\n".join(block)))
        half = [line for line in half if line.split()[2] in used or line.split()[2][0] == "s"]
        lines += ["{", *half, *block, "}"]
    lines.insert(0, f"vec {', '.join(K.values())};")

    def entry(i: int, a: int, j: int, b: int) -> str:
        return K[i, a, j, b] if (i, a, j, b) in K else K[j, b, i, a]

    for a, b in _PAIRS:
        for i in _THREE:
            name = f"N{i}{a}{b}"
            lines.append(_const(name, " + ".join(entry(i, a, j, b) for j in _THREE)))
            lines.append(f"A[{12 * (3 * i + 3 + a) + b}] -= {name};")
            if solid.inverse:
                column = " + ".join(entry(j, a, i, b) for j in _THREE)
                lines.append(f"A[{12 * a + 3 * i + 3 + b}] -= {column};")
        if solid.inverse or b <= a:
            lines.append(f"A[{12 * a + b}] += N0{a}{b} + N1{a}{b} + N2{a}{b};")
    return "\n".join(lines)


def _names(letter: str) -> list[str]:
    return [f"{letter}{a}{b}" for a, b in _PAIRS]


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


def _kinematics(solid: Solid, weight: str) -> list[str]:
    """F, L and c from J = ∂x/∂ξ and D = ∂u/∂ξ."""
    gradient = "G" if solid.inverse else "F"
    to_reference = "M" if solid.inverse else "L"
    lines = _inverse("J", to_reference, "det")
    lines += [_const(f"{gradient}{a}{R}", ("1.0 + " if a == R else "")
                     + _dot((f"D{a}{r}", f"{to_reference}{r}{R}") for r in _THREE))
              for a, R in _PAIRS]  # fmt: skip
    volume = f"supple_abs(det) * {weight}"
    if solid.inverse:
        lines += _inverse("G", "F", "ratio")
        lines += [_const(f"L{r}{R}", _dot((f"M{r}{k}", f"F{k}{R}") for k in _THREE))
                  for r, R in _PAIRS]  # fmt: skip
        volume += " * ratio"
    return [*lines, _const("c", volume)]


def _linear_geometry(solid: Solid) -> list[str]:
    lines = [_const(f"{to}{a}{r}", f"{of}[{3 * r + 3 + a}] - {of}[{a}]")
             for to, of in (("J", "x"), ("D", "w")) for a, r in _PAIRS]  # fmt: skip
    return lines + _kinematics(solid, number(solid.weights[0]))


def _over_points(solid: Solid, lines: list[str]) -> str:
    points, nodes, _ = solid.gradients.shape
    braces = ", ".join(number(v) for v in solid.gradients.ravel())
    weights = ", ".join(number(v) for v in solid.weights)
    sums = [f"{to}{a}{r} += {of}[3 * i + {a}] * d[{r}];"
            for to, of in (("J", "x"), ("D", "w")) for a, r in _PAIRS]  # fmt: skip
    nought = ", ".join(f"{name} = {{0}}" for name in (*_names("J"), *_names("D")))
    return "\n".join([
        f"static const double slope[{points * nodes}][3] = {{{braces}}};",
        f"static const double weight[] = {{{weights}}};",
        f"for (int iq = 0; iq < {points}; ++iq) {{",
        f"vec {nought};",
        *_over_nodes(solid, sums),
        *_kinematics(solid, "weight[iq]"),
        *lines,
        "}",
    ])  # fmt: skip


def _over_nodes(solid: Solid, lines: Iterable[str]) -> list[str]:
    n = solid.gradients.shape[1]
    return [f"for (int i = 0; i < {n}; ++i) {{", f"const double* d = slope[{n} * iq + i];",
            *lines, "}"]  # fmt: skip
