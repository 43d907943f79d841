"""Directions of a law, such as fibres: at rest, under load, and a rest shape from the latter.

A body's directions f0 are those of its rest shape, one a cell. Each is a line of matter: under load
it lies along f ∥ F̄ f0, with F̄ the cell's deformation gradient averaged over its rest volume. Where
an image of the loaded shape gives f, f0 ∥ F̄⁻¹ f and F̄ depends on f0 through the stress:

    f0 ← f                                     as if nothing turned
    repeat: rest shape with f0 → F̄ → F̄⁻¹ f     until no direction turns by more than SETTLED
            f0 ← Anderson's mix of the last F̄⁻¹ f

Several directions of one law go back each on its own. A pair that is orthonormal under load is not
so at rest; laws that want orthogonal axes make them (`supple.energy.axes`): the fibre as it is, the
sheet in the plane of both lines.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from . import terms
from .acceleration import Anderson
from .errors import ConvergenceError

if TYPE_CHECKING:
    from .body import Body
    from .state import Equilibrium, Rest

Floats = npt.NDArray[np.float64]
#: Turns, rad, at which the directions are settled; at which rounding may keep them from it.
SETTLED, ROUNDING = 1e-12, 1e-10
#: Inverse solves before giving up, and how many of them a mix remembers.
_PATIENCE, _DEPTH = 60, 5
_CAUSE = "the directions at rest do not settle: they depend too much on the strain that they shape"


def of(found: Equilibrium, loaded: bool) -> dict[str, Floats]:
    """Name → unit vectors (c, 3) of an equilibrium's laws; NaN in cells whose law has none."""
    d = found._solved
    table = {name: np.full((len(d.mesh.cells), 3), np.nan) for _, name in _places(d)}
    for region, name in _places(d):
        table[name][region.ids] = region.values[name]
    if not loaded or not table:
        return table
    F = found.deformation_gradient()
    return {name: _unit(np.einsum("cij,cj->ci", F, f)) for name, f in table.items()}


def has_any(body: Body) -> bool:
    """Whether a law of the body has a direction."""
    return bool(_places(body._description))


def rest_of_loaded(
    body: Body,
    start: Rest | None,
    solve: Callable[[Body, Rest | None], Rest],
    mirrored: bool,
    rounding: float = ROUNDING,
) -> Rest:
    """The rest shape of a body whose directions are those of the loaded shape.

    Args:
        start: a rest shape to start from, with its directions.
        solve: rest shape of a body whose directions are those at rest.
        rounding: turn, rad, below which `solve` is not exact enough to tell any more.
        mirrored: that `solve` takes the loaded shape for the one at rest, so that its directions
            are the ones given: nothing to repeat.

    Raises:
        ConvergenceError: `solve` raised it, or the directions do not settle.
    """
    trial = body.on(body.mesh)
    trial._built, trial._judging = body._built, body._judging  # the same terms, other values
    given = _stacked(trial)
    if mirrored:
        rest = solve(trial, start)
        return _with(rest, _pulled_back(rest, given, trial))
    return _settled(trial, given, start, solve, rounding)


def _settled(
    trial: Body,
    given: Floats,
    start: Rest | None,
    solve: Callable[[Body, Rest | None], Rest],
    rounding: float,
) -> Rest:
    f, rest = given if start is None else _pulled_back(start, given, trial), start
    found: list[Rest] = []
    turns: list[float] = []
    acceleration = Anderson(_DEPTH)
    for _ in range(_PATIENCE):
        _hand(trial, f)
        rest = solve(trial, rest)
        found.append(rest)
        back = _pulled_back(rest, given, trial)
        turns.append(float(np.linalg.norm(back - f, axis=1).max()))
        falls = len(turns) < 2 or turns[-1] < 0.5 * turns[-2]
        if turns[-1] <= SETTLED or (turns[-1] <= rounding and not falls):
            return _summed(rest, found)
        f = _unit(acceleration.step(f.ravel(), (back - f).ravel()).reshape(-1, 3))
    raise ConvergenceError(
        f"no rest shape: {_CAUSE}; after {len(turns)} rest shapes they still turn by "
        f"{turns[-1]:.3g} rad; try a smaller load, or give the directions at rest "
        '(directions_of="rest").',
        history=[{"iteration": k + 1, "turn": turn} for k, turn in enumerate(turns)],
        load_factor=1.0,
        cause=_CAUSE,
    )


def _places(d: terms.Description) -> list[tuple[terms.Region, str]]:
    return [
        (region, p.name)
        for region in d.regions
        for p in region.law.parameters
        if p.kind.size > 1 and len(region.ids)
    ]


def _stacked(body: Body) -> Floats:
    """Directions (k, 3) of all laws, one after another, each on its cells."""
    return np.concatenate([region.values[name] for region, name in _places(body._description)])


def _hand(body: Body, f: Floats) -> None:
    """Give the body new directions (k, 3), stacked."""
    first = 0
    for region, name in _places(body._description):
        region.values[name] = f[first : first + len(region.ids)]
        first += len(region.ids)


def _pulled_back(rest: Rest, given: Floats, body: Body) -> Floats:
    """F̄⁻¹ f at length 1, stacked like f."""
    cells = np.concatenate([region.ids for region, _ in _places(body._description)])
    F = rest.deformation_gradient()[cells]
    return _unit(np.linalg.solve(F, given[..., None])[..., 0])


def _unit(f: Floats) -> Floats:
    return np.asarray(f / np.linalg.norm(f, axis=-1, keepdims=True))


def _with(rest: Rest, f: Floats) -> Rest:
    """The same shape of a body with directions ``f`` (k, 3), stacked."""
    body = rest._body.on(rest._body.mesh)
    _hand(body, f)
    return replace(rest, _body=body, _solved=terms.snapshot(body._description))


def _summed(rest: Rest, found: list[Rest]) -> Rest:
    """The last rest shape with the work of all."""
    from .state import PHASES

    return replace(
        rest,
        iterations=sum(r.iterations for r in found),
        history=[iteration for r in found for iteration in r.history],
        timings=rest.timings | {n: sum(float(r.timings[n]) for r in found) for n in PHASES},
    )
