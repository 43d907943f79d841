"""From the prone shape to the supine one, and a tumour carried along.

    prone shape ─► rest shape (exact inverse, gravity -y) ─► supine shape (gravity +y)

LPS: prone gravity is -y, supine +y. Mazier 2022, chapters 3 and 5; DESIGN §9.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from supple.breast.model import Materials, build_body
from supple.errors import ConvergenceError, SuppleError

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

    import supple
    from supple.breast.tetra import BreastMesh
    from supple.state import Rest, State

    Floats = NDArray[np.float64]

#: m/s².
GRAVITY = 9.81
PRONE, SUPINE = (0.0, -GRAVITY, 0.0), (0.0, GRAVITY, 0.0)
#: Of a pose: 1e-8 of the forces leaves less than a micrometre in a breast.
RTOL = 1e-8
#: Newton iterations after which a shape is given up, and after which one of many trials is.
PATIENCE, IMPATIENCE = 300, 60
#: Times stiffer that are tried for a body too soft to have a rest shape.
STIFFER = (1.25, 1.6, 2.0, 3.0, 5.0, 10.0)

Watch = Callable[[str, float], None]


@dataclass(frozen=True)
class MaterialPoint:
    """A point that moves with a cell: its number and barycentric coordinates (4,) in it."""

    cell: int
    weights: Floats

    @classmethod
    def at(cls, point: ArrayLike, points: Floats, cells: NDArray[np.integer]) -> MaterialPoint:
        """The material point at ``point`` (3,) of tetrahedra ``cells`` (c, 4) on ``points`` (n, 3).

        Just outside of the body it belongs to the cell that it is least far beyond a face of.
        """
        corners = points[cells[:, :4]]
        edges = np.swapaxes(corners[:, 1:] - corners[:, :1], 1, 2)
        offset = np.asarray(point, dtype=float) - corners[:, 0]
        inner = np.linalg.solve(edges, offset[..., None])[..., 0]
        weights = np.column_stack([1.0 - inner.sum(axis=1), inner])
        cell = int(weights.min(axis=1).argmax())
        return cls(cell, weights[cell])

    def on(self, points: Floats, cells: NDArray[np.integer]) -> Floats:
        """Where it is (3,) when the nodes are at ``points`` (n, 3)."""
        return np.asarray(self.weights @ points[cells[self.cell, :4]])


@dataclass(frozen=True)
class Poses:
    """The three shapes of one body."""

    body: supple.Body  #: on the prone mesh
    rest: Rest
    supine: State

    @property
    def points(self) -> dict[str, Floats]:
        """Pose → (n, 3) m."""
        prone = np.asarray(self.body.mesh.points)
        return {"prone": prone, "rest": self.rest.points, "supine": self.supine.points}

    def carry(self, point: ArrayLike) -> dict[str, Floats]:
        """Where the material point that is at ``point`` (3,) m when prone is in every pose."""
        cells = self.body.mesh.cells
        carried = MaterialPoint.at(point, self.points["prone"], cells)
        return {pose: carried.on(points, cells) for pose, points in self.points.items()}

    def least_volume_ratio(self) -> float:
        """The smallest J of a cell, rest to prone and rest to supine."""
        return float(min(self.rest.volume_ratio().min(), self.supine.volume_ratio().min()))

    def round_trip_mm(self) -> float:
        """How far from the prone shape the rest shape lands when it is put prone again, at most."""
        body = self.body.on(self.rest.mesh).gravity(PRONE)
        again = body.solve(rtol=RTOL)
        return float(1e3 * np.linalg.norm(again.points - self.points["prone"], axis=1).max())


def solve_poses(
    body: supple.Body,
    start: Poses | None = None,
    watch: Watch | None = None,
    rtol: float = RTOL,
    patience: int = PATIENCE,
) -> Poses:
    """Rest and supine shape of a prone body.

    Args:
        body: on the prone mesh; its gravity is set.
        start: the same body with other parameters, whose supine shape is near; speeds up.
        watch: told the stage ("rest" or "supine") and the share of the load that is on.
        rtol: as in `Body.solve`.
        patience: Newton iterations after which a shape is given up.

    Raises:
        ConvergenceError: there is no rest shape, or no supine one, with the cause.
    """
    body.gravity(PRONE)
    rest = body.rest_shape(rtol=rtol, progress=_progress("rest", watch, patience))
    loaded = body.on(rest.mesh).gravity(SUPINE)
    return Poses(body, rest, _supine(loaded, start, watch, rtol, patience))


def _supine(
    body: supple.Body, start: Poses | None, watch: Watch | None, rtol: float, patience: int
) -> State:
    if start is not None:
        try:
            return body.solve(
                start=start.supine, rtol=rtol, progress=_progress("supine", watch, IMPATIENCE)
            )
        except SuppleError:  # too far off, cells would be inverted: from the rest shape then
            pass
    return body.solve(rtol=rtol, progress=_progress("supine", watch, patience))


def _progress(stage: str, watch: Watch | None, patience: int) -> Callable[[dict[str, float]], None]:
    """A hook that reports the load and gives a hopeless solve up."""
    count = 0

    def report(iteration: dict[str, float]) -> None:
        nonlocal count
        count += 1
        if watch is not None:
            watch(stage, iteration["load_factor"])
        if count > patience:
            raise ConvergenceError(
                f"no {stage} shape: given up after {patience} iterations at "
                f"{100 * iteration['load_factor']:.0f} % of gravity; give a stiffer breast.",
                load_factor=iteration["load_factor"],
                cause=f"no {stage} shape was found in {patience} iterations",
            )

    return report


def solve_or_advise(
    mesh: BreastMesh, materials: Materials, support: str, watch: Watch | None = None
) -> Poses:
    """`solve_poses` of a breast; where it fails the error says how stiff a breast would do.

    Raises:
        ConvergenceError: cause, and the stiffness from which on there is a result.
    """
    try:
        return solve_poses(build_body(mesh, materials, support), watch=watch)
    except ConvergenceError as error:
        raise _advised(error, mesh, materials, support) from error


def _advised(
    error: ConvergenceError, mesh: BreastMesh, materials: Materials, support: str
) -> ConvergenceError:
    advice = "no stiffness up to 10 times it does either: look at the mesh and its support"
    for factor in STIFFER:
        stiffer = materials.stiffer(factor)
        try:
            solve_poses(build_body(mesh, stiffer, support), patience=IMPATIENCE)
        except ConvergenceError:
            continue
        advice = f"a breast {factor:g} times stiffer has both shapes ({stiffer.described()})"
        break
    return ConvergenceError(
        f"{materials.described()} leads to no result; {advice}; cause: {error.cause}; "
        f"{100 * error.load_factor:.0f} % of gravity was reached.",
        history=error.history,
        cells=error.cells,
        load_factor=error.load_factor,
        cause=error.cause,
    )


def softest(mesh: BreastMesh, materials: Materials, support: str, rounds: int = 6) -> Materials:
    """The softest tissue, down to a tenth, with which rest and supine shape still exist.

    Continuation in the stiffness, then bisection of its logarithm; the skin stays as it is.

    Raises:
        ConvergenceError: the given materials have no such shapes themselves.
    """
    solve_or_advise(mesh, materials, support)
    works, fails = 0.0, float(np.log(0.1))
    for _ in range(rounds):
        middle = 0.5 * (works + fails)
        try:
            body = build_body(mesh, materials.stiffer(float(np.exp(middle))), support)
            solve_poses(body, patience=IMPATIENCE)
        except ConvergenceError:
            fails = middle
        else:
            works = middle
    return materials.stiffer(float(np.exp(works)))
