"""The sagging block: a cube under its own weight, and the cube again from the shape it sags to.

    μ, λ → forward solve → loaded shape → rest shape → distance to the cube

Unit cube, y = 0 held, 1000 kg/m³, 9.81 m/s² along -y, mixed P2–P1 on 3³ cubes of six tetrahedra,
neo-Hookean with μ and λ drawn uniformly (Mazier 2022, §3.3.2). The energy is that of eq. 38; the
pressure is the multiplier of J - 1 where eq. 38 has ln J (`kernels.energy.Volumetric` says why).

Below μ ≈ 0.48 ρ g h the block has no stable shape under its weight: the softest sway of its top
loses its stiffness. Such samples are told apart from those that an inverse solve would fail on.
"""

from __future__ import annotations

import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from ..body import Body
from ..errors import ConvergenceError
from ..mesh import Mesh
from ..state import Rest, State

Floats = npt.NDArray[np.float64]

LAW = Path(__file__).with_name("neo_hookean_lame.py")
DENSITY, GRAVITY, CUBES = 1000.0, 9.81, 3
#: Ranges of the drawn parameters, Pa.
MU, LMBDA = (2e3, 2e5), (8e4, 8e6)
#: Parameters, Pa, whose error the thesis prints, m.
PRINTED = {(175e3, 50e5): 1.21e-9, (20e3, 30e5): 1.21e-5}
#: A rest shape may miss the cube by this much, m (mean distance of its nodes).
BAR = 1e-9

SOLVED, NO_FORWARD, NO_REST = "solved", "no stable forward solution", "no rest shape"


@dataclass(frozen=True)
class Outcome:
    """What one sample gave; lengths in m, NaN where there are none.

    Attributes:
        mae: mean distance of the rest shape's nodes to those of the cube.
        largest: largest such distance.
        reversed_gravity: `mae` of the shortcut that lets gravity act upwards on the loaded shape.
        sag: how far the centre of the top sinks.
        smallest_j: smallest J at a quadrature point of the loaded shape.
        iterations: of the forward and of the inverse solve.
        reason: cause, where it is not solved.
    """

    outcome: str
    mae: float = np.nan
    largest: float = np.nan
    reversed_gravity: float = np.nan
    sag: float = np.nan
    smallest_j: float = np.nan
    iterations: tuple[int, int] = (0, 0)
    reason: str = ""
    cpu_seconds: float = 0.0


def draw(samples: int, seed: int) -> Floats:
    """(samples, 2) μ and λ, Pa; more samples of a seed begin with those of fewer."""
    low, high = np.transpose([MU, LMBDA])
    return np.random.default_rng(seed).uniform(low, high, (samples, 2))


class Block:
    """The block, for one sample after the other; a sample's answer depends on no other's.

    Args:
        cubes: along an edge.
        element: "P1" or "P2".
        formulation: "mixed" (P2) or "displacement".
    """

    def __init__(self, cubes: int = CUBES, element: str = "P2", formulation: str = "mixed") -> None:
        mesh = Mesh.box((cubes,) * 3, (1.0, 1.0, 1.0), element)
        body = Body(mesh, LAW, formulation, density=DENSITY)
        self.body = body.fix(lambda x: x[:, 1] < 1e-9).gravity((0.0, -GRAVITY, 0.0))
        # The scale of the pressure unknowns is that of the first solve: one for all samples.
        self.body.solve()

    @property
    def mesh(self) -> Mesh:
        """The cube, m."""
        return self.body.mesh

    def run(self, mu: float, lmbda: float) -> Outcome:
        """There and back for one material, Pa."""
        begin = time.process_time()
        found = self._there_and_back(mu, lmbda)
        return Outcome(**found, cpu_seconds=time.process_time() - begin)

    def _there_and_back(self, mu: float, lmbda: float) -> dict[str, Any]:
        try:
            state = self.body.set(mu=mu, lmbda=lmbda).solve()
        except ConvergenceError as failure:
            return {"outcome": NO_FORWARD, "reason": failure.cause}
        loaded = self.body.on(self.mesh.moved(state.points))
        sagged = {
            "sag": self._sag(state),
            "smallest_j": float(state.volume_ratio().min()),
            "reversed_gravity": self._shortcut(loaded),
        }
        try:
            rest = loaded.rest_shape()
        except ConvergenceError as failure:
            return {"outcome": NO_REST, "reason": failure.cause, **sagged}
        return {"outcome": SOLVED, **sagged, **self._compared(state, rest)}

    def _compared(self, state: State, rest: Rest) -> dict[str, Any]:
        off = self._distance(rest)
        return {
            "mae": float(off.mean()),
            "largest": float(off.max()),
            "iterations": (state.iterations, rest.iterations),
        }

    def _sag(self, state: State) -> float:
        """Of the node at the top's centre, or of the middle of the edge that crosses it."""
        far = np.linalg.norm(self.mesh.points - [0.5, 1.0, 0.5], axis=1)
        on_diagonal = abs(self.mesh.points[:, 0] - self.mesh.points[:, 2]) < 1e-9
        far[~on_diagonal] = np.inf
        return -float(state.u[far < far.min() + 1e-9, 1].mean())

    def _shortcut(self, loaded: Body) -> float:
        try:
            return float(self._distance(loaded.rest_shape(method="reversed-gravity")).mean())
        except ConvergenceError:
            return float("nan")

    def _distance(self, rest: Rest) -> Floats:
        return np.asarray(np.linalg.norm(rest.points - self.mesh.points, axis=1))
