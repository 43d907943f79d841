"""The degree of a quadrature rule and its scheme: which there are, on which cells.

Basix' names: "default" (Gauss on cubes; on simplices a symmetric rule), "gauss_jacobi" (collapsed
on simplices), "gll" (Gauss–Lobatto–Legendre: with the vertices; on cubes), "xiao_gimbutas" (on
simplices). A prism takes the triangle's rule times Gauss. Every rule that is let through has
positive weights and points inside its cell. Nothing of Basix is imported here.
"""

from __future__ import annotations

from operator import index
from typing import Any

#: scheme → cell → highest degree.
SCHEMES = {
    "default": {"tetrahedron": 20, "hexahedron": 20, "prism": 20},
    "gauss_jacobi": {"tetrahedron": 20, "hexahedron": 20, "prism": 20},
    "gll": {"hexahedron": 20},
    "xiao_gimbutas": {"tetrahedron": 15, "prism": 20},
}


class Degree(int):
    """A degree that knows its scheme; a plain int stands for Basix' default.

    It is an int so that whoever only counts polynomial degrees need not know of schemes.
    """

    scheme: str

    def __new__(cls, degree: int, scheme: str = "default") -> Degree:
        new = super().__new__(cls, degree)
        new.scheme = scheme
        return new

    def __eq__(self, other: object) -> bool:
        same = isinstance(other, int) and int(self) == int(other)
        return same and self.scheme == scheme_of(other)

    def __ne__(self, other: object) -> bool:
        return not self == other

    def __hash__(self) -> int:
        return hash(int(self))


def scheme_of(degree: object) -> str:
    """The scheme of a degree, "default" for a plain number."""
    return getattr(degree, "scheme", "default")


def checked(degree: Any, cell: str) -> Degree:
    """A degree, or (degree, scheme), as asked for on a cell by Basix' name.

    Raises:
        ValueError: one sentence on what there is instead.
    """
    pair = isinstance(degree, tuple | list) and len(degree) == 2
    given, scheme = degree if pair else (degree, "default")
    try:
        number = index(given)
    except TypeError:
        raise ValueError(
            f"quadrature must be a degree or (degree, scheme), such as (4, 'gll'), got {degree!r}."
        ) from None
    on_cell = {name: cells[cell] for name, cells in SCHEMES.items() if cell in cells}
    if scheme not in on_cell:
        names = ", ".join(on_cell)
        raise ValueError(f"quadrature on a {cell} must be one of {names}, got {scheme!r}.")
    if not 1 <= number <= on_cell[scheme]:
        raise ValueError(
            f"quadrature must be a degree from 1 to {on_cell[scheme]} for {scheme!r} on a {cell}, "
            f"got {number}."
        )
    return Degree(number, scheme)


def named(degree: int) -> str:
    """What a unit's name says: q6, or q6-xiao_gimbutas."""
    scheme = scheme_of(degree)
    return f"q{int(degree)}" if scheme == "default" else f"q{int(degree)}-{scheme}"


def parse(name: str) -> Degree:
    """The degree of such a name.

    Raises:
        ValueError: no such name.
    """
    number, _, scheme = name.removeprefix("q").partition("-")
    if not name.startswith("q") or not number.isdecimal() or (scheme or "default") not in SCHEMES:
        raise ValueError(f"quadrature must be named q<degree>[-<scheme>], got {name!r}.")
    return Degree(int(number), scheme or "default")
