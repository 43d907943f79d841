"""Which linear solver serves a body's symmetric tangents, and why, in one sentence."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from . import mkl, multigrid
from .choices import SYMMETRIC_SOLVERS
from .core import core
from .errors import InputError

if TYPE_CHECKING:
    from .mesh import Mesh

#: Unknowns from which a factor is worth keeping: below, making one costs no more than calls do.
_KEEP = 1_000
#: Flops of a factor for each unknown from which multigrid is quicker than a factor in single
#: precision, what it takes to ask included; that of a P1 block of some 25,000 unknowns. Slender
#: bodies stay below, and solve a second time 1.3 to 1.7 times as fast on a factor.
_HEAVY = 4e5
#: Unknowns below which to order them, and so to count the flops, costs more than multigrid gains,
#: and above which they need not be counted.
_LIGHT, _HUGE = 20_000, 300_000


@dataclass(frozen=True)
class Pick:
    """A name of `choices.SYMMETRIC_SOLVERS` or "gmres", not "auto", and the reason for it."""

    name: str
    why: str

    def __str__(self) -> str:
        return f"{self.name}: {self.why}"


def require_known(solver: str) -> None:
    """Refuse a name that is none of `choices.SYMMETRIC_SOLVERS`.

    Raises:
        InputError: another name.
    """
    if solver not in SYMMETRIC_SOLVERS:
        names = ", ".join(f'"{name}"' for name in SYMMETRIC_SOLVERS)
        raise InputError(f"solver must be one of {names}, got {solver!r}.")


def pick(asked: str, system: Any, unknowns: int, gmres: bool = False) -> Pick:
    """What to solve a system with.

    Args:
        asked: one of `choices.SYMMETRIC_SOLVERS`, which are for direct forms.
        unknowns: free dofs.
        gmres: an inverse form is to be solved so.

    Raises:
        InputError: the solver asked for is not installed, or not for such a body.
    """
    if gmres:
        return Pick("gmres", "one symmetric factor serves many unsymmetric tangents")
    if asked == "multigrid":
        multigrid.require_available()
        if not system.is_minimised():
            raise InputError(
                'solver "multigrid" wants a body whose tangents are symmetric positive definite: '
                "no pressure that follows, no mixed formulation, no inverse form; "
                'choose solver "direct".'
            )
    if asked == "pardiso":
        mkl.load()
        return Pick("pardiso", "as asked")
    if not system.is_minimised():
        return Pick("direct", "only tangents that should be positive definite have another way")
    if asked != "auto":
        return Pick(asked, "as asked")
    if unknowns < _KEEP:
        return Pick("direct", f"a factor of {unknowns:,} unknowns costs less than iterations")
    if unknowns < _LIGHT:
        return Pick("cg", f"a factor of {unknowns:,} unknowns is worth keeping")
    if multigrid.available() and unknowns > _HUGE:
        return Pick("multigrid", f"{unknowns:,} unknowns are many for a factor")
    flops, entries = system.predicted_factor()
    size = f"a factor of {unknowns:,} unknowns takes {flops:.1e} flops and {4e-9 * entries:.2g} GB"
    if flops < _HEAVY * unknowns:
        return Pick("cg", f"{size}, worth keeping")
    if multigrid.available():
        return Pick("multigrid", f"{size}, more than iterations do")
    return Pick("cg", f'{size}; pip install "supple[multigrid]" would spare that')


def behind(picked: Pick, asked: str, unknowns: int) -> Pick | None:
    """What to try where a solve found no equilibrium, if another way could find one.

    Along a path past limit points goes only what has factors of indefinite tangents, which
    multigrid, that was not asked for, has not.
    """
    if asked != "auto" or picked.name != "multigrid" or unknowns > _HUGE:
        return None
    return Pick("cg", "multigrid found no equilibrium")


def use(picked: Pick, system: Any, mesh: Mesh) -> None:
    """Solve the system's symmetric tangents so from now on."""
    system.use_gmres(picked.name == "gmres")
    if picked.name == "multigrid":
        system.use_grid(*multigrid.corners(mesh), multigrid.aggregate)
    if picked.name != "gmres":
        system.use_method(getattr(core().Method, picked.name))
