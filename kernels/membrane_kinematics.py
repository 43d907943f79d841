"""What an energy sees of a membrane, `k`: its in-plane tensor, completed by λ3 = 1/J_s."""

from __future__ import annotations

from functools import cached_property
from typing import Any

from . import tensors as e
from .kinematics import Kinematics, Unavailable, matrix


class SurfaceKinematics(Kinematics):
    """Kinematics of a volume-preserving membrane.

    Args:
        in_plane: C_s (2, 2) in an orthonormal frame of the rest surface; UFL or numbers.
    """

    def __init__(self, in_plane: Any) -> None:
        self._in_plane = in_plane
        rows = [[in_plane[0, 0], in_plane[0, 1], 0], [in_plane[1, 0], in_plane[1, 1], 0]]
        whole = matrix([*rows, [0, 0, 1 / e.det(in_plane)]], in_plane)
        super().__init__(C=whole, J=_one(in_plane))

    @cached_property
    def I1_s(self) -> Any:
        """tr C_s."""
        return e.tr(self._in_plane)

    @cached_property
    def J_s(self) -> Any:
        """√det C_s, the area ratio."""
        return e.sqrt(e.det(self._in_plane))

    @cached_property
    def trace_U(self) -> Any:
        """√(tr C_s + 2 J_s) + 1/J_s: the sum of two in-plane stretches in closed form."""
        return e.sqrt(self.I1_s + 2 * self.J_s) + 1 / self.J_s

    @cached_property
    def qr_strain(self) -> Any:
        raise Unavailable(
            "k.qr_strain depends on the order of a cell's vertices and cannot make a skin; "
            "use k.trace_U, as corotational_polar does."
        )


def _one(like: Any) -> Any:
    if not e.is_symbolic(like):
        return 1.0
    import ufl

    return ufl.as_ufl(1.0)
